# SPDX-License-Identifier: Apache-2.0
"""scripts/mutate counts as seen what a test has told apart, and nothing else."""
import importlib.machinery, importlib.util, pathlib, stat, sys, tempfile, unittest

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "scripts/mutate"
sys.dont_write_bytecode = True  # no cache beside a script
loader = importlib.machinery.SourceFileLoader("mutate", str(SCRIPT))
mutate = importlib.util.module_from_spec(importlib.util.spec_from_loader("mutate", loader))
loader.exec_module(mutate)

PASSED = "[ RUN      ] Sort.IsStable\n[       OK ] Sort.IsStable (3 ms)\n"
FAILED = "[ RUN      ] Sort/All.IsStable/2\n[  FAILED  ] Sort/All.IsStable/2, where GetParam() = 4 (3 ms)\n"
BEGUN = PASSED + "[ RUN      ] Sort.OfNothing\n"
SKIPPED = "[ RUN      ] Sort.IsStable\n[  SKIPPED ] Sort.IsStable (0 ms)\n"


class Judgement(unittest.TestCase):
    def test_what_a_test_tells_apart_is_seen(self):
        self.assertEqual(mutate.judge(1, PASSED + FAILED), "Sort/All.IsStable/2")
        self.assertEqual(mutate.judge(-11, BEGUN), "Sort.OfNothing ended with -11")
        self.assertEqual(mutate.judge(134, BEGUN), "Sort.OfNothing ended with 134")
        self.assertEqual(mutate.judge(None, BEGUN), "Sort.OfNothing did not end")
        self.assertIsNone(mutate.judge(0, PASSED))

    def test_nothing_is_said_where_no_test_tells(self):
        for status, output in [(0, ""), (0, "[==========] 0 tests ran.\n"), (0, SKIPPED), (1, ""), (1, PASSED), (127, ""),
                               (-11, ""), (2, BEGUN), (0, FAILED)]:
            with self.subTest(status=status, output=output), self.assertRaises(mutate.CannotTell):
                mutate.judge(status, output)


class Choice(unittest.TestCase):
    def test_some_are_spread_over_all(self):
        self.assertEqual(mutate.spread(list(range(10)), 3), [0, 3, 6])
        for most in (0, 10, 11):
            self.assertEqual(mutate.spread(list(range(10)), most), list(range(10)))


class Runs(unittest.TestCase):
    """With a program in the place of the tests, which reads what it is to do from the folder of shaders."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.program = self.folder / "tests"
        self.program.write_text('#!/bin/sh\necho run >> "$0.log"\n. "$EWA_SHADER_FOLDER/shader"\n')
        self.program.chmod(self.program.stat().st_mode | stat.S_IXUSR)

    def shaders(self, name, does):
        (self.folder / name).mkdir()
        (self.folder / name / "shader").write_text(does)
        return self.folder / name

    def with_unbroken(self, unbroken):
        return mutate.Tests(self.program, self.shaders("whole", unbroken), self.folder)

    def test_the_unbroken_shaders_have_to_pass(self):
        for number, unbroken in enumerate([f"printf '{FAILED}'; exit 1".replace("\n", "\\n"), "exit 1", "exit 0", "kill -9 $$"]):
            with self.subTest(unbroken=unbroken):
                tests = mutate.Tests(self.program, self.shaders(f"whole{number}", unbroken), self.folder)
                broken = self.shaders(f"broken{number}", "exit 1")
                with self.assertRaises(mutate.CannotTell):
                    tests.seen(broken, "*", "")

    def test_they_are_run_once_for_each_choice_of_tests(self):
        passes = f"printf '{PASSED}'".replace("\n", "\\n")
        tests = self.with_unbroken(passes)
        broken = self.shaders("broken", f"printf '{FAILED}'; exit 1".replace("\n", "\\n"))
        harmless = self.shaders("harmless", passes)
        self.assertEqual(tests.seen(broken, "Sort*", ""), ("Sort/All.IsStable/2", False))
        self.assertEqual(tests.seen(harmless, "Sort*", ""), (None, False))
        self.assertEqual(tests.seen(harmless, "Sort*", "128"), (None, False))
        log = (self.folder / "tests.log").read_text()
        self.assertEqual(log.count("run"), 3 + 2)

    def test_what_does_not_end_is_told_apart(self):
        tests = self.with_unbroken(f"printf '{PASSED}'".replace("\n", "\\n"))
        endless = self.shaders("endless", f"printf '{BEGUN}'; exec sleep 60".replace("\n", "\\n"))
        least, mutate.LEAST_LIMIT = mutate.LEAST_LIMIT, 0.5
        self.addCleanup(setattr, mutate, "LEAST_LIMIT", least)
        by, late = tests.seen(endless, "*", "")
        self.assertIn("did not end", by)
        self.assertTrue(late)


if __name__ == "__main__":
    unittest.main()
