#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Renders a splat file through the cameras of a dataset: render_ply.py SPLATS CAMERAS OUT [--frames I...]

SPLATS is any file that ewa reads. CAMERAS is a transforms.json or a folder with a COLMAP model; its images need not be there.
OUT is a folder, which gets a PNG for each frame.
"""

import argparse
import pathlib

import ewa


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("splats", type=pathlib.Path)
    parser.add_argument("cameras", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument(
        "--frames", type=int, nargs="+", metavar="I", help="indices in the order of names [all]"
    )
    parser.add_argument(
        "--background", default="black", help='a colour such as "white" or "#8080ff"'
    )
    options = parser.parse_args()

    data = ewa.Dataset(options.cameras, need_images=False)
    renderer = ewa.Renderer(ewa.load(options.splats))
    options.out.mkdir(parents=True, exist_ok=True)
    for i in options.frames or range(len(data)):
        frame = data.frames[i]
        renders = renderer.render(
            data.viewmats[i], data.Ks[i], frame.width, frame.height, background=options.background
        )
        ewa.save_image(
            options.out / pathlib.PurePath(frame.name).with_suffix(".png").name, renders.color
        )


if __name__ == "__main__":
    main()
