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
import unittest

try:
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys
except ImportError:
    webdriver = ActionChains = By = Keys = None

EWA = SOURCE = None  # set by test_page.py
CHROMEDRIVER = shutil.which("chromedriver")
WIDTH, HEIGHT = 192, 144
PATIENCE = 180  # seconds; only a machine with no time to spare needs them


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


class BrowserTest(unittest.TestCase):
    """Has a folder and a browser."""

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder)

    @classmethod
    def open_browser(cls, **options):
        cls.driver = browser(**options)
        cls.addClassCleanup(cls.driver.quit)
        cls.driver.set_script_timeout(PATIENCE)

    @classmethod
    def serve(cls, folder):
        cls.server = served(folder)
        cls.addClassCleanup(cls.server.shutdown)

    def picture(self, name="shown.png"):
        self.driver.execute_script("document.getElementById('bar').style.visibility = 'hidden'")
        self.driver.save_screenshot(str(self.folder / name))
        return self.folder / name


class Handler(http.server.SimpleHTTPRequestHandler):
    asked = []
    refused = {}  # how often a path is answered by an error
    silent = {}   # of a path: after how many bytes each of its next answers stops, or None for no answer

    def do_GET(self):
        Handler.asked.append(self.path)
        if Handler.silent.get(self.path):
            return self.fall_silent(Handler.silent[self.path].pop(0))
        if Handler.refused.get(self.path, 0) > 0:
            Handler.refused[self.path] -= 1
            return self.send_error(503)
        super().do_GET()

    def fall_silent(self, after):
        if after is not None:
            self.send_response(200)
            self.send_header("Content-Length", "1000000")
            self.end_headers()
            self.wfile.write(b"x" * after)
        self.rfile.read()  # until the browser gives up

    def log_message(self, *arguments):
        pass


def served(folder):
    """A server of the folder's files."""
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Handler, directory=str(folder)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return server
