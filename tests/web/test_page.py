#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The page of `ewa convert`, in a real browser: test_page.py EWA SOURCE_FOLDER. Ends with 77 where there is no browser."""
import functools
import http.server
import json
import pathlib
import shutil
import subprocess
import sys
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
    webdriver = None

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
    """A run, in a folder that unittest removes at the end."""
    folder = pathlib.Path(tempfile.mkdtemp())
    unittest.addModuleCleanup(shutil.rmtree, folder)
    data, trained = folder / "data", folder / "run"
    run("dataset", SOURCE / "scenes" / "plaster.gltf", "-o", data, "--views", 8, "--size", f"{WIDTH}x{HEIGHT}", "--quiet")
    # SH of degree 3 and a coloured background, so that the page needs all that it can do.
    run("train", data, "-o", trained, "--steps", 60, "--sh-degree", 3, "--background", "0.2,0.3,0.4", "--quiet")
    return trained


class PageTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        trained = trained_run()
        run("convert", trained, cls.folder / "page.html", "--quiet")
        shutil.copy(trained / "splats.ply", cls.folder / "alone.ply")
        run("convert", cls.folder / "alone.ply", cls.folder / "flat.html", "--max-sh", 0, "--quiet")
        cls.renders = cls.folder / "renders"
        run("render", trained, "--frames", "all", "-o", cls.renders, "--quiet")
        cls.driver = browser()

    @classmethod
    def tearDownClass(cls):
        cls.driver.quit()
        shutil.rmtree(cls.folder)

    def open(self, name, address=""):
        self.driver.get("about:blank")
        self.driver.get((self.folder / name).as_uri() + address)
        return self.settled()

    def settled(self):
        return settled(self.driver)

    def picture(self, name="shown.png"):
        self.driver.execute_script("document.getElementById('bar').style.visibility = 'hidden'")
        self.driver.save_screenshot(str(self.folder / name))
        return self.folder / name

    def psnr(self, shown, rendered):
        return psnr(shown, rendered)

    def press(self, key):
        ActionChains(self.driver).send_keys(key).perform()
        return self.settled()

    def where(self):
        return self.driver.find_element(By.ID, "where").text.removeprefix("images/")

    def test_shows_what_ewa_renders(self):
        for name in ("view_000", "view_003", "view_007"):
            self.assertEqual(self.open("page.html", f"#camera={name}.png"), "ready")
            self.assertGreater(self.psnr(self.picture(), self.renders / f"{name}.png"), 40, name)

    def test_leaves_out_what_the_scene_does_not_need(self):
        self.assertEqual(self.open("flat.html"), "ready")
        for element in ("previous", "next", "where"):
            self.assertFalse(self.driver.find_element(By.ID, element).is_displayed())

    def test_asks_for_nothing_outside_and_prints_no_error(self):
        self.driver.get_log("browser")
        self.assertEqual(self.open("page.html"), "ready")
        self.assertEqual(self.driver.get_log("browser"), [])
        names = self.driver.execute_script("return performance.getEntriesByType('resource').map(e => e.name)")
        self.assertEqual([name for name in names if not name.startswith(("blob:", "data:"))], [])

    def test_keys_go_through_the_views(self):
        self.open("page.html")
        self.press("]")
        self.assertEqual(self.where(), "view_000.png")
        self.press("]")
        self.assertEqual(self.where(), "view_001.png")
        self.press("[")
        self.press("[")
        self.assertEqual(self.where(), "view_007.png")
        self.assertGreater(self.psnr(self.picture(), self.renders / "view_007.png"), 40)
        self.press("r")
        self.assertEqual(self.where(), "")

    def test_a_drag_turns_and_a_key_moves(self):
        self.open("page.html")
        before = self.picture("before.png")
        canvas = self.driver.find_element(By.ID, "view")
        ActionChains(self.driver).drag_and_drop_by_offset(canvas, 40, 10).perform()
        self.settled()
        turned = self.picture("turned.png")
        self.assertLess(self.psnr(before, turned), 40)
        ActionChains(self.driver).key_down("w").pause(0.3).key_up("w").perform()
        self.settled()
        self.assertLess(self.psnr(turned, self.picture("moved.png")), 40)
        self.press("r")
        self.assertGreater(self.psnr(before, self.picture("home.png")), 60)

    def test_two_fingers_come_closer(self):
        self.open("page.html")
        before = self.picture("before.png")
        for kind, apart in (("touchStart", 20), ("touchMove", 40), ("touchMove", 70)):
            points = [{"x": WIDTH / 2 + side * apart, "y": HEIGHT / 2, "id": i} for i, side in enumerate((-1, 1))]
            self.driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
        self.driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
        self.settled()
        self.assertLess(self.psnr(before, self.picture("closer.png")), 40)

    def test_the_film_plays_and_stops(self):
        self.open("page.html")
        ActionChains(self.driver).send_keys(Keys.SPACE).perform()
        end = time.monotonic() + PATIENCE
        while self.driver.find_element(By.ID, "play").text != "⏸" and time.monotonic() < end:
            time.sleep(0.1)
        self.assertEqual(self.driver.find_element(By.ID, "play").text, "⏸")
        ActionChains(self.driver).send_keys(Keys.SPACE).perform()
        self.settled()
        self.assertEqual(self.driver.find_element(By.ID, "play").text, "▶")

    def test_help_opens(self):
        self.open("page.html")
        self.press("h")
        self.assertIn("splats", self.driver.find_element(By.ID, "help").text)
        self.press(Keys.ESCAPE)
        self.assertFalse(self.driver.find_element(By.ID, "help").is_displayed())

    def test_a_damaged_scene_is_said(self):
        page = (self.folder / "page.html").read_text()
        at = page.index('id="scene">') + 1000
        (self.folder / "damaged.html").write_text(page[:at] + "</script>" + page[page.index("</script>", at) + 9:])
        self.assertEqual(self.open("damaged.html"), "failed")
        self.assertIn("damaged", self.driver.find_element(By.ID, "text").text)

    def test_a_browser_without_webgl2_is_told(self):
        plain = browser("--disable-3d-apis")
        try:
            plain.get((self.folder / "page.html").as_uri())
            self.assertIn("WebGL2", plain.find_element(By.ID, "text").text)
        finally:
            plain.quit()


