# SPDX-License-Identifier: Apache-2.0
"""bench/quality.py trains what is asked for, once, and its tables say what the runs' summaries say.

    test_quality.py EWA      the program, with which small runs are made; without it only the rest is tested
"""
import contextlib, io, json, os, pathlib, signal, subprocess, sys, tempfile, unittest, xml.etree.ElementTree

PROJECT = pathlib.Path(__file__).resolve().parents[2]
SCRIPT = PROJECT / "bench/quality.py"
sys.dont_write_bytecode = True  # no cache beside a script
sys.path.insert(0, str(SCRIPT.parent))
import quality

EWA = sys.argv[1] if len(sys.argv) > 1 else None

# In the place of ewa: it notes each training in the file `log`, and its PSNR follows from dataset, steps and seed.
PROGRAM = """#!{python} -IS
import json, pathlib, sys, time
NAME, GAINS, FAILS = {name!r}, {gains!r}, {fails!r}
words = sys.argv[1:]
def option(name):
    return words[words.index(name) + 1]
if words[0] == "info" and not (pathlib.Path(words[1]) / "images").exists():
    sys.exit(f"ewa info: {{words[1]}}: not a dataset")
if words[0] == "dataset":
    out = pathlib.Path(option("-o"))
    (out / "images").mkdir(parents=True, exist_ok=True)
    (out / "transforms.json").write_text(words[1])
if words[0] == "train":
    dataset, out, steps, seed = pathlib.Path(words[1]).name, pathlib.Path(option("-o")), int(option("--steps")), int(option("--seed"))
    strategy = option("--strategy") if "--strategy" in words else "auto"
    with open({log!r}, "a") as log:
        print(NAME, dataset, steps, seed, strategy, "sh" if "--sh-degree" in words else "", file=log)
    for key in FAILS.keys() & {{dataset, f"{{dataset}} {{seed}}"}}:
        print("ewa train: it is broken", file=sys.stderr)
        sys.exit(FAILS[key]) if FAILS[key] else time.sleep(600)
    (out / "test").mkdir(parents=True, exist_ok=True)
    (out / "test/view.png").write_text(NAME)
    (out / "checkpoint.ewa").write_text("large")
    (out / "summary.json").write_text(json.dumps(dict(
        test_psnr=20 + steps / 100 + seed / 10 + GAINS.get(dataset, 0), test_ssim=0.5 + steps / 1e4, splats=1000 + seed,
        seconds=steps / 10, wall_seconds=steps / 5 * (1 + (dataset == "two")), device="a device", interrupted=False)))
"""


