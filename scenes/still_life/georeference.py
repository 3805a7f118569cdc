#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A COLMAP text dataset as a survey would place it: moved by (x, y, z), 5e6 4e6 300 unless said, with the same pictures.

    python3 scenes/still_life/georeference.py OUTPUT [--by X Y Z] [--dataset DIR]
"""

import argparse
import pathlib
import shutil


def rotation(w, x, y, z):
    n = (w * w + x * x + y * y + z * z) ** 0.5
    w, x, y, z = w / n, x / n, y / n, z / n
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]


def moved_pose(line, offset):
    """World to camera, so the camera's translation becomes t - R offset."""
    parts = line.split()
    for k, row in enumerate(rotation(*map(float, parts[1:5]))):
        parts[5 + k] = repr(float(parts[5 + k]) - sum(r * o for r, o in zip(row, offset)))
    return " ".join(parts)


def moved_point(line, offset):
    parts = line.split()
    return " ".join([parts[0], *(repr(float(p) + o) for p, o in zip(parts[1:4], offset)), *parts[4:]])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("output", type=pathlib.Path)
    parser.add_argument("--by", type=float, nargs=3, default=(5e6, 4e6, 300.0), metavar=("X", "Y", "Z"))
    parser.add_argument("--dataset", type=pathlib.Path, default=pathlib.Path(__file__).parent)
    options = parser.parse_args()

    model, to = options.dataset / "sparse/0", options.output / "sparse/0"
    to.mkdir(parents=True)
    shutil.copytree(options.dataset / "images", options.output / "images")
    shutil.copy(model / "cameras.txt", to)
    lines = [line for line in (model / "images.txt").read_text().splitlines() if not line.startswith("#")]
    # Every other line lists 2D observations.
    (to / "images.txt").write_text("\n".join(
        moved_pose(line, options.by) if i % 2 == 0 else line for i, line in enumerate(lines)) + "\n")
    lines = [line for line in (model / "points3D.txt").read_text().splitlines() if line and not line.startswith("#")]
    (to / "points3D.txt").write_text("\n".join(moved_point(line, options.by) for line in lines) + "\n")


if __name__ == "__main__":
    main()
