#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What continuous integration runs for which change, and the groups of tests."""
import importlib.machinery, importlib.util, pathlib, sys, unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.dont_write_bytecode = True  # no cache beside a script
loader = importlib.machinery.SourceFileLoader("select_jobs", str(ROOT / "scripts/select-jobs"))
select = importlib.util.module_from_spec(importlib.util.spec_from_loader("select_jobs", loader))
sys.modules["select_jobs"] = select  # dataclasses look there
loader.exec_module(select)

TABLE = """# a comment
[build] | 100 | always |
fast    | 200 | always |
photos  | ~10 | last   | src/capture tests/cli/test_cameras.cpp
devices | 50  | last   | src/gpu
[tidy]  | 40  | recent | src tests
widths  | 60  | recent | shaders
slow    | 900 | never  |
"""
DOCUMENT = """
| Module | Contents | Lines | May include |
|---|---|--:|---|
| `shaders/passes/` | a | 50 | nothing |
| `include/ewa/` | a | 50 | GLM |
| `src/core/` | a | 50 | the standard library |
| `src/gpu/` | a | 50 | `core`, Vulkan |
| `src/passes/` | binds `passes.h` | 50 | `gpu` |
| `src/io/splats/` | a | 50 | `core` |
| `src/capture/` | a | 50 | `io` |
| `check/reference/` | a | 50 | `core` |
| `check/bench/` | a | 50 | `check/reference`, `gpu` |
| `src/cli/` | a | 100 | everything |
| `python/bindings/` | a | 50 | everything but `cli` |
| `python/ewa/` | a | 50 | `ewa._native` |
| `python/ewa/gsplat/` | a | 50 | the package, PyTorch |

## Data flow
| `src/other/` | a | 50 | nothing |
"""


class Selection(unittest.TestCase):
    def setUp(self):
        self.items = select.read_table(TABLE)
        self.modules = select.read_modules(DOCUMENT)
        self.includers = select.Includers(self.modules, lambda header: {"src/gpu"} if header.endswith("device.h") else set())

    def names(self, commits):
        return [choice.item.name for choice in select.ranked(self.items, commits, self.includers)]

    def test_the_table_of_modules_is_read(self):
        self.assertEqual(self.modules["src/capture"], {"src/io", "src/io/splats"})
        self.assertEqual(self.modules["src/passes"], {"src/gpu", "shaders/passes"})
        self.assertIn("src/capture", self.modules["python/bindings"])
        self.assertNotIn("src/cli", self.modules["python/bindings"])
        self.assertEqual(self.modules["check/bench"], {"check/reference", "src/gpu"})
        self.assertNotIn("check/bench", self.modules["src/cli"])
        self.assertEqual(self.modules["python/ewa/gsplat"], {"python/ewa"})
        self.assertEqual(select.module_of("python/ewa/gsplat/a.py", self.modules), "python/ewa/gsplat")
        self.assertIsNone(select.module_of("docs/a.md", self.modules))

    def test_includers_are_reached_by_the_shortest_way(self):
        reached = self.includers.of("src/core/text.h")
        self.assertEqual((reached["src/core"], reached["src/gpu"], reached["src/passes"]), (0, 1, 2))
        self.assertNotIn("shaders/passes", reached)
        self.assertEqual(self.includers.of("shaders/passes/a.comp")["src/passes"], 1)
        self.assertEqual(self.includers.of("include/ewa/device.h")["src/gpu"], 1)
        self.assertNotIn("src/gpu", self.includers.of("include/ewa/image.h"))
        self.assertEqual(self.includers.of("README.md"), {})

    def test_nothing_is_asked_for_by_documents(self):
        self.assertEqual(self.names([{"README.md", "docs/a.md"}]), [])

    def test_what_has_changed_comes_before_what_includes_it(self):
        self.assertEqual(self.names([{"src/gpu/device.cpp"}]), ["devices", "tidy"])
        self.assertEqual(self.names([{"src/core/text.h"}]), ["tidy", "devices", "photos"])
        self.assertEqual(self.names([{"src/core/a.h"}, {"src/capture/a.cpp"}]), ["tidy", "photos", "devices"])

    def test_the_newest_change_comes_first(self):
        self.assertEqual(self.names([{"shaders/passes/a.comp"}, {"src/gpu/a.cpp"}, {"src/capture/a.cpp"}]), ["widths", "devices", "tidy", "photos"])

    def test_old_changes_ask_for_no_recent_job(self):
        old = [set()] * select.RECENT
        self.assertEqual(self.names([*old, {"shaders/passes/a.comp", "src/gpu/a.cpp"}]), ["devices"])
        self.assertEqual(self.names([*old, {"src/gpu/a.cpp"}][: select.RECENT]), [])
        self.assertEqual(self.names([set()] * select.LAST + [{"src/gpu/a.cpp"}]), [])
        # What includes a new change comes before what an old one has changed.
        self.assertEqual(self.names([{"src/io/splats/a.cpp"}, *old, {"src/gpu/a.cpp"}]), ["tidy", "photos", "devices"])

    def test_the_budget_is_a_bound(self):
        choices = select.ranked(self.items, [{"src/gpu/a.cpp", "src/capture/a.cpp"}], self.includers)
        for budget, runs, rest, used in [(400, ["photos", "devices", "tidy"], [], 400), (399, ["photos", "devices"], ["tidy"], 360),
                                         (350, ["photos", "tidy"], ["devices"], 350), (0, [], ["photos", "devices", "tidy"], 300)]:
            with self.subTest(budget=budget):
                taken, left, seconds = select.fitting(self.items, choices, budget)
                self.assertEqual(([c.item.name for c in taken], [c.item.name for c in left], seconds), (runs, rest, used))
        self.assertEqual(select.command_for(choices), "scripts/test --groups photos,devices; scripts/check tidy")

    def test_an_unknown_window_is_refused(self):
        with self.assertRaises(SystemExit):
            select.read_table("a | 1 | sometimes | src")


class Groups(unittest.TestCase):
    """tests/groups.txt fits the tree."""

    def setUp(self):
        self.items = select.read_table(select.TABLE.read_text())

    def test_what_is_guarded_exists(self):
        for item in self.items:
            for guard in item.guards:
                folder, name = (ROOT / guard).parent, (ROOT / guard).name
                self.assertTrue(any(folder.glob(name + "*")), f"{item.name}: there is no {guard}")

    def test_each_group_has_tests_and_each_job_a_function(self):
        text = "\n".join((ROOT / path).read_text() for path in ("tests/CMakeLists.txt", "tests/fuzz/CMakeLists.txt", "python/CMakeLists.txt"))
        text = text.replace("width_${width}", "width_128 width_512").replace("lanes_${lanes}", "lanes_32 lanes_64")
        jobs = (ROOT / "scripts/check").read_text()
        for item in self.items:
            with self.subTest(item.name):
                if not item.is_job:
                    self.assertRegex(text, rf"\b{item.name}\b")
                elif item.name != "build":
                    self.assertIn(f"job_{item.name}() {{", jobs)

    def test_names_are_there_once(self):
        names = [item.name for item in self.items]
        self.assertEqual(len(names), len(set(names)))

    def test_what_always_runs_leaves_time(self):
        self.assertLess(sum(item.seconds for item in self.items if item.window == "always"), select.BUDGET)


if __name__ == "__main__":
    unittest.main()
