# SPDX-License-Identifier: Apache-2.0
"""bench/captures.py searches the cameras of each capture once, trains it once for each seed, and its table says what came out."""
import contextlib, importlib.util, io, json, math, pathlib, struct, subprocess, sys, tempfile, unittest

PROJECT = pathlib.Path(__file__).resolve().parents[2]
SCRIPT = PROJECT / "bench/captures.py"
sys.dont_write_bytecode = True  # no cache beside a script
sys.path.insert(0, str(SCRIPT.parent))
import captures

# In the place of ewa: it notes each call in the file `log`. Cameras turn by 0.2 radians a photo, about the vertical axis of a world that is
# turned by 1 radian. The second photo of "turned" is half a turn off, and "blind" has no cameras.
PROGRAM = """#!{python} -IS
import json, math, pathlib, struct, sys
words = sys.argv[1:]
def option(name):
    return words[words.index(name) + 1]
out = pathlib.Path(option("-o"))
with open({log!r}, "a") as log:
    print(words[0], out.parent.name.rpartition("-")[0], *([option("--seed"), option("--steps")] if words[0] == "train" else []), file=log)
if words[0] == "cameras":
    capture = pathlib.Path(words[1]).parent.name
    if capture == "blind":
        sys.exit("ewa cameras: COLMAP could not place the photos")
    (out / "sparse/0").mkdir(parents=True)
    data = struct.pack("<Q", 3)
    for k in range(3):
        angle = 1 + 0.2 * k + (math.pi if capture == "turned" and k == 1 else 0)
        data += struct.pack("<I7dI", k + 1, math.cos(angle / 2), 0, math.sin(angle / 2), 0, 1, 2, 3, 1)
        data += f"p{{k}}.jpg".encode() + b"\\0" + struct.pack("<Q", 1) + bytes(24)
    (out / "sparse/0/images.bin").write_bytes(data)
    print("placed 2 of 4 photos in 1 s", file=sys.stderr)
    print("some cameras may be wrong, or things look alike: 1 pair", file=sys.stderr)
    print(f"{{capture}}: 3 of 4 photos have cameras")
if words[0] == "dataset":
    scene = json.loads(pathlib.Path(words[1]).read_text())
    names = [node["name"] for node in scene["nodes"] if "camera" in node]
    (out / "images").mkdir(parents=True)
    for name in names:
        (out / "images" / (name + ".png")).write_text(option("--through") if "--through" in words else "pinhole")
    # The camera's right, up and back are the world's y, z and x: it looks along -x, three units from the origin.
    matrix = [[0, 0, 1, 3], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]]
    (out / "transforms.json").write_text(json.dumps({{"frames": [dict(file_path="images/" + name + ".png", transform_matrix=matrix)
                                                                for name in names]}}))
if words[0] == "train":
    seed = int(option("--seed"))
    out.mkdir(parents=True)
    curve = [(100, 18.0), (200, 21.0 + seed), (300, 20.0 + seed)]
    (out / "metrics.jsonl").write_text("\\n".join(
        json.dumps(dict(step=step, test_psnr=psnr, test_fitted_psnr=psnr + 2)) for step, psnr in curve))
    (out / "config.json").write_text('{{"appearance": "none", "background": "0.5,0.5,0.5"}}')
    (out / "checkpoint.ewa").write_text("large")
    (out / "summary.json").write_text(json.dumps(dict(test_psnr=20.0 + seed, test_ssim=0.5, splats=1000, seconds=10.0,
                                                      train_psnr=30.0, strategy="adc")))
"""


def about_vertical(angle):
    return [math.cos(angle), 0, math.sin(angle), 0, 1, 0, -math.sin(angle), 0, math.cos(angle)]


