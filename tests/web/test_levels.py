# SPDX-License-Identifier: Apache-2.0
"""A page with levels beside it. test_page.py runs these tests."""
import json
import shutil
import time

import support
from support import HEIGHT, PATIENCE, WIDTH, BrowserTest, By, Handler, psnr, run, settled, trained_run


class StreamTest(BrowserTest):
    """A page with levels beside it, from a web server of files."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        scene, one = cls.folder / "wide.ply", cls.folder / "one.ply"
        run("convert", trained_run() / "splats.ply", one, "--decimate", "8k", "--quiet")
        # Copies beside each other are longer than a leaf may be.
        run("convert", *[f"{one}:move={12 * i},0,0" for i in range(6)], scene, "--quiet")
        cls.count = json.loads(run("info", scene, "--json"))["splats"]
        run("convert", scene, cls.folder / "site" / "page.html", "--unbundled", "--levels", 3, "--quiet")
        run("render", scene, "--size", f"{WIDTH}x{HEIGHT}", "-o", cls.folder / "whole.png", "--quiet")
        cls.serve(cls.folder / "site")
        cls.open_browser(offline=False)

    def open(self, address="", hurried=False, script="", name="page.html"):
        """hurried: pauses are a fiftieth as long, and a server may be silent for 3 s. script: runs before those of the page."""
        if hurried:
            script = "const later = setTimeout; window.setTimeout = (action, pause) => later(action, pause / (pause > 9000 ? 10 : 50));"
        self.driver.get("about:blank")
        Handler.asked.clear()
        added = self.driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": script})
        self.driver.get(f"http://127.0.0.1:{self.server.server_port}/{name}{address}")
        self.driver.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", added)
        return settled(self.driver)

    def splats(self):
        return int(self.driver.execute_script("return document.documentElement.dataset.splats"))

    def lost(self):
        """The line on missing parts. A view may be complete before they are given up."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            if text := self.driver.find_element(By.ID, "lost").text:
                return text
            time.sleep(0.05)
        return ""

    def test_all_fits_and_the_coarsest_level_comes_first(self):
        count = ("window.frames_left = 0; const gl = WebGL2RenderingContext.prototype, {createFramebuffer, deleteFramebuffer} = gl;"
                 "gl.createFramebuffer = function () { ++frames_left; return createFramebuffer.call(this); };"
                 "gl.deleteFramebuffer = function (frame) { --frames_left; deleteFramebuffer.call(this, frame); };")
        self.driver.get_log("browser")
        self.assertEqual(self.open(script=count), "ready")
        self.assertEqual(self.driver.execute_script("return frames_left"), 1)  # that of the screen
        self.assertEqual(self.splats(), self.count)
        self.assertGreater(psnr(self.picture(), self.folder / "whole.png"), 34)
        chunks = [name.split("/")[-2] for name in Handler.asked if name.endswith("/meta.json")]
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

    def test_a_chunk_that_comes_late_is_shown(self):
        Handler.refused["/page-levels/0_0/meta.json"] = 2
        self.assertEqual(self.open(hurried=True), "ready")
        self.assertEqual(self.splats(), self.count)
        self.assertEqual(Handler.asked.count("/page-levels/0_0/meta.json"), 3)
        self.assertFalse(self.driver.find_element(By.ID, "lost").is_displayed())

    def test_a_server_that_falls_silent_is_asked_again(self):
        Handler.silent["/page-levels/0_0/meta.json"] = [None]
        Handler.silent["/page-levels/2_0/meta.json"] = [20]
        try:
            self.assertEqual(self.open(hurried=True), "ready")
            self.assertEqual(self.splats(), self.count)
            for chunk in ("0_0", "2_0"):
                self.assertEqual(Handler.asked.count(f"/page-levels/{chunk}/meta.json"), 2)
        finally:
            Handler.silent.clear()

    def test_what_is_missing_is_said_and_the_rest_shows(self):
        for missing, shown in (("0_0", self.count // 2), ("2_0", self.count)):
            chunk = self.folder / "site" / "page-levels" / missing
            chunk.rename(self.folder / "away")
            try:
                self.assertEqual(self.open(hurried=True), "ready")
                self.assertEqual(self.lost(),
                                 "1 of 3 parts of the scene could not be loaded. Reload the page to try again.")
                self.assertFalse(self.driver.find_element(By.ID, "message").is_displayed())
                self.assertEqual(self.splats(), shown)
                self.assertEqual(Handler.asked.count(f"/page-levels/{missing}/meta.json"), 4)
            finally:
                (self.folder / "away").rename(chunk)

    def test_a_damaged_chunk_is_left_out(self):
        means = self.folder / "site" / "page-levels" / "0_0" / "means_l.webp"
        kept = means.read_bytes()
        try:
            means.write_bytes(kept[:40])
            self.assertEqual(self.open(hurried=True), "ready")
            self.assertIn("1 of 3 parts", self.lost())
            self.assertEqual(self.splats(), self.count // 2)
        finally:
            means.write_bytes(kept)

    def test_only_the_loss_of_all_is_a_failure(self):
        Handler.refused.update({f"/page-levels/{level}_0/meta.json": 9 for level in range(3)})
        try:
            self.assertEqual(self.open(hurried=True), "failed")
            self.assertIn("meta.json is missing", self.driver.find_element(By.ID, "text").text)
        finally:
            Handler.refused.clear()

    def test_another_budget_in_the_address_is_taken(self):
        self.assertEqual(self.open(f"#budget={self.count * 2 // 5}"), "ready")
        few = self.splats()
        self.driver.execute_script("location.hash = ''; document.documentElement.dataset.scene = 'drawing'")
        self.assertEqual(settled(self.driver), "ready")
        self.assertLess(few, self.count)
        self.assertEqual(self.splats(), self.count)

        # What fails while levels are chosen is said.
        self.driver.execute_script("document.documentElement.dataset.scene = 'drawing';"
                                   "Math.hypot = () => { throw new Error('no memory is left') }; location.hash = '#budget=9'")
        self.assertEqual(settled(self.driver), "failed")
        self.assertIn("no memory is left", self.driver.find_element(By.ID, "text").text)

    def test_pages_of_a_folder_have_levels_of_their_own(self):
        name = "other #1 page.html"
        run("convert", self.folder / "one.ply", self.folder / "site" / name, "--unbundled", "--quiet")
        few = json.loads(run("info", self.folder / "one.ply", "--json"))["splats"]
        self.assertEqual(self.open(name="other%20%231%20page.html"), "ready")
        self.assertEqual(self.splats(), few)
        self.assertEqual(self.open(), "ready")
        self.assertEqual(self.splats(), self.count)

    def test_a_file_without_a_server_is_told(self):
        self.driver.get((self.folder / "site" / "page.html").as_uri())
        self.assertEqual(settled(self.driver), "failed")
        self.assertIn("http.server", self.driver.find_element(By.ID, "text").text)


class LevelsTest(BrowserTest):
    """web/src/levels.js alone."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        (cls.folder / "empty.html").write_text("<!DOCTYPE html><title>empty</title>")
        shutil.copytree(support.SOURCE / "web" / "src", cls.folder / "src")
        cls.serve(cls.folder)
        cls.open_browser(offline=False)
        cls.driver.get(f"http://127.0.0.1:{cls.server.server_port}/empty.html")

    def evaluated(self, body, *arguments):
        """What the body of an asynchronous function returns, with the module as m and a list of arguments as a."""
        found = self.driver.execute_async_script(
            "const [a, done] = arguments; import('/src/levels.js').then(async (m) => {" + body +
            "}).then((value) => done({value}), (error) => done({error: String(error)}))", arguments)
        self.assertNotIn("error", found, found)
        return found["value"]

    def test_levels_are_bought_by_what_they_remove(self):
        rows = [{"file": 0, "offset": 0, "count": count} for count in (100, 50, 25)]
        leaves = [{"middle": [0, 0, z], "radius": 1, "rows": rows} for z in (3, 30)]

        def chosen(budget, forward=1):
            return self.evaluated("return m.chooseLevels(a[0], [0, 0, 0], [0, 0, a[1]], a[2])", leaves, forward, budget)

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

    def test_many_leaves_take_no_square_of_time(self):
        seconds = self.evaluated("""
            const rows = [40, 20, 10].map((count) => ({file: 0, offset: 0, count})), leaves = [];
            for (let i = 0; i < 100000; ++i) leaves.push({middle: [i % 317, 0, i % 1009], radius: 1, rows});
            const start = performance.now(), chosen = m.chooseLevels(leaves, [0, 0, 0], [0, 0, 1], 3500000);
            return chosen.includes(0) && chosen.includes(1) ? (performance.now() - start) / 1000 : -1;""")
        self.assertGreater(seconds, 0)
        self.assertLess(seconds, 3)  # with a search among all leaves for each step: minutes

    # Leaves in a row, each with chunks of its own in two finer levels; all share one chunk in the coarsest.
    ROW = """
        const meta = {filenames: [], tree: {children: []}};
        for (let i = 0; i < a[0]; ++i) {
            const lods = [2 * i + 1, 2 * i + 2, 0].map((file, level) => ({file, offset: level === 2 ? 10 * i : 0, count: [40, 20, 10][level]}));
            meta.tree.children.push({bound: {min: [-1, -1, 10 * i - 1], max: [1, 1, 10 * i + 1]}, lods});
        }
        class Row extends m.LevelScene {
            open(file) { return Promise.resolve({count: file === 0 ? 10 * a[0] : file % 2 ? 40 : 20, degree: 0, file}); }
        }
        const gl = {MAX_ARRAY_TEXTURE_LAYERS: 1, MAX_TEXTURE_SIZE: 2, getParameter: (name) => (name === 1 ? a[1] : 4096)};
        const scene = new Row(gl, meta, "", a[2], () => {}, (error) => { throw error; });
        const rest = () => new Promise((resolve) => setTimeout(resolve, 0));
        const look = async (z) => {
            scene.choose([0, 0, z], [0, 0, 1]);
            for (let i = 0; i < 9 * a[0]; ++i) await Promise.resolve();
            await rest();
            return scene.shown();
        };
    """

    def test_chunks_long_unused_are_dropped(self):
        # A budget of 200: the coarsest level of 10 leaves has 100 splats, and three leaves are finest.
        counts = self.evaluated(self.ROW + """
            const counts = [];
            for (let step = 0; step < 20; ++step) {
                await look(step % 10 * 10);
                counts.push([...scene.chunks.values()].reduce((sum, {scene}) => sum + (scene?.count ?? 0), 0));
            }
            return scene.complete() ? counts : "incomplete";""", 10, 256, 200)
        self.assertLessEqual(max(counts), 400)
        self.assertGreater(max(counts), 200)  # those of the view before are still there

    def test_no_more_chunks_than_the_device_takes(self):
        files, near, complete = self.evaluated(self.ROW + """
            const parts = await look(0);
            return [new Set(parts.map(({chunk}) => chunk.file)).size, parts[0].count, scene.complete() && parts.length === 30];""",
                                               30, 8, 100000)
        self.assertEqual(files, 8)
        self.assertEqual(near, 40)
        self.assertTrue(complete)

    def test_a_lost_chunk_does_not_ask_for_more_than_the_device_takes(self):
        row = self.ROW.replace("throw error", "failed = String(error)")
        row = row.replace("open(file) {", 'open(file) { if (file === 0) return Promise.reject(new Error("gone"));')
        loads, files, levels, failed = self.evaluated(row + """
            let failed = "";
            scene.miss = (file, chunk, error) => scene.lose(file, error);
            const parts = await look(0);
            return [scene.loads, new Set(parts.map(({chunk}) => chunk.file)).size, parts.length, failed];""", 30, 8, 100000)
        self.assertEqual((loads, files, levels, failed), (0, 8, 8, ""))

    def test_an_odd_first_chunk_is_the_one_that_is_left_out(self):
        # Chunks 0 to 3, of which the first to come has another SH degree.
        lost, complete, parts, failed = self.evaluated("""
            const hurried = setTimeout;
            window.setTimeout = (action, pause) => hurried(action, pause / 50);
            const meta = {filenames: ["0", "1", "2", "3"], tree: {children: []}};
            for (let i = 0; i < 4; ++i)
                meta.tree.children.push({bound: {min: [i, 0, 0], max: [i + 1, 1, 1]}, lods: [{file: i, offset: 0, count: 10}]});
            class Mixed extends m.LevelScene {
                async decoded(file) { return {count: 10, degree: file === 0 ? 1 : 3, palette: {}, file}; }
            }
            let failed = "";
            const gl = {getParameter: () => 4096};
            const scene = new Mixed(gl, meta, "", 1000, () => {}, (error) => { failed = String(error); });
            for (let i = 0; i < 200 && !(scene.lost.size > 0 && scene.complete()); ++i)
                await new Promise((resolve) => hurried(resolve, 10));
            return [[...scene.lost], scene.complete(), scene.shown().map(({chunk}) => chunk.file), failed];""")
        self.assertEqual((lost, complete, parts, failed), ([0], True, [1, 2, 3], ""))
