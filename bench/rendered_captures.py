#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Renders captures whose cameras are known, for scripts/bench captures.

    bench/rendered_captures.py FOLDER [--only NAME,NAME...] [--size WxH] [--samples N] [--ewa PROGRAM]

Each becomes FOLDER/NAME with photos/ and reference_cameras.json:

corridor    a walk along a corridor, looking ahead: forward motion
twins       round a can whose label shows the same twice: two equal faces
nadir       a flight over a ground with boxes, looking straight down
forward     a wall with things before it, from places side by side
turntable   round a table with things on it
barrel      the same through a lens with barrel distortion
pincushion  the same through a lens with pincushion distortion
strangers   the same through three lenses in turn
"""
import argparse, json, pathlib, shutil, subprocess, sys, tempfile

sys.dont_write_bytecode = True  # no cache beside a script
PROJECT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(PROJECT / "scenes"))
import numpy as np

from modelling import textures
from modelling.gltf import Gltf
from modelling.shapes import ball, box, disc, joined, lathe, turn

SKY = ((0.50, 0.60, 0.80), (0.75, 0.75, 0.72), (0.25, 0.23, 0.20))
LENSES = {"barrel": "opencv:-0.12,0.02", "pincushion": "opencv:0.08,-0.01"}


def clutter(size, seed, count=160):
    """A picture with as many details as a wall of posters: rectangles and discs of all sizes over noise."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:size, :size] / size
    image = textures.mixed(rng.random(3) * 0.5 + 0.2, rng.random(3) * 0.5 + 0.4, textures.noise(size, 8, seed))
    for _ in range(count):
        at, half, colour, is_box = rng.random(2), 0.004 + 0.05 * rng.random(2) ** 2, rng.random(3), rng.random() < 0.5
        half = half if is_box else half[:1].repeat(2)
        low, high = (np.clip(np.round((at + sign * half) * size), 0, size).astype(int) for sign in (-1, 1))
        there = np.s_[low[1]:high[1], low[0]:high[0]]
        inside = is_box | (np.hypot(x[there] - at[0], y[there] - at[1]) < half[0])
        image[there] = np.where(inside[..., None], colour, image[there])
    return image


def material(g, name, seed, size=512, count=160):
    return g.material(roughness=0.9, diffuse=True, texture=g.texture(name, textures.png(clutter(size, seed, count))), two_sided=True)


def corridor(count=24):
    g = Gltf(sky=((1.2, 1.2, 1.2),) * 3)
    for part in range(8):  # each with walls of its own
        for side, place, size in (("left", (-1.5, 1.4, -1.5 - 3 * part), (0.1, 2.8, 3)), ("right", (1.5, 1.4, -1.5 - 3 * part), (0.1, 2.8, 3)),
                                  ("floor", (0, -0.05, -1.5 - 3 * part), (3, 0.1, 3))):
            g.place(g.mesh([(box(size), material(g, f"{side}{part}", 10 * part + len(side)))]), place)
    g.place(g.mesh([(box((3, 2.8, 0.1)), material(g, "end", 99))]), (0, 1.4, -24))
    rng = np.random.default_rng(1)
    for i in range(count):
        place = np.array([0.15 * np.sin(i), 1.5 + 0.03 * rng.normal(), 1.0 - 0.6 * i])
        g.camera(f"view_{i:02}", place, place + [0.08 * np.sin(0.7 * i), 0.05 * rng.normal() - 0.05, -1], 55)
    return g


def twins(count=32):
    g = Gltf(sky=SKY)
    label = clutter(512, 5, 60)
    both = g.material(roughness=0.6, texture=g.texture("label", textures.png(np.concatenate([label[:, ::2], label[:, ::2]], axis=1))))
    g.place(g.mesh([(lathe([(0.36, 0.0), (0.36, 1.0)], 64), both), (disc(0.36).moved((0, 1, 0)), material(g, "lid", 6, 128, 20))]))
    g.place(g.mesh([(disc(1.3, 48, 1.3), material(g, "table", 7, 512, 60))]))
    g.rings_of_cameras((0, 0.45, 0), ((count, 2.1, 20),), 45)
    return g


def nadir(rows=4, columns=6):
    g = Gltf(sky=SKY)
    g.place(g.mesh([(box((14, 0.1, 14), 14), material(g, "ground", 21, 1024, 900))]), (0, -0.05, 0))
    rng = np.random.default_rng(3)
    roof = material(g, "roof", 22, 256, 60)
    for _ in range(25):
        size = 0.3 + 0.7 * rng.random(3)
        g.place(g.mesh([(box(size), roof)]), (rng.uniform(-4, 4), size[1] / 2, rng.uniform(-4, 4)), turn("y", rng.uniform(0, 90)))
    g.sun((0.4, -1.0, -0.3), (2.2, 2.1, 1.9))
    for row in range(rows):
        for column in range(columns):
            x, z = 1.1 * (column if row % 2 == 0 else columns - 1 - column) - 2.75, 1.5 * row - 2.25
            g.camera(f"view_{row * columns + column:02}", (x, 5.0, z), (x + 0.02, 0, z), 50)
    return g