class WithPrograms(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.out = self.folder / "out"
        for name in ("one", "two", "three"):
            self.dataset(name)
        self.ewa = self.program("ewa")
        self.put(quality, "SHARED", self.folder)
        self.put(quality, "RENDERED", self.folder / "rendered")

    def put(self, place, name, value):
        self.addCleanup(setattr, place, name, getattr(place, name))
        setattr(place, name, value)

    def dataset(self, name, content="an image"):
        (self.folder / name / "images").mkdir(parents=True, exist_ok=True)
        (self.folder / name / "images/view.jpg").write_text(content)

    def program(self, name, gains={}, fails={}):
        path = self.folder / name
        path.write_text(PROGRAM.format(python=sys.executable, name=name, gains=gains, fails=fails, log=str(self.folder / "log")))
        path.chmod(0o755)
        return path

    def run_script(self, *words):
        """(exit status, standard output, standard error)"""
        said, complaint = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(complaint):
            try:
                status = quality.main([str(word) for word in ("--ewa", self.ewa, "--out", self.out, *words)])
            except SystemExit as end:
                status = end.code
        return status, said.getvalue(), complaint.getvalue()

    def trained(self):
        """What was trained since the last call, in that order."""
        log = self.folder / "log"
        lines = [line.strip() for line in log.read_text().splitlines()] if log.exists() else []
        log.unlink(missing_ok=True)
        return lines

    def report(self):
        return json.loads((self.out / "quality.json").read_text())


class Runs(WithPrograms):
    def test_a_finished_run_is_not_trained_again(self):
        words = ("one", "two", "--steps", "200,100", "--seeds", "1,2")
        status, said, _ = self.run_script(*words)
        self.assertEqual(status, 0)
        self.assertEqual(self.trained()[:4], ["ewa one 100 1 auto", "ewa two 100 1 auto", "ewa one 100 2 auto", "ewa two 100 2 auto"])
        # A step of dataset two takes twice as long as one of dataset one.
        self.assertIn("[2/8] two, 100 steps, seed 1: 21.10 dB, SSIM 0.5100, 1,001 splats, 10.0 s; 5 min left\n", said)
        self.assertIn("[7/8] one, 200 steps, seed 2: 22.20 dB, SSIM 0.5200, 1,002 splats, 20.0 s; 80 s left\n", said)
        self.assertEqual(list(self.out.rglob("checkpoint.ewa")), [])
        before = self.report()
        self.assertEqual(self.run_script(*words)[0], 0)
        self.assertEqual(self.trained(), [])
        self.assertEqual(self.report(), before)

    def test_a_run_is_trained_again_where_its_inputs_changed(self):
        words = ("one", "two", "--steps", "100", "--seeds", "1")
        self.run_script(*words)
        self.dataset("two", "another image")
        self.trained()
        self.run_script(*words)
        self.assertEqual(self.trained(), ["ewa two 100 1 auto"])
        self.run_script(*words, "--", "--sh-degree", "0")
        self.assertEqual(self.trained(), ["ewa one 100 1 auto sh", "ewa two 100 1 auto sh"])
        self.program("ewa", {"one": 1})
        self.run_script(*words)
        self.assertEqual(len(self.trained()), 2)
        options = self.folder / "options.json"
        for content in ("{}", '{"sh-degree": 0}'):
            options.write_text(content)
            self.run_script(*words, "--", f"--config={options}")
            self.assertEqual(len(self.trained()), 2)

    def test_an_interrupted_run_is_trained_again(self):
        words = ("one", "--steps", "100", "--seeds", "1")
        self.run_script(*words)
        summary = next(self.out.rglob("summary.json"))
        summary.write_text(summary.read_text().replace("false", "true"))
        self.trained()
        self.run_script(*words)
        self.assertEqual(self.trained(), ["ewa one 100 1 auto"])

    def test_the_others_follow_a_run_that_fails(self):
        self.program("ewa", fails={"one": 1})
        status, said, _ = self.run_script("one", "two", "--steps", "100", "--seeds", "1")
        self.assertEqual(status, 1)
        self.assertIn("[1/2] one, 100 steps, seed 1: failed: ewa ended with status 1: ewa train: it is broken\n", said)
        self.assertEqual([row["dataset"] for row in self.report()["rows"]], ["two"])

    def test_a_mistake_in_its_options_is_ewas_own_line(self):
        self.program("ewa", fails={"one": 2})
        status, _, complaint = self.run_script("one", "two", "--steps", "100", "--", "--nonsense")
        self.assertEqual((status, complaint), (2, "quality: ewa train: it is broken\n"))
        self.assertEqual(len(self.trained()), 1)

    def test_a_signal_ends_the_training_too(self):
        program = self.program("endless", fails={"one": 0})
        os.mkfifo(self.folder / "log")
        script = subprocess.Popen([sys.executable, SCRIPT, self.folder / "one", "--ewa", program, "--out", self.out],
                                  stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        (self.folder / "log").read_text()  # ends when the training has begun
        script.send_signal(signal.SIGTERM)
        _, complaint = script.communicate(timeout=60)  # standard output stays open as long as the training
        self.assertEqual((script.returncode, complaint), (130, "quality: interrupted; the same command continues\n"))

    def test_a_signal_at_the_start_of_a_program_ends_it(self):
        child, started, popen = quality.Child(), [], subprocess.Popen

        def start(*words, **how):
            started.append(popen(*words, **how))
            child.stop()
            return started[0]
        self.put(subprocess, "Popen", start)
        with self.assertRaises(KeyboardInterrupt):
            child.run(["sleep", "30"])
        self.assertEqual(started[0].returncode, -signal.SIGTERM)

    def test_a_scene_is_rendered_into_the_cache(self):
        status, said, _ = self.run_script("plaster", "--steps", "100", "--seeds", "1")
        self.assertEqual((status, self.trained()), (0, ["ewa plaster 100 1 auto"]))
        self.assertEqual((self.folder / "rendered/plaster/transforms.json").read_text(), str(PROJECT / "scenes/plaster.gltf"))
        self.assertIn("rendering plaster.gltf", said)
        self.assertNotIn("rendering", self.run_script("plaster", "--steps", "100", "--seeds", "1")[1])

    def test_datasets_that_are_not_there_are_told(self):
        said = self.run_script("--steps", "100", "--seeds", "1")[1]
        self.assertIn("without fox_270, fox_540: not in", said)
        self.assertEqual(len(self.trained()), 3)

    def test_what_cannot_be_used_is_refused_with_one_line(self):
        for words, expected in [
                (["nosuch"], "there is no dataset 'nosuch': expected a scene (orchard, plaster, railing, tea_table), the name of a folder in"),
                ([self.folder], "not a dataset"), (["one", "--steps", "100,0"], "'100,0': expected numbers such as 250,7k"),
                (["one", "--seeds", "x"], "whole numbers"), (["one", "--strategies", "none,best"], "default, adc, mcmc, none"),
                (["one", "--nonsense"], "unrecognized arguments: --nonsense"), (["one", self.folder / "deep/one"], "two datasets"),
                (["one", "--before", self.ewa], "the same program"), (["one", "--before", self.folder / "none"], "No such file"),
                (["one", "--json", self.ewa / "x.json"], "x.json")]:
            self.dataset("deep/one")
            with self.subTest(words=words):
                status, _, complaint = self.run_script(*words)
                self.assertIn(status, (1, 2))
                self.assertIn(expected, complaint)
                self.assertEqual(complaint.count("\n"), 1)
        self.assertEqual(self.trained(), [])


class Tables(WithPrograms):
    def compare(self, *words):
        self.before = self.program("old", {"one": -1, "two": 0.25, "three": -0.5})
        return self.run_script("one", "two", "three", "--before", self.before, *words)

    def test_means_over_the_seeds(self):
        _, said, _ = self.run_script("one", "--steps", "100,2k", "--seeds", "1,3")
        first, second = self.report()["rows"]
        self.assertAlmostEqual(first["ewa"]["psnr"], 21.2)
        self.assertAlmostEqual(first["ewa"]["psnr_deviation"], 0.2 / 2**0.5)
        self.assertEqual((second["steps"], second["ewa"]["seconds"], second["ewa"]["seeds"]), (2000, 200, 2))
        table = (self.out / "quality.md").read_text()
        self.assertIn("| dataset | steps | PSNR, dB | +- | SSIM | splats | seconds |\n", table)
        self.assertIn("| one | 2,000 | 40.20 | 0.14 | 0.7000 | 1,002 | 200.0 |\n", table)
        self.assertIn(table, said)

    def test_before_and_after_alternate_and_are_compared(self):
        self.compare("--steps", "100,200", "--seeds", "1,2")
        self.assertEqual(self.trained()[:4], ["old one 100 1 auto", "ewa one 100 1 auto", "old two 100 1 auto", "ewa two 100 1 auto"])
        report = self.report()
        self.assertEqual([round(row["psnr_difference"], 9) for row in report["rows"]], [1, 1, -0.25, -0.25, 0.5, 0.5])
        self.assertEqual({row["seconds_ratio"] for row in report["rows"]}, {1.0})
        budget = report["budgets"][1]
        self.assertEqual((budget["steps"], budget["higher"], budget["datasets"], budget["worst_dataset"]), (200, 2, 3, "two"))
        table = (self.out / "quality.md").read_text()
        self.assertIn("| two | 100 | 21.40 | 21.15 | -0.25 |", table)
        self.assertTrue(table.endswith("- 200 steps: PSNR is higher on 2 of 3 datasets; the worst difference is -0.25 dB (two)\n"))

    def test_times_of_different_sessions_are_in_no_ratio(self):
        self.run_script("one", "--steps", "100", "--seeds", "1")
        self.compare("--steps", "100", "--seeds", "1")
        self.assertEqual([row["seconds_ratio"] for row in self.report()["rows"]], [None, 1, 1])
        self.assertEqual(self.report()["rows"][0]["psnr_difference"], 1)

    def test_a_difference_is_over_the_seeds_of_both(self):
        self.program("ewa", fails={"one 2": 1})
        self.assertEqual(self.compare("--steps", "100", "--seeds", "1,2")[0], 1)
        row = self.report()["rows"][0]
        self.assertEqual((row["before"]["seeds"], row["after"]["seeds"], round(row["psnr_difference"], 9)), (2, 1, 1))

    def test_each_strategy_has_its_rows_and_drawing(self):
        self.compare("--steps", "100,200", "--seeds", "1", "--strategies", "adc,mcmc")
        self.assertIn("ewa three 200 1 mcmc", self.trained())
        self.assertEqual([(b["strategy"], b["steps"]) for b in self.report()["budgets"]],
                         [("adc", 100), ("adc", 200), ("mcmc", 100), ("mcmc", 200)])
        svg = xml.etree.ElementTree.parse(self.out / "quality.svg").getroot()
        lines = list(svg.iter("{http://www.w3.org/2000/svg}polyline"))
        self.assertEqual(len(lines), 2 * 2 * 3)
        self.assertEqual(sum("stroke-dasharray" in line.attrib for line in lines), 6)

    def test_a_run_lies_in_the_diagram_where_its_axes_say(self):
        self.run_script("one", "--steps", "100,200", "--seeds", "1")
        svg = (self.out / "quality.svg").read_text()
        # 10 and 20 s on an axis from 10 to 20, errors of 21.1 and 22.1 dB on one from 20 (y = 36) to 24 dB (y = 368).
        self.assertIn('<polyline points="64.0,127.3 530.0,210.3"', svg)

    def test_lpips_has_a_column_where_it_can_be_measured(self):
        words = ("one", "--steps", "100", "--seeds", "1")
        self.put(quality, "lpips_meter", lambda: None)
        self.run_script(*words)
        self.assertNotIn("LPIPS", (self.out / "quality.md").read_text())
        asked = []
        self.put(quality, "lpips_meter", lambda: lambda *files: asked.append(files) or 0.25)
        self.run_script(*words)
        self.run_script("two", *words)
        asked.pop()  # of dataset two
        self.assertEqual([[file.name for file in files] for files in asked], [["view.png", "view.jpg"]])
        self.assertIn("| 0.2500 |", (self.out / "quality.md").read_text())


@unittest.skipUnless(EWA, "without ewa")
class SmallRuns(WithPrograms):
    def test_ewa_itself(self):
        self.ewa = EWA
        words = (PROJECT / "scenes/still_life", "--steps", "5,30", "--seeds", "1", "--", "--downscale", "4")
        self.assertEqual(self.run_script(*words)[0], 0)
        few, more = (row["ewa"] for row in self.report()["rows"])
        self.assertGreater(more["psnr"], few["psnr"])
        self.assertGreater(more["ssim"], few["ssim"])
        self.assertGreater(few["seconds"], 0)
        self.assertGreater(few["splats"], 1000)
        self.assertIn("2 of 2 runs are in", self.run_script(*words)[1])
        status, _, complaint = self.run_script(*words, "--nonsense")
        self.assertEqual((status, complaint.count("\n"), complaint.startswith("quality: ewa train: ")), (2, 1, True))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
