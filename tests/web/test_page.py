#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The page of `ewa convert`, in a real browser: test_page.py EWA SOURCE_FOLDER. Ends with 77 where there is no browser."""
import json
import pathlib
import re
import shutil
import sys
import time
import unittest

sys.dont_write_bytecode = True  # beside the sources
import support
from support import HEIGHT, PATIENCE, WIDTH, ActionChains, BrowserTest, By, Keys, browser, psnr, run, settled, trained_run
from test_levels import LevelsTest, StreamTest  # noqa: F401 (unittest finds them here)
from test_live import FiguresTest, LiveTest  # noqa: F401


class PageTest(BrowserTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        trained = trained_run()
        run("convert", trained, cls.folder / "page.html", "--quiet")
        shutil.copy(trained / "splats.ply", cls.folder / "alone.ply")
        run("convert", cls.folder / "alone.ply", cls.folder / "flat.html", "--max-sh", 0, "--quiet")
        cls.renders = cls.folder / "renders"
        run("render", trained, "--frames", "all", "-o", cls.renders, "--quiet")
        cls.open_browser()

    def open(self, name, address=""):
        self.driver.get("about:blank")
        self.driver.get((self.folder / name).as_uri() + address)
        return self.settled()

    def settled(self):
        return settled(self.driver)

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

    def test_the_film_goes_through_its_keys(self):
        page = (self.folder / "page.html").read_text()
        settings = json.loads(re.search(r'id="settings">(.*?)</script>', page, re.S).group(1))
        views = []
        for i, camera in enumerate(settings["cameras"][:3]):
            view = {name: camera[name] for name in ("name", "width", "height", "fx", "fy", "cx", "cy")}
            view["rotation"] = sum(camera["rows"], [])
            view["translation"] = [-sum(r * e for r, e in zip(row, camera["eye"])) for row in camera["rows"]]
            views.append({**view, "time": i + 0.5})
        (self.folder / "views.json").write_text(json.dumps({"views": views}))
        run("convert", self.folder / "alone.ply", self.folder / "film.html", "--views", self.folder / "views.json", "--quiet")
        run("render", self.folder / "alone.ply", "--views", self.folder / "views.json", "--film-seconds", 1, "-o",
            self.folder / "frames", "--quiet")
        for seconds, frame in ((0, 0), (0.5, 15), (1.2, 36), (2, 60)):
            self.assertEqual(self.open("film.html", f"#film={seconds}"), "ready")
            self.assertGreater(self.psnr(self.picture(), self.folder / "frames" / f"{frame:05}.png"), 40, seconds)

    def test_the_first_view_fills_a_high_window_as_a_wide_one(self):
        high = self.folder / "high.ply"
        run("convert", self.folder / "alone.ply", high, "--transform", "1,0,0,0,0,3,0,0,0,0,1,0", "--quiet")
        run("convert", high, self.folder / "high.html", "--title", "A <high> scene", "--quiet")
        for width, height in ((108, 192), (192, 108)):
            self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                                        {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False})
            self.addCleanup(self.driver.execute_cdp_cmd, "Emulation.setDeviceMetricsOverride",
                            {"width": WIDTH, "height": HEIGHT, "deviceScaleFactor": 1, "mobile": False})
            self.assertEqual(self.open("high.html"), "ready")
            self.assertEqual(self.driver.title, "A <high> scene")
            # ewa render frames a scene for the shape of its image.
            run("render", high, "-o", self.folder / "framed.png", "--size", f"{width}x{height}", "--quiet")
            self.assertGreater(self.psnr(self.picture(), self.folder / "framed.png"), 35, (width, height))

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


if __name__ == "__main__":
    support.EWA, support.SOURCE = sys.argv[1], pathlib.Path(sys.argv[2])
    if support.webdriver is None or support.CHROMEDRIVER is None:
        print("skipped: needs chromedriver and selenium (Debian: chromium-driver, python3-selenium)")
        sys.exit(77)
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