def forward(count=20):
    g = Gltf(sky=SKY)
    g.place(g.mesh([(box((7, 4, 0.1)), material(g, "wall", 31, 1024, 500))]), (0, 1.5, -3))
    g.place(g.mesh([(box((7, 0.1, 4), 4), material(g, "floor", 32))]), (0, -0.5, -1))
    rng = np.random.default_rng(4)
    for i in range(8):
        size = 0.3 + 0.5 * rng.random()
        shape = ball(size / 2, 24, 12) if i % 2 else box((size, 1.4 * size, size))
        g.place(g.mesh([(shape, material(g, f"thing{i}", 40 + i, 128, 30))]), (rng.uniform(-2, 2), rng.uniform(-0.2, 1.5), rng.uniform(-2, -1)))
    for i in range(count):
        place = (0.22 * (i % 5) - 0.44, 1.0 + 0.2 * (i // 5) - 0.3, 1.5)
        g.camera(f"view_{i:02}", place, (place[0] * 0.6, 0.9, -2), 50)
    return g


def turntable(count=32):
    g = Gltf(sky=SKY)
    g.place(g.mesh([(disc(1.2, 64, 1.2), material(g, "table", 51, 512, 120))]))
    rng = np.random.default_rng(5)
    for i in range(7):
        size, a = 0.25 + 0.25 * rng.random(), 2 * np.pi * i / 7
        shape = joined([box((size, 1.5 * size, size))]) if i % 2 else lathe([(0.4 * size, 0), (0.5 * size, size), (0.2 * size, 1.6 * size)], 24)
        g.place(g.mesh([(shape, material(g, f"thing{i}", 60 + i, 256, 40))]),
                (0.6 * np.sin(a), 0.75 * size if i % 2 else 0, 0.6 * np.cos(a)), turn("y", 40 * i))
    g.sun((0.5, -1.0, -0.4), (2.2, 2.1, 1.9))
    g.rings_of_cameras((0, 0.25, 0), ((count // 2, 2.4, 18), (count // 2, 2.4, 42)), 45)
    return g


# name: the scene, and the lens of the image with a number
CAPTURES = {"corridor": (corridor, None), "twins": (twins, None), "nadir": (nadir, None), "forward": (forward, None),
            "turntable": (turntable, None), "barrel": (turntable, "barrel"), "pincushion": (turntable, "pincushion"),
            "strangers": (turntable, "each")}


def render(scene, out, lens, options):
    words = [options.ewa, "dataset", scene, "-o", out, "--size", options.size, "--samples", str(options.samples), "--points", "0", "--sky",
             "--quiet"]
    subprocess.run([*words, *(("--through", lens) if lens else ())], check=True)


def references(dataset):
    """{name: [rotation world to camera in OpenCV's axes, row by row; centre]} of a transforms.json."""
    found = {}
    for frame in json.loads((dataset / "transforms.json").read_text())["frames"]:
        to_world = np.array(frame["transform_matrix"])
        rotation = (to_world[:3, :3] @ np.diag([1, -1, -1])).T
        found[pathlib.Path(frame["file_path"]).stem] = [rotation.ravel().tolist(), to_world[:3, 3].tolist()]
    return found


def capture(name, options):
    out = options.folder / name
    if (out / "reference_cameras.json").exists():
        return
    (out / "photos").mkdir(parents=True, exist_ok=True)
    make, lens = CAPTURES[name]
    with tempfile.TemporaryDirectory() as work:
        work = pathlib.Path(work)
        make().write(work / "scene.gltf")
        for number, kind in enumerate(("barrel", "pincushion", None) if lens == "each" else (lens,)):
            dataset = work / f"dataset{number}"
            render(work / "scene.gltf", dataset, LENSES.get(kind), options)
            cameras = references(dataset)
            for place, (stem, _) in enumerate(sorted(cameras.items())):
                if lens != "each" or place % 3 == number:
                    shutil.copy(dataset / "images" / f"{stem}.png", out / "photos")
    (out / "reference_cameras.json").write_text(json.dumps(cameras) + "\n")
    print(f"{name}: {len(cameras)} photos", flush=True)


def main():
    parser = argparse.ArgumentParser(usage=argparse.SUPPRESS, allow_abbrev=False, description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", metavar="FOLDER", type=pathlib.Path)
    parser.add_argument("--only", metavar="NAME,NAME...", type=lambda text: text.split(","), default=list(CAPTURES), help="[all]")
    parser.add_argument("--size", metavar="WxH", default="640x480", help="[%(default)s]")
    parser.add_argument("--samples", metavar="N", type=int, default=16, help="paths for each pixel [%(default)s]")
    parser.add_argument("--ewa", metavar="PROGRAM", default=PROJECT / "build/release/ewa", help="[build/release/ewa]")
    options = parser.parse_args()
    for name in options.only:
        if name not in CAPTURES:
            parser.error(f"--only: there is no capture {name}")
        capture(name, options)


if __name__ == "__main__":
    main()