class WithProgram(unittest.TestCase):
    """A folder with PROGRAM in it."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.ewa = self.folder / "ewa"
        self.ewa.write_text(PROGRAM.format(python=sys.executable, log=str(self.folder / "log")))
        self.ewa.chmod(0o755)


class Captures(WithProgram):
    def setUp(self):
        super().setUp()
        for name in ("right", "turned"):
            self.capture(name)
        (self.folder / "photos/notes").mkdir()

    def capture(self, name):
        place = self.folder / "photos" / name
        (place / "photos").mkdir(parents=True)
        for k in range(4):
            (place / f"photos/p{k}.jpg").write_text(f"{name} {k}")
        (place / "reference_cameras.json").write_text(json.dumps({f"p{k}": [about_vertical(0.2 * k), [0, 0, 0]] for k in range(3)}))

    def run_script(self, *words):
        """(exit status, standard output, standard error)"""
        said, complaint = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(complaint):
            try:
                status = captures.main([str(word) for word in (self.folder / "photos", "--ewa", self.ewa, "--out", self.folder / "out",
                                                               *words)])
            except SystemExit as end:
                status = end.code
        return status, said.getvalue(), complaint.getvalue()

    def called(self):
        log = self.folder / "log"
        lines = [line.strip() for line in log.read_text().splitlines()] if log.exists() else []
        log.unlink(missing_ok=True)
        return lines

    def rows(self):
        lines = (self.folder / "out/captures.md").read_text().splitlines()
        return {row[0]: dict(zip(captures.HEADINGS, row)) for row in ([cell.strip() for cell in line.strip("|").split("|")]
                                                                    for line in lines[4:])}

    def test_the_table_has_what_came_out(self):
        peers = self.folder / "peers.json"
        peers.write_text('{"right": {"other": 19.5}}')
        status, _, complaint = self.run_script("--seeds", "1,2", "--steps", "300", "--peers", peers)
        self.assertEqual((status, complaint), (0, ""))
        right, turned = self.rows()["right"], self.rows()["turned"]
        expected = {"placed": "3 of 4", "turned: median, largest": "0.0, 0.0", "doubts": "1", "PSNR, dB": "21.50", "+-": "0.71",
                    "best": "23.00 at 200", "fitted": "23.50", "training views": "30.00", "splats": "1,000",
                    "chosen": "adc, appearance none, background 0.5,0.5,0.5", "peers": "other 19.50"}
        self.assertEqual({name: right[name] for name in expected}, expected)
        self.assertEqual(turned["turned: median, largest"], "0.0, 180.0; 1 wrong")
        self.assertEqual(turned["peers"], "-")
        found = json.loads((self.folder / "out/captures.json").read_text())["captures"]["right"]
        self.assertEqual(found["search"]["tries"], ["placed 2 of 4 photos in 1 s"])
        self.assertEqual([run["psnr"] for run in found["runs"]], [21.0, 22.0])

    def test_nothing_is_done_twice(self):
        words = ("--seeds", "1", "--steps", "300", "--only", "right")
        self.run_script(*words)
        self.assertEqual(self.called(), ["cameras right", "train right 1 300"])
        self.assertEqual(list((self.folder / "out").rglob("checkpoint.ewa")), [])
        self.run_script(*words)
        self.assertEqual(self.called(), [])
        self.run_script(*words, "--", "--sh-degree", "0")
        self.assertEqual(self.called(), ["train right 1 300"])
        (self.folder / "photos/right/photos/p0.jpg").write_text("another")
        self.run_script(*words)
        self.assertEqual(self.called(), ["cameras right", "train right 1 300"])

    def test_the_others_follow_a_capture_that_fails(self):
        self.capture("blind")
        status, said, _ = self.run_script("--seeds", "1")
        self.assertEqual(status, 1)
        self.assertEqual(self.rows()["blind"]["placed"], "0 of 4")
        self.assertEqual(self.rows()["blind"]["chosen"], "ewa cameras: COLMAP could not place the photos")
        self.assertEqual(self.rows()["turned"]["PSNR, dB"], "21.00")
        self.called()
        self.run_script("--seeds", "1")
        self.assertEqual(self.called(), ["cameras blind"])

    def test_wrong_words_end_it(self):
        for words, text in ((("--only", "lef"), "there is no capture lef"), (("--peers", self.folder / "none"), "No such file"),
                            (("--seeds", "x"), "whole numbers")):
            status, _, complaint = self.run_script(*words)
            self.assertEqual((status, complaint.count("\n"), text in complaint), (2, 1, True), complaint)
            self.assertTrue(complaint.startswith("captures: "), complaint)


@unittest.skipUnless(importlib.util.find_spec("numpy"), "scenes are made with numpy")
class RenderedCaptures(WithProgram):
    def make(self, *words):
        subprocess.run([sys.executable, SCRIPT.parent / "rendered_captures.py", self.folder / "out", "--ewa", self.ewa, *words], check=True,
                       capture_output=True)

    def test_references_have_the_axes_of_opencv(self):
        self.make("--only", "twins")
        cameras = json.loads((self.folder / "out/twins/reference_cameras.json").read_text())
        photos = sorted(path.stem for path in (self.folder / "out/twins/photos").iterdir())
        self.assertEqual(sorted(cameras), photos)
        self.assertEqual(len(photos), 32)
        rotation, centre = cameras[photos[0]]
        self.assertEqual(centre, [3, 0, 0])
        self.assertEqual([rotation[3 * k:3 * k + 3] for k in range(3)], [[0, 1, 0], [0, 0, -1], [-1, 0, 0]])  # right, down, forward

    def test_strangers_have_three_lenses_in_turn(self):
        self.make("--only", "strangers,twins")
        photos = sorted((self.folder / "out/strangers/photos").iterdir())
        lenses = [path.read_text() for path in photos]
        self.assertEqual(len(set(lenses)), 3)
        self.assertEqual(lenses[:3] * 10, lenses[:30])
        self.assertEqual({path.read_text() for path in (self.folder / "out/twins/photos").iterdir()}, {"pinhole"})
        before = (self.folder / "log").read_text()
        self.make("--only", "twins")
        self.assertEqual((self.folder / "log").read_text(), before)  # what is there is not rendered again


if __name__ == "__main__":
    unittest.main()
