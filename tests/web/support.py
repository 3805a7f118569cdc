# SPDX-License-Identifier: Apache-2.0
"""What the tests of the page share: a browser, ewa, a trained run and a web server."""
import atexit
import functools
import http.server
import json
import pathlib
import shutil
import subprocess
import tempfile
import threading
import time

try:
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service
except ImportError:
    webdriver = None

EWA = SOURCE = None  # set by test_page.py
CHROMEDRIVER = shutil.which("chromedriver")
WIDTH, HEIGHT = 192, 144
PATIENCE = 60  # seconds


def browser(*more, offline=True):
    options = webdriver.ChromeOptions()
    for argument in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-angle=swiftshader",
                     "--enable-unsafe-swiftshader", "--hide-scrollbars", "--force-color-profile=srgb", *more):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(CHROMEDRIVER))
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                           {"width": WIDTH, "height": HEIGHT, "deviceScaleFactor": 1, "mobile": False})
    driver.execute_cdp_cmd("Network.enable", {})
    driver.execute_cdp_cmd("Network.setCacheDisabled", {"cacheDisabled": True})  # files change between tests
    driver.execute_cdp_cmd("Network.emulateNetworkConditions",
                           {"offline": offline, "latency": 0, "downloadThroughput": 0 if offline else -1,
                            "uploadThroughput": 0 if offline else -1})
    return driver


def run(*arguments):
    done = subprocess.run([EWA, *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def settled(driver):
    """Waits until the page shows what it was asked for, and returns its state."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        state = driver.execute_script("return document.documentElement.dataset.scene")
        if state in ("ready", "failed"):
            return state
        time.sleep(0.02)
    raise AssertionError(f"the page is still {state}")


def psnr(shown, rendered):
    figures = shown.parent / "figures.json"
    subprocess.run([EWA, "compare", shown, rendered, "--json", figures], capture_output=True, check=False)
    found = json.loads(figures.read_text())["psnr"]
    return float("inf") if found is None else found


@functools.lru_cache
def trained_run():
    """A run, in a folder that is removed at the end."""
    folder = pathlib.Path(tempfile.mkdtemp())
    atexit.register(shutil.rmtree, folder)
    data, trained = folder / "data", folder / "run"
    run("dataset", SOURCE / "scenes" / "plaster.gltf", "-o", data, "--views", 8, "--size", f"{WIDTH}x{HEIGHT}", "--quiet")
    # SH of degree 3 and a coloured background, so that the page needs all that it can do.
    run("train", data, "-o", trained, "--steps", 60, "--sh-degree", 3, "--background", "0.2,0.3,0.4", "--quiet")
    return trained


class Handler(http.server.SimpleHTTPRequestHandler):
    asked = []
    refused = {}  # how often a path is answered by an error

    def do_GET(self):
        Handler.asked.append(self.path)
        if Handler.refused.get(self.path, 0) > 0:
            Handler.refused[self.path] -= 1
            return self.send_error(503)
        super().do_GET()

    def log_message(self, *arguments):
        pass


def served(folder):
    """A server of the folder's files."""
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Handler, directory=str(folder)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return server
