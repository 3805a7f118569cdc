# SPDX-License-Identifier: Apache-2.0
"""scripts/check-drivers finds what it is made to find. scripts/gpu-check reads what ewa-bench prints, carries what fits and continues full
runs, and scripts/gpu-table prints their figures.

    test_scripts.py EWA_BENCH      the program, whose output is read; without it only the rest is tested
"""
import importlib.machinery, importlib.util, json, pathlib, re, subprocess, sys, tempfile, unittest

PROJECT = pathlib.Path(__file__).resolve().parents[2]
sys.dont_write_bytecode = True  # no cache beside a script
loader = importlib.machinery.SourceFileLoader("check_drivers", str(PROJECT / "scripts/check-drivers"))
drivers = importlib.util.module_from_spec(importlib.util.spec_from_loader("check_drivers", loader))
loader.exec_module(drivers)
BENCH = sys.argv[1] if len(sys.argv) > 1 else None

# In the place of ewa: a run of 3 seconds. After a signal, the next call does the rest.
PROGRAM = f"""#!{sys.executable} -IS
import json, pathlib, signal, sys, time
folder = pathlib.Path(sys.argv[sys.argv.index("-o") + 1])
folder.mkdir(parents=True, exist_ok=True)
count = json.loads((folder / "summary.json").read_text())["steps"] if (folder / "summary.json").exists() else 0
asked = []
signal.signal(signal.SIGTERM, lambda *_: asked.append(True))
while count < 30 and not asked:
    time.sleep(0.1)
    count += 1
summary = dict(steps=count, seconds=0.1 * count, seconds_per_step=0.1, interrupted=bool(asked))
(folder / "summary.json").write_text(json.dumps(summary, indent=2))
"""


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
        # What no row names are fills, copies and writes of a few bytes. Names decide, not times: a busy machine may stop any pass for long.
        listed = re.findall(r"^ +(\S.*?) +([0-9.]+) \+- ", said, re.MULTILINE)
        small = sum(float(ms) for name, ms in listed if name.startswith(("fill ", "copy ", "write ")))
        self.assertAlmostEqual(times["other passes"], small, delta=0.01)
        # Each pass is in one row. The total is a time of its own, which differs on a busy machine.
        single = [float(ms) for name, ms in listed if name not in ("all passes", "with the host's part", "blend on the host")]
        self.assertGreater(len(single), 10)
        self.assertAlmostEqual(sum(times[name] for name in (*passes, other)), sum(single), delta=0.01)

    @unittest.skipUnless(BENCH, "without ewa-bench")
    def test_each_kernel_choice_is_timed(self):
        said = subprocess.run([BENCH, "--help"], stdout=subprocess.PIPE, text=True, check=True).stdout
        listed = re.search(r"--kernels NAME=VALUE,\.\.\.(.*?)\n +--", said, re.DOTALL)[1]
        choices = re.findall(r"(\w+)=([\w|]+)", listed)
        self.assertGreater(len(choices), 5)
        timed = self.shell('printf "%s\\n" "${choices_known[@]}"').splitlines()
        for name, values in choices:
            for value in values.split("|"):
                self.assertTrue(any(re.fullmatch(name + "=" + value.replace("N", r"\d+"), choice) for choice in timed), f"{name}={value}")

    def test_datasets_that_do_not_fit_are_named(self):
        with tempfile.TemporaryDirectory() as folder:
            for name, size in (("a", 2), ("b", 5), ("c", 1)):
                pathlib.Path(folder, name).mkdir()
                pathlib.Path(folder, name, "image").write_bytes(bytes(size << 20))
            pathlib.Path(folder, "kit").mkdir()
            said = self.shell(f"most_megabytes=8; cd {folder}; add_datasets kit a b c; ls kit/datasets")
        outside, *packed = said.splitlines()
        self.assertRegex(outside, r"--data: b, \d MB$")
        self.assertEqual(packed, ["a", "c"])

    def test_a_full_run_that_the_limit_stops_is_continued(self):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for name in ("work/bin", "work/logs", "state", "fox_540"):
                (root / name).mkdir(parents=True)
            (root / "work/bin/ewa").write_text(PROGRAM)
            (root / "work/bin/ewa").chmod(0o755)
            command = (f"cd {folder}; work={folder}/work logs={folder}/work/logs out={folder} state={folder}/state rows=() chosen=() failed=0 "
                       f"datasets=({folder}/fox_540) dataset={folder}/fox_540 full_steps=30 full_caps=1000 full_patience=1 "
                       'seconds=0 took=0; deadline=$((SECONDS + LIMIT)); stage_full > log; printf "%s\\n" "${rows[@]}"; echo $failed')
            first = self.shell(command.replace("LIMIT", "3")).splitlines()
            self.assertRegex(first[0], r"^full +fox_540, adc, 30 steps, at most 1000 splats: stopped by the limit after \d+ steps")
            self.assertRegex(first[1], r"^full +1 more runs")
            self.assertEqual(first[2], "0")
            second = self.shell(command.replace("LIMIT", "20")).splitlines()
            self.assertEqual(second[2], "0")
            for line, strategy in zip(second, ("adc", "mcmc")):
                self.assertRegex(line, rf"^full +ok +fox_540, {strategy}, 30 steps")
            lines = [json.loads(line) for line in (root / "results.jsonl").read_text().splitlines()]
            self.assertEqual([line["full"]["summary"]["steps"] for line in lines if "full" in line], [30, 30])


