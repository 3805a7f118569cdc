# SPDX-License-Identifier: Apache-2.0
"""The page of a training that runs. test_page.py runs these tests."""
import json
import shutil
import subprocess
import time
import urllib.request

import support
from support import PATIENCE, ActionChains, BrowserTest, By, psnr, run, settled, trained_run


class LiveTest(BrowserTest):
    """`ewa train --serve`, and its page."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.data, out = trained_run().parent / "data", cls.folder / "live"
        cls.training = subprocess.Popen([support.EWA, "train", cls.data, "-o", out, "--steps", "20000", "--sh-degree", "3", "--background",
                                         "0.2,0.3,0.4", "--eval-every", "20", "--serve", "0", "--quiet"])
        cls.addClassCleanup(cls.training.wait)
        cls.addClassCleanup(cls.training.kill)
        cls.until(lambda: (out / "live.json").exists())
        live = json.loads((out / "live.json").read_text())
        cls.address, cls.token = f"http://127.0.0.1:{live['port']}/", live["token"]
        cls.open_browser(offline=False)

    @classmethod
    def until(cls, holds):
        end = time.monotonic() + PATIENCE
        while not (found := holds()):
            assert cls.training.poll() is None, "the training has ended"
            assert time.monotonic() < end, "it takes too long"
            time.sleep(0.1)
        return found

    def ask(self, path, method="GET"):
        """With the token, which also makes a pause last."""
        request = urllib.request.Request(self.address + path, method=method, headers={"Authorization": f"Bearer {self.token}"})
        with urllib.request.urlopen(request, timeout=PATIENCE) as answer:
            return answer.read(), answer.headers

    def status(self):
        return json.loads(self.ask("status")[0])

    def shown(self):
        """What the page says of itself."""
        return self.driver.execute_script("return {step: '-1', points: '0', ...document.documentElement.dataset}")

    def curve(self, line):
        return (self.driver.find_element(By.ID, line).get_attribute("points") or "").split()

    def shows(self, step):
        page = self.shown()
        return page["scene"] == "ready" and int(page["step"]) == step

    def test_follows_the_training_and_shows_what_ewa_renders(self):
        self.driver.get(self.address)
        self.assertEqual(settled(self.driver), "ready")
        first = self.shown()
        self.until(lambda: all(len(self.curve(line)) > 2 for line in ("loss", "psnr")))
        self.until(lambda: int(self.shown()["step"]) > int(first["step"]))
        self.assertEqual(self.shown()["run"], "running")
        self.assertRegex(self.driver.find_element(By.ID, "state").text, r"^Training: step [\d,]+ of 20,000, [\d,]+ splats")

        self.ask("pause", "POST")
        self.until(lambda: self.status()["state"] == "paused" and self.shown()["run"] == "paused")
        self.until(lambda: self.shows(self.status()["step"]))
        self.driver.execute_script("document.getElementById('run').style.visibility = 'hidden'")
        picture = self.picture()
        splats, headers = self.ask("splats")
        self.assertTrue(self.shows(int(headers["Ewa-Step"])), "the pause has ended")
        (self.folder / "now.ply").write_bytes(splats)
        self.ask("resume", "POST")
        run("render", self.folder / "now.ply", "--cameras", self.data, "--frames", 0, "--background", "0.2,0.3,0.4", "-o",
            self.folder / "now.png", "--quiet")
        self.assertGreater(psnr(picture, self.folder / "now.png"), 35)

        ActionChains(self.driver).drag_and_drop_by_offset(self.driver.find_element(By.ID, "view"), 40, 10).perform()
        settled(self.driver)
        before, turned = self.shown(), self.picture("turned.png")
        self.until(lambda: int(self.shown()["points"]) > int(before["points"]) and int(self.shown()["step"]) > int(before["step"]))
        settled(self.driver)
        later = self.picture("later.png")
        self.assertGreater(psnr(turned, later), psnr(picture, later), "new splats have moved the camera")
        names = self.driver.execute_script("return performance.getEntriesByType('resource').map(e => e.name)")
        self.assertEqual([name for name in names if not name.startswith((self.address, "blob:", "data:"))], [])
        self.assertEqual([one for one in self.driver.get_log("browser") if "Content Security" in one["message"]], [])

        self.training.kill()
        end = time.monotonic() + PATIENCE
        while self.shown()["run"] != "lost" and time.monotonic() < end:
            time.sleep(0.1)
        self.assertIn("Connection lost", self.driver.find_element(By.ID, "state").get_attribute("textContent"))
        self.assertEqual(self.shown()["scene"], "ready")


class FiguresTest(BrowserTest):
    """web/src/live.js alone."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        (cls.folder / "empty.html").write_text("<!DOCTYPE html><title>empty</title>")
        shutil.copytree(support.SOURCE / "web" / "src", cls.folder / "src")
        cls.serve(cls.folder)
        cls.open_browser(offline=False)
        cls.driver.get(f"http://127.0.0.1:{cls.server.server_port}/empty.html")

    def returned(self, expression):
        found = self.driver.execute_async_script(
            "const [done] = arguments; import('/src/live.js').then((m) => " + expression +
            ").then((value) => done({value}), (error) => done({error: String(error)}))")
        self.assertNotIn("error", found, found)
        return found["value"]

    def test_curves_fill_their_box_and_skip_what_is_missing(self):
        lines = "[{step: 10, v: 4}, {step: 50, v: null}, {step: 60}, {step: 100, v: 8}]"
        self.assertEqual(self.returned(f"m.curve({lines}, 200, (line) => line.v)"), ["5.00,38.00", "50.00,2.00"])
        self.assertEqual(self.returned("m.curve([], 200, (line) => line.v)"), [])
        self.assertEqual(self.returned("m.curve([{step: 20, v: 3}], 200, (line) => line.v)"), ["10.00,38.00"])

    def test_the_time_left_comes_from_the_last_lines(self):
        lines = "Array.from({length: 21}, (_, i) => ({step: 10 * i, wall_seconds: i < 10 ? 5 * i : 45 + i}))"
        self.assertAlmostEqual(self.returned(f"m.secondsLeft({{step: 200, steps: 700}}, {lines})"), 50)
        for lines in ("[]", "[{step: 1, wall_seconds: 1}]", "[{step: 1, wall_seconds: 1}, {step: 1, wall_seconds: 2}].reverse()"):
            self.assertIs(self.returned(f"m.secondsLeft({{step: 1, steps: 9}}, {lines}) > 0"), False, lines)
        self.assertEqual(self.returned("[0, 59, 60, 3599, 7500].map(m.duration)"), ["0 s", "59 s", "1 min", "1 h 0 min", "2 h 5 min"])
