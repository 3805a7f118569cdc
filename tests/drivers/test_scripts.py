# SPDX-License-Identifier: Apache-2.0
"""scripts/check-drivers finds what it is made to find, and scripts/gpu-check reads what ewa-bench prints.

    test_scripts.py EWA_BENCH      the program, whose output is read; without it only the rest is tested
"""
import importlib.machinery, importlib.util, pathlib, re, subprocess, sys, tempfile, unittest

PROJECT = pathlib.Path(__file__).resolve().parents[2]
sys.dont_write_bytecode = True  # no cache beside a script
loader = importlib.machinery.SourceFileLoader("check_drivers", str(PROJECT / "scripts/check-drivers"))
drivers = importlib.util.module_from_spec(importlib.util.spec_from_loader("check_drivers", loader))
loader.exec_module(drivers)
BENCH = sys.argv[1] if len(sys.argv) > 1 else None


def row(psnr, images="whole"):
    return drivers.Row("Mesa", 8, images, psnr, "", True)


def kernel(name, spilled=0, code=100):
    return (f"kernel {name} 0 1\n*** SHADER STATS ***\nSGPRs: 128\nVGPRs: 60\nSpilled SGPRs: 0\nSpilled VGPRs: {spilled}\n"
            f"Code size: {code}\nScratch size: 0\n")


class Drivers(unittest.TestCase):
    def problems(self, output, family="RDNA3"):
        return list(drivers.kernel_problems(family, drivers.kernel_statistics(output)))

    def test_psnr_must_agree_on_the_same_images(self):
        self.assertEqual(list(drivers.psnr_problems([row(20.481), row(20.4815), row(17.0, "half"), row(None)])), [])
        self.assertEqual(len(list(drivers.psnr_problems([row(20.481), row(20.492)]))), 1)
        self.assertEqual(len(list(drivers.psnr_problems([row(20.481), row(float("nan"))]))), 1)

    def test_spills_and_long_code_are_problems(self):
        self.assertEqual(self.problems(kernel("project") + kernel("blend_backward", code=10240)), [])
        self.assertIn("Spilled VGPRs 3", self.problems(kernel("project") + kernel("project", spilled=3))[0])
        self.assertEqual(len(self.problems(kernel("blend_backward", code=10244))), 1)
        self.assertEqual(self.problems(kernel("blend_backward", code=10244), "RDNA1"), [])

    def test_a_kernel_without_statistics_fails(self):
        with self.assertRaises(drivers.Failure):
            drivers.kernel_statistics("kernel project 0 1\nkernel update 0 1\n" + kernel("blend"))

    def test_tests_are_counted_only_at_their_end(self):
        self.assertIsNone(drivers.count_tests("[  FAILED  ] Sort.IsStable (3 ms)\n"))
        self.assertEqual(drivers.count_tests("[  FAILED  ] Sort.IsStable (3 ms)\n[  PASSED  ] 5 tests.\n"), (5, ["Sort.IsStable"]))


class GpuCheck(unittest.TestCase):
    def shell(self, command, said=""):
        script = f"source {PROJECT}/scripts/gpu-check; here={PROJECT}/bench; {command}"
        return subprocess.run(["bash", "-c", script], input=said, stdout=subprocess.PIPE, text=True, check=True).stdout

    def test_each_test_is_counted_once(self):
        logs = ("[ RUN      ] A.Passes/one\n    a figure\n[       OK ] A.Passes/one (3 ms)\n[ RUN      ] A.Skips\n[  SKIPPED ] A.Skips (0 ms)\n"
                "[ RUN      ] A.Fails/0\n[  FAILED  ] A.Fails/0, where GetParam() = 7 (2 ms)\n[ RUN      ] A.Hangs\n",
                "[ RUN      ] B.Fails\n[  FAILED  ] B.Fails (1 ms)\n[  SKIPPED ] 1 test, listed below:\n[  FAILED  ] 1 test, listed below:\n"
                "[  FAILED  ] B.Fails\n\n 1 FAILED TEST\n")
        with tempfile.TemporaryDirectory() as folder:
            for number, log in enumerate(logs):
                pathlib.Path(folder, str(number)).write_text(log)
            said = self.shell(f"test_results {folder}/*")
        self.assertEqual(said.splitlines(), ["passed A.Passes/one", "failed A.Fails/0", "unended A.Hangs", "failed B.Fails"])

    def test_stages_share_the_time(self):
        stages = re.search(r"^stages_known=\((.*)\)$", (PROJECT / "scripts/gpu-check").read_text(), re.MULTILINE)[1].split()
        left = 540
        for at in range(len(stages)):  # each uses all of its share
            share = int(self.shell(f"share_of {left} {' '.join(stages[at:])}"))
            self.assertGreaterEqual(share, 10, stages[at])
            left -= share
        self.assertEqual(left, 0)

    @unittest.skipUnless(BENCH, "without ewa-bench")
    def test_each_prediction_finds_its_passes(self):
        said = subprocess.run([BENCH, "--cases", "capture_2k*train", "--runs", "1"], stdout=subprocess.PIPE, text=True, check=True).stdout
        rows = self.shell("pass_times <(cat)", said)
        times = {line.split("|")[0]: float(line.split("|")[1]) for line in rows.splitlines()}
        *passes, other, whole, _ = times
        self.assertEqual((other, whole), ("other passes", "all passes"))
        for name in passes:
            self.assertGreater(times[name], 0, f"no pass of '{name}' in bench/predictions.txt is one of:\n{said}")
        # What no row names are fills and copies of a few bytes. Names decide, not times: a busy machine may stop any pass for long.
        listed = re.findall(r"^ +(\S.*?) +([0-9.]+) \+- ", said, re.MULTILINE)
        small = sum(float(ms) for name, ms in listed if name.startswith(("fill ", "copy ")))
        self.assertAlmostEqual(times["other passes"], small, delta=0.01)
        # Each pass is in one row. The total is a time of its own, which differs on a busy machine.
        single = [float(ms) for name, ms in listed if name not in ("all passes", "with the host's part", "blend on the host")]
        self.assertGreater(len(single), 10)
        self.assertAlmostEqual(sum(times[name] for name in (*passes, other)), sum(single), delta=0.01)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