class GpuTable(unittest.TestCase):
    DEVICES = [{"index": 0, "name": "llvmpipe", "type": "cpu", "driver": "Mesa", "api_version": "1.3", "subgroup_size": 8},
               {"index": 1, "name": "Card", "type": "discrete", "driver": "580.1", "api_version": "1.4", "subgroup_size": 32}]

    def table(self, *runs, chosen=""):
        with tempfile.TemporaryDirectory() as folder:
            for number, records in enumerate(runs):
                head = {"schema": "ewa-gpu-check-1", "date": f"2026-01-0{number + 1}", "small": 0, "chosen": chosen, "devices": self.DEVICES}
                pathlib.Path(folder, str(number)).mkdir()
                pathlib.Path(folder, str(number), "results.jsonl").write_text("".join(json.dumps(record) + "\n" for record in (head, *records)))
            return subprocess.run([PROJECT / "scripts/gpu-table", *sorted(pathlib.Path(folder).iterdir())], stdout=subprocess.PIPE, text=True,
                                  check=True).stdout

    def row(self, stage, figures, result="ok"):
        return {"stage": stage, "result": result, "figures": figures, "predicted": ""}

    def test_rows_are_records_whatever_they_hold(self):
        with tempfile.TemporaryDirectory() as folder:
            text = 'a "quoted" \\ path\tand a | bar'
            subprocess.run(["bash", "-c", f'source {PROJECT}/scripts/gpu-check; mkdir {folder}/logs; work={folder} out={folder} rows=(); '
                            'row checks ok "$1" "all good"', "-", text], check=True)
            self.assertEqual(json.loads(pathlib.Path(folder, "results.jsonl").read_text()),
                             {"stage": "checks", "result": "ok", "figures": text.replace("\t", " "), "predicted": "all good"})

    def test_the_device_is_named(self):
        self.assertTrue(self.table([]).startswith("Card (driver 580.1, Vulkan 1.4, 32 lanes), 2026-01-01\n"))
        for chosen in ("0", "LLVM"):
            self.assertTrue(self.table([], chosen=chosen).startswith("llvmpipe (driver Mesa,"))

    def test_the_last_run_of_a_stage_counts(self):
        said = self.table([self.row("checks", "old"), self.row("tests", "kept")], [self.row("checks", "new")])
        self.assertIn("| `checks` | ok | new |", said)
        self.assertIn("| `tests` | ok | kept |", said)
        self.assertNotIn("old", said)
        self.assertEqual(said.count("Card"), 1)

    def test_passes_comparisons_and_full_runs_have_tables(self):
        one = {"comparison": "seconds", "trainer": "ewa", "device": "Card", "steps": 7000, "splats": 99000, "seconds": 8.44, "step_ms": 1.2057,
               "psnr": 31.456, "device_mib": 170.2}
        summary = {"strategy": "mcmc", "steps": 30000, "splats": 300000, "seconds": 61.25, "seconds_per_step": 0.0020417,
                   "peak_device_bytes": 300 << 20, "test_psnr": 29.876, "test_ssim": None}
        said = self.table([self.row("million", "an image 1.2 ms"), {"pass": "blend", "ms": 0.3612, "predicted": ["0.25", "0.22", "-"]},
                           self.row("compare", "fox_540, adc"), self.row("", "  seconds, ewa"),
                           {"compare": {"dataset": "fox_540", "strategy": "adc", "steps": 7000, "max_splats": 1000000, "used": {"ssim": "fussim 1"},
                                        "rows": [one], "not_equal": ["memory"]}},
                           self.row("full", "in the table"), {"full": {"dataset": "fox_nerf", "cap": 300000, "summary": summary}},
                           self.row("full", "stopped by the limit", "")])
        for line in ("| `million` | ok | an image 1.2 ms |  |", "| blend | 0.361 | 0.25 | 0.22 |  |",
                     "fox_540, adc, 7,000 steps, at most 1,000,000 splats; ssim fussim 1", "- memory",
                     "| seconds | ewa | 7,000 | 99,000 | 8.4 | 1.206 | 31.46 dB | 170 MiB |", "| `full` |  | stopped by the limit |  |",
                     "| fox_nerf | mcmc | 30,000 | 300,000 | 300,000 | 61.2 | 2.042 | 300 MiB | 29.88 dB |  |"):
            self.assertIn(line + "\n", said)
        self.assertNotIn("in the table", said)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
