# SPDX-License-Identifier: Apache-2.0
"""bench/peers/compare_gsplat.py finds a fused SSIM, reads ewa's splats, gives both trainers the same seconds, and names what differs.

    test_compare.py EWA      the program, whose half is run; without it only the rest is tested

gsplat's half needs CUDA, so no test runs it.
"""
import contextlib, io, json, os, pathlib, struct, subprocess, sys, tempfile, types, unittest
from unittest import mock

PROJECT = pathlib.Path(__file__).resolve().parents[2]
SCRIPT = PROJECT / "bench/peers/compare_gsplat.py"
sys.dont_write_bytecode = True  # no cache beside a script
sys.path.insert(0, str(SCRIPT.parent))
import compare_gsplat as compare

EWA = sys.argv[1] if len(sys.argv) > 1 else None
FOX = pathlib.Path(os.environ.get("EWA_SHARED", PROJECT.parent / "shared"), "data/fox_270")


def package(name, answer):
    """A package with a fused_ssim of its own, which notes its padding."""
    module = types.ModuleType(name)
    module.__version__, module.paddings = "1.2", []

    def fused_ssim(a, b, padding="same", train=True):
        module.paddings.append(padding)
        return answer()
    module.fused_ssim = fused_ssim
    return module


def row(comparison, trainer, steps=1000, splats=50, seconds=1.0):
    return compare.Figures(comparison, trainer, "card", steps, splats, seconds, 1e3 * seconds / steps, 30.0, 100.0)


class FusedSsim(unittest.TestCase):
    def found(self, **packages):
        absent = dict.fromkeys(("fused_ssim", "fussim"))  # None refuses an import
        with mock.patch.dict(sys.modules, absent | packages), contextlib.redirect_stderr(io.StringIO()) as said:
            ssim, name = compare.ssim_function(mock.MagicMock(), "fused")
            ssim(mock.MagicMock(), mock.MagicMock())
            return name, sys.modules["fused_ssim"], said.getvalue()

    def test_fussim_takes_the_name_that_gsplat_imports(self):
        fussim = package("fussim", mock.MagicMock)
        self.assertEqual(self.found(fussim=fussim)[:2], ("fussim 1.2", fussim))
        self.assertEqual(set(fussim.paddings), {"valid"})

    def test_fused_ssim_comes_first(self):
        packages = {name: package(name, mock.MagicMock) for name in ("fused_ssim", "fussim")}
        self.assertEqual(self.found(**packages)[:2], ("fused_ssim 1.2", packages["fused_ssim"]))

    def test_without_one_that_works_there_are_convolutions(self):
        self.assertEqual(self.found()[::2], ("convolutions", ""))

        def fails():
            raise RuntimeError("no kernel for this card")
        name, _, said = self.found(fussim=package("fussim", fails))
        self.assertEqual(name, "convolutions")
        self.assertIn("no kernel for this card", said)


class Comparison(unittest.TestCase):
    def tried(self, seconds, of):
        """The steps that were tried for so many seconds after a run of 1,000, and those of the result. of(steps) are a run's seconds."""
        tried = []

        def train(steps):
            tried.append(steps)
            return row("seconds", "gsplat", steps=steps, seconds=of(steps))
        result = compare.as_long_as(seconds, row("steps", "gsplat", seconds=of(1000)), train)
        self.assertEqual(result.comparison, "seconds")
        return tried, result.steps

    def test_steps_are_tried_until_the_seconds_fit(self):
        self.assertEqual(self.tried(10, lambda steps: steps / 100), ([1000], 1000))
        self.assertEqual(self.tried(10, lambda steps: steps / 50), ([500], 500))
        # Later steps take longer, by more splats.
        self.assertEqual(self.tried(10, lambda steps: (steps / 200) ** 2), ([400, 632], 632))
        # Where nothing fits, the nearest of three counts.
        tried, result = self.tried(10, lambda steps: 8 if steps < 600 else 13)
        self.assertEqual((len(tried), result < 600), (3, True))

    def test_what_is_not_equal_is_named(self):
        rows = [row("steps", "gsplat", splats=40), row("steps", "ewa"), row("seconds", "gsplat", steps=400, seconds=1.2),
                row("seconds", "ewa"), row("splats", "gsplat"), row("splats", "ewa")]
        said = "\n".join(compare.differences(rows, {"ssim": "convolutions", "adam": "selective"}))
        for part in ("steps: gsplat's splats are 0.80", "seconds: gsplat's steps are 0.40", "seconds: gsplat's seconds are 1.20", "convolutions",
                     "visible splats"):
            self.assertIn(part, said)
        self.assertNotIn("splats: gsplat's splats", said)
        said = "\n".join(compare.differences(rows[4:], {"ssim": "fussim 1.2", "adam": "fused"}))
        for part in ("convolutions", "visible splats", "steps: gsplat's"):
            self.assertNotIn(part, said)

    def test_splats_are_read_by_the_names_of_their_columns(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder, "a.ply")
            header = "ply\nformat binary_little_endian 1.0\nelement vertex 2\n" + "".join(f"property float {name}\n" for name in "xyz")
            path.write_bytes(header.encode() + b"end_header\n" + struct.pack("<6f", 1, 2, 3, 4, 5, 6))
            self.assertEqual({name: list(values) for name, values in compare.read_splats(path).items()},
                             {"x": [1, 4], "y": [2, 5], "z": [3, 6]})

    def run_script(self, *options):
        return subprocess.run([sys.executable, "-B", SCRIPT, FOX, *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    @unittest.skipUnless(FOX.is_dir(), "without fox_270")
    def test_wrong_use_ends_with_a_line(self):
        for options, part in ((("--compare", "steps,images"), "images is none of"), (("--only", "ewa", "--compare", "seconds"), "other trainer"),
                              (("--steps", "0"), "at least 1")):
            ran = self.run_script(*options)
            self.assertEqual(ran.returncode, 2)
            self.assertIn(part, ran.stderr)
            self.assertEqual(ran.stderr.count("\n"), 1)

    @unittest.skipUnless(EWA and FOX.is_dir(), "without ewa or fox_270")
    def test_ewas_half_continues_from_its_own_splats(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder, "figures.json")
            ran = self.run_script("--only", "ewa", "--ewa", EWA, "--strategy", "mcmc", "--max-splats", "5000", "--steps", "4", "--json", path)
            self.assertEqual((ran.returncode, ran.stderr), (0, ""))
            figures = json.loads(path.read_text())
        steps, splats = figures["rows"]
        self.assertEqual((steps["comparison"], splats["comparison"]), ("steps", "splats"))
        self.assertEqual(steps["splats"], splats["splats"])
        self.assertGreater(splats["psnr"], steps["psnr"])
        self.assertIn(f"| splats | ewa | {splats['device']} | 4 | {splats['splats']:,} |", ran.stdout)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
