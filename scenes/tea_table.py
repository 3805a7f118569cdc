#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""tea_table.gltf: what looks different from every side. A glossy floor that mirrors what stands on it, brass, glazed
clay, textures from coarse to fine, a wire basket. 44 cameras on two rings."""

import pathlib

import numpy as np

from modelling import textures
from modelling.gltf import Gltf
from modelling.shapes import ball, box, disc, joined, lathe, leaf, tube, turn


def floor_texture():
    size = 256
    y, x = np.mgrid[:size, :size] / size
    grain = textures.noise(size, 4, 1)
    streaks = textures.noise(size, 8, 2)[:, :1] * np.ones(size)
    column, row = np.floor(4 * x).astype(int), np.floor(2 * y + 0.5 * (np.floor(4 * x) % 2)).astype(int)
    shade = np.random.default_rng(3).random((4, 4))[column % 4, row % 4]
    wood = textures.mixed((0.42, 0.25, 0.14), (0.72, 0.50, 0.30), 0.5 * shade + 0.35 * grain + 0.15 * streaks)
    gap = np.minimum((4 * x) % 1, (2 * y + 0.5 * (np.floor(4 * x) % 2)) % 1 * 2) < 0.03
    return np.where(gap[..., None], 0.16, wood)


def cloth_texture():
    size = 128
    y, x = np.mgrid[:size, :size] / size
    blue, white, red = (0.16, 0.30, 0.55), (0.93, 0.92, 0.88), (0.75, 0.18, 0.15)
    wide = ((np.floor(4 * x) + np.floor(4 * y)) % 2)
    image = textures.mixed(blue, white, wide)
    fine = (np.floor(16 * x) % 4 == 0) | (np.floor(16 * y) % 4 == 0)
    return np.where(fine[..., None], 0.6 * image + 0.4 * np.array(red), image)


def crate_texture():
    size = 128
    y, x = np.mgrid[:size, :size] / size
    plank = np.floor(5 * y)
    wood = textures.mixed((0.55, 0.38, 0.20), (0.83, 0.66, 0.42), 0.6 * textures.noise(size, 4, 5) + 0.08 * (plank % 3))
    dark = ((5 * y) % 1 < 0.07) | (x < 0.02) | (x > 0.98)
    ring = np.abs(np.hypot(x - 0.5, y - 0.5) - 0.27) < 0.035
    bar = (np.abs(x - 0.5) < 0.035) & (np.abs(y - 0.5) < 0.27)
    wood = np.where((ring | bar)[..., None], (0.12, 0.32, 0.28), wood)
    return np.where(dark[..., None], 0.2 * wood, wood)


def glaze_texture():
    size = 128
    y, x = np.mgrid[:size, :size] / size
    wave = 0.5 + 0.04 * np.sin(2 * np.pi * 8 * x)
    bands = (np.abs(y - wave) < 0.03) | (np.abs(y - 0.25) < 0.015) | (np.abs(y - 0.30) < 0.008)
    dots = (np.hypot((12 * x) % 1 - 0.5, (y - 0.38) * 12) < 0.25)
    base = textures.mixed((0.88, 0.86, 0.80), (0.80, 0.78, 0.70), textures.noise(size, 8, 7))
    return np.where((bands | dots)[..., None], (0.10, 0.20, 0.50), base)


def basket():
    wires = []
    around = np.linspace(0, 2 * np.pi, 32, endpoint=False)
    for height, radius in ((0.0, 0.20), (0.11, 0.25), (0.22, 0.28), (0.30, 0.29)):
        wires.append(tube(np.stack([radius * np.sin(around), 0 * around + height, radius * np.cos(around)], axis=-1),
                          0.008 if height else 0.011, 5, closed=True))
    for a in np.linspace(0, 2 * np.pi, 20, endpoint=False):
        lean = 0.25
        path = [(r * np.sin(a + lean * h), h, r * np.cos(a + lean * h))
                for h, r in ((0.0, 0.20), (0.11, 0.25), (0.22, 0.28), (0.30, 0.29))]
        wires.append(tube(path, 0.007, 4))
    handle = np.linspace(0, np.pi, 13)
    wires.append(tube(np.stack([0.29 * np.cos(handle), 0.30 + 0.24 * np.sin(handle), 0 * handle], axis=-1), 0.01, 5))
    return joined(wires)


def plant():
    stalks, leaves = [], []
    rng = np.random.default_rng(11)
    for i in range(26):
        a, up = 137.5 * i, 0.10 + 0.016 * i
        tilt = 75 - 2.2 * i
        rotation = turn("y", a) @ turn("x", -rng.uniform(10, 25) + 0.2 * (60 - tilt))
        leaves.append(leaf(0.26 - 0.004 * i, 0.075, 0.45).moved((0, up, 0), rotation))
    stalks.append(tube([(0, 0, 0), (0.01, 0.2, 0.005), (0, 0.42, 0), (0.005, 0.54, 0)], 0.008, 5))
    return joined(stalks), joined(leaves)


def build():
    g = Gltf(sky=((0.50, 0.60, 0.80), (0.75, 0.75, 0.72), (0.25, 0.23, 0.20)))
    floor = g.material(roughness=0.3, texture=g.texture("floor", textures.png(floor_texture())))
    cloth = g.material(roughness=0.9, texture=g.texture("cloth", textures.png(cloth_texture())), two_sided=True)
    crate = g.material(roughness=0.7, texture=g.texture("crate", textures.png(crate_texture())))
    glaze = g.material(roughness=0.12, texture=g.texture("glaze", textures.png(glaze_texture())))
    brass = g.material(base=(0.86, 0.62, 0.26), metallic=1.0, roughness=0.18)
    wire = g.material(base=(0.55, 0.55, 0.56), metallic=1.0, roughness=0.35)
    clay = g.material(base=(0.55, 0.20, 0.11), roughness=0.6)
    green = g.material(base=(0.10, 0.30, 0.06), roughness=0.45, two_sided=True)
    orange = g.material(base=(0.85, 0.32, 0.03), roughness=0.35)
    red = g.material(base=(0.55, 0.03, 0.04), roughness=0.15)

    g.place(g.mesh([(disc(1.5, 64, 0.8), floor),
                    (lathe([(1.38, -0.12), (1.5, -0.06), (1.5, 0.0)], 64, smooth=False), clay)]))
    g.place(g.mesh([(disc(0.62, 48, 0.31), cloth)]), (-0.1, 0.004, 0.25))
    g.place(g.mesh([(box((0.46, 0.46, 0.46)), crate)]), (-0.66, 0.23, -0.55), turn("y", 27))
    g.place(g.mesh([(box((0.3, 0.22, 0.3)), crate)]), (-0.62, 0.57, -0.52), turn("y", 8))
    vase = [(0.0, 0.0), (0.11, 0.0), (0.17, 0.10), (0.19, 0.22), (0.15, 0.36), (0.08, 0.48), (0.07, 0.54), (0.10, 0.60),
            (0.09, 0.60), (0.055, 0.53), (0.06, 0.47)]
    g.place(g.mesh([(lathe(vase, 32), glaze)]), (0.12, 0.004, -0.02))
    g.place(g.mesh([(ball(0.2, 40, 20), brass)]), (0.62, 0.2, 0.42))
    g.place(g.mesh([(basket(), wire)]), (-0.42, 0.01, 0.52), turn("y", 35))
    fruit = ball(0.085, 20, 12)
    fruits = g.mesh([(fruit, orange)])
    for offset in ((-0.50, 0.10, 0.56), (-0.34, 0.10, 0.60), (-0.42, 0.10, 0.42), (-0.42, 0.23, 0.52)):
        g.place(fruits, offset)
    g.place(g.mesh([(lathe([(0.0, 0.0), (0.10, 0.0), (0.14, 0.06), (0.15, 0.17), (0.135, 0.17), (0.12, 0.06), (0.0, 0.03)],
                           28), red)]), (0.22, 0.004, 0.55))
    stalk, leaves = plant()
    pot = lathe([(0.0, 0.0), (0.13, 0.0), (0.17, 0.22), (0.19, 0.22), (0.19, 0.26), (0.15, 0.26), (0.15, 0.2), (0.0, 0.2)],
                28, smooth=False)
    g.place(g.mesh([(pot, clay)]), (0.62, 0, -0.55))
    g.place(g.mesh([(stalk, green), (leaves, green)]), (0.62, 0.2, -0.55))
    g.sun((0.55, -1.0, -0.35), (2.6, 2.4, 2.1))
    g.rings_of_cameras((0, 0.22, 0), ((22, 3.3, 24), (22, 3.2, 48)), 45)
    return g


if __name__ == "__main__":
    build().write(pathlib.Path(__file__).with_suffix(".gltf"))