class StreamTest(unittest.TestCase):
    """A page with levels beside it, from a web server of files."""

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        scene = cls.folder / "wide.ply"
        # Copies beside each other are longer than a leaf may be.
        one = str(trained_run() / "splats.ply")
        run("convert", *[f"{one}:move={12 * i},0,0" for i in range(6)], scene, "--quiet")
        cls.count = json.loads(run("info", scene, "--json"))["splats"]
        run("convert", scene, cls.folder / "site" / "page.html", "--unbundled", "--levels", 3, "--quiet")
        run("render", scene, "--size", f"{WIDTH}x{HEIGHT}", "-o", cls.folder / "whole.png", "--quiet")
        handler = functools.partial(Handler, directory=str(cls.folder / "site"))
        cls.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
        threading.Thread(target=cls.server.serve_forever, daemon=True).start()
        cls.driver = browser(offline=False)

    @classmethod
    def tearDownClass(cls):
        cls.driver.quit()
        cls.server.shutdown()
        shutil.rmtree(cls.folder)

    def open(self, address=""):
        self.driver.get("about:blank")
        Handler.asked.clear()
        self.driver.get(f"http://127.0.0.1:{self.server.server_port}/page.html{address}")
        return settled(self.driver)

    def splats(self):
        return int(self.driver.execute_script("return document.documentElement.dataset.splats"))

    def picture(self):
        self.driver.execute_script("document.getElementById('bar').style.visibility = 'hidden'")
        self.driver.save_screenshot(str(self.folder / "shown.png"))
        return self.folder / "shown.png"

    def test_all_fits_and_the_coarsest_level_comes_first(self):
        self.driver.get_log("browser")
        self.assertEqual(self.open(), "ready")
        self.assertEqual(self.splats(), self.count)
        self.assertGreater(psnr(self.picture(), self.folder / "whole.png"), 34)
        chunks = [name.split("/")[1] for name in Handler.asked if name.endswith("/meta.json")]
        self.assertTrue(chunks[0].startswith("2_"), chunks)
        self.assertTrue(chunks[-1].startswith("0_"), chunks)
        self.assertEqual(self.driver.get_log("browser"), [])

    def test_a_budget_limits_the_splats(self):
        budget = self.count * 2 // 5
        self.assertEqual(self.open(f"#budget={budget}"), "ready")
        self.assertLessEqual(self.splats(), budget)
        self.assertGreater(self.splats(), self.count * 3 // 10)
        levels = self.driver.execute_script("return document.documentElement.dataset.levels")
        self.assertEqual(set(levels.split(",")), {"1", "2"})
        self.assertGreater(psnr(self.picture(), self.folder / "whole.png"), 25)

    def test_levels_are_bought_by_what_they_remove(self):
        (self.folder / "site" / "empty.html").write_text("<!DOCTYPE html><title>empty</title>")
        shutil.copytree(SOURCE / "web" / "src", self.folder / "site" / "src")
        self.driver.get(f"http://127.0.0.1:{self.server.server_port}/empty.html")
        rows = [{"file": 0, "offset": 0, "count": count} for count in (100, 50, 25)]
        leaves = [{"middle": [0, 0, z], "radius": 1, "rows": rows} for z in (3, 30)]

        def chosen(budget, forward=1):
            return self.driver.execute_async_script(
                "const [leaves, forward, budget, done] = arguments; import('/src/levels.js')"
                ".then((m) => done(m.chooseLevels(leaves, [0, 0, 0], [0, 0, forward], budget)))", leaves, forward, budget)

        self.assertEqual(chosen(10), [2, 2])  # the coarsest level always shows
        self.assertEqual(chosen(74), [2, 2])
        self.assertEqual(chosen(75), [1, 2])  # the near leaf first
        self.assertEqual(chosen(124), [1, 2])  # its next step does not fit, and none is taken in its place
        self.assertEqual(chosen(125), [0, 2])
        self.assertEqual(chosen(200), [0, 0])
        leaves[1]["middle"] = [0, 0, -3]  # as near, but behind
        self.assertEqual(chosen(75), [1, 2])
        self.assertEqual(chosen(75, forward=-1), [2, 1])
        leaves[1].update(middle=[0, 0, 3], errors=[0, 1, 9])  # a worse error of its coarsest level
        self.assertEqual(chosen(75), [2, 1])

    def test_what_is_missing_is_said(self):
        chunk = self.folder / "site" / "0_0"
        chunk.rename(self.folder / "away")
        try:
            self.assertEqual(self.open(), "failed")
            self.assertIn("0_0/meta.json is missing", self.driver.find_element(By.ID, "text").text)
        finally:
            (self.folder / "away").rename(chunk)

    def test_a_file_without_a_server_is_told(self):
        self.driver.get((self.folder / "site" / "page.html").as_uri())
        self.assertEqual(settled(self.driver), "failed")
        self.assertIn("http.server", self.driver.find_element(By.ID, "text").text)


class Handler(http.server.SimpleHTTPRequestHandler):
    asked = []

    def do_GET(self):
        Handler.asked.append(self.path)
        super().do_GET()

    def log_message(self, *arguments):
        pass


if __name__ == "__main__":
    EWA, SOURCE = sys.argv[1], pathlib.Path(sys.argv[2])
    CHROMEDRIVER = shutil.which("chromedriver")
    if webdriver is None or CHROMEDRIVER is None:
        print("skipped: needs chromedriver and selenium (Debian: chromium-driver, python3-selenium)")
        sys.exit(77)
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
