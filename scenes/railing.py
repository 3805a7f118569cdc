#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""railing.gltf: thin things. Bars, wires, spokes, a net, and leaves cut out of a texture by its alpha. Cameras on three
rings."""

import pathlib

import numpy as np

from modelling import textures
from modelling.gltf import Gltf
from modelling.shapes import Mesh, box, disc, joined, lathe, tube, turn


def leaf_texture():
    """A sprig: leaflets on both sides of a stem, transparent between them."""
    size = 128
    y, x = np.mgrid[:size, :size] / size
    alpha = np.abs(x - 0.5) < 0.012
    shade = np.zeros((size, size))
    for i in range(9):
        root, side, length = 0.06 + 0.1 * i, 1 if i % 2 else -1, 0.34 - 0.022 * i
        dx, dy = (x - 0.5) * side, root - (y - 1) - 1
        u, v = dx * 0.85 + dy * 0.53, dy * 0.85 - dx * 0.53
        inside = ((u - length / 2) / (length / 2)) ** 2 + (v / 0.05) ** 2 < 1
        alpha |= inside & (dx > 0)
        shade = np.where(inside, 0.5 + 6 * np.abs(v), shade)
    green = textures.mixed((0.12, 0.30, 0.08), (0.45, 0.62, 0.20), np.clip(shade, 0, 1))
    return np.concatenate([green, alpha[..., None].astype(float)], axis=-1)


def paving():
    size = 128
    y, x = np.mgrid[:size, :size] / size
    tile = np.random.default_rng(2).random((4, 4))[np.floor(4 * y).astype(int), np.floor(4 * x).astype(int)]
    grey = textures.mixed((0.50, 0.48, 0.45), (0.72, 0.69, 0.64), 0.6 * tile + 0.4 * textures.noise(size, 8, 3))
    gap = np.minimum((4 * x) % 1, (4 * y) % 1) < 0.06
    return np.where(gap[..., None], 0.25, grey)


def railing(length):
    parts = [tube([(-length / 2, 0.62, 0), (length / 2, 0.62, 0)], 0.018, 8),
             tube([(-length / 2, 0.06, 0), (length / 2, 0.06, 0)], 0.010, 6)]
    count = 15
    for i in range(count):
        x = (i - (count - 1) / 2) * length / (count - 1)
        parts.append(tube([(x, 0, 0), (x, 0.62, 0)], 0.012 if i % 7 == 0 else 0.006, 6))
        if i % 2 == 1:  # a scroll between two bars
            t = np.linspace(0, 2 * np.pi, 21)[:-1]
            parts.append(tube(np.stack([x + 0.035 * np.cos(t), 0.34 + 0.035 * np.sin(t), 0 * t], axis=-1), 0.004, 4, closed=True))
    return joined(parts)


def wheel(radius):
    t = np.linspace(0, 2 * np.pi, 49)[:-1]
    circle = np.stack([np.cos(t), np.sin(t), 0 * t], axis=-1)
    tyre, rim = tube(radius * circle, 0.022, 8, closed=True), tube((radius - 0.03) * circle, 0.008, 5, closed=True)
    spokes = [tube([(0.02 * np.cos(a + 1.2 * s), 0.02 * np.sin(a + 1.2 * s), 0.03 * s),
                    ((radius - 0.03) * np.cos(a), (radius - 0.03) * np.sin(a), 0)], 0.0028, 4)
              for i, a in enumerate(np.linspace(0, 2 * np.pi, 28, endpoint=False)) for s in ((-1, 1)[i % 2],)]
    hub = lathe([(0.0, -0.04), (0.022, -0.04), (0.022, 0.04), (0.0, 0.04)], 12, smooth=False)
    return tyre, joined([rim, *spokes, hub.moved(rotation=turn("x", 90))])


def net(width, height, columns, rows):
    """Diamonds of wire between two posts, sagging a little."""
    wires = []
    for i in range(-rows, columns):
        for direction in (1, -1):
            path = []
            for step in range(rows + 1):
                column = i + step if direction > 0 else columns - 1 - i - step
                if 0 <= column < columns:
                    path.append(((column / (columns - 1) - 0.5) * width, step / rows * height,
                                 0.03 * np.sin(np.pi * column / (columns - 1))))
            if len(path) > 1:
                wires.append(tube(path, 0.0028, 3))
    return joined(wires)


def sprig(length):
    """One card, bent along its length."""
    t = np.linspace(0, 1, 4)
    z, y = length * t, -0.35 * length * t ** 2
    positions = np.concatenate([np.c_[np.full(4, -length / 2.4), y, z], np.c_[np.full(4, length / 2.4), y, z]])
    normal = np.c_[np.zeros(4), np.ones(4), 0.7 * t]
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    uvs = np.concatenate([np.c_[np.zeros(4), 1 - t], np.c_[np.ones(4), 1 - t]])
    i = np.arange(3)
    return Mesh(positions, np.tile(normal, (2, 1)), uvs, np.stack([i, i + 1, i + 4, i + 1, i + 5, i + 4], axis=-1))


def build():
    g = Gltf(sky=((0.55, 0.70, 0.95), (0.85, 0.85, 0.85), (0.30, 0.28, 0.25)))
    stone = g.material(roughness=0.9, texture=g.texture("paving", textures.png(paving())))
    iron = g.material(base=(0.03, 0.035, 0.04), roughness=0.4)
    steel = g.material(base=(0.62, 0.62, 0.64), metallic=1.0, roughness=0.3)
    rubber = g.material(base=(0.02, 0.02, 0.02), roughness=0.8)
    paint = g.material(base=(0.60, 0.05, 0.05), roughness=0.3)
    clay = g.material(base=(0.55, 0.22, 0.12), roughness=0.8)
    copper = g.material(base=(0.80, 0.40, 0.22), metallic=1.0, roughness=0.35)
    leaves = g.material(roughness=0.7, texture=g.texture("sprig", textures.png(leaf_texture())), two_sided=True, cutoff=0.5)

    g.place(g.mesh([(disc(1.25, 56, 0.8), stone),
                    (lathe([(1.2, -0.14), (1.25, -0.1), (1.25, 0.0)], 56, smooth=False), clay)]))
    g.place(g.mesh([(railing(1.7), iron)]), (0, 0, -0.75))
    tyre, metal = wheel(0.32)
    g.place(g.mesh([(tyre, rubber), (metal, steel)]), (-0.35, 0.342, -0.60), turn("y", 8) @ turn("x", -9))
    frame = [tube(p, r, 6) for p, r in (
        ([(0.55, 0, 0.55), (0.55, 0.75, 0.55)], 0.016), ([(-0.55, 0, 0.55), (-0.55, 0.75, 0.55)], 0.016),
        ([(-0.55, 0.75, 0.55), (0.55, 0.75, 0.55)], 0.008))]
    g.place(g.mesh([(joined(frame), paint), (net(1.08, 0.72, 25, 12).moved((0, 0.02, 0.55)), steel)]))
    pot = lathe([(0.0, 0.0), (0.12, 0.0), (0.16, 0.2), (0.18, 0.2), (0.18, 0.24), (0.14, 0.24), (0.14, 0.18), (0.0, 0.18)],
                24, smooth=False)
    g.place(g.mesh([(pot, clay)]), (0.60, 0, -0.25))
    card = g.mesh([(sprig(0.34), leaves)])
    for i in range(16):
        g.place(card, (0.60, 0.20 + 0.006 * i, -0.25), turn("y", 137.5 * i) @ turn("x", -20 - 3.2 * i))
    t = np.linspace(0, 10 * np.pi, 141)
    spring = np.stack([0.13 * np.cos(t), 0.012 + 0.42 * t / t[-1], 0.13 * np.sin(t)], axis=-1)
    g.place(g.mesh([(tube(spring, 0.009, 6), copper)]), (-0.05, 0, 0.05))
    for i in range(3):
        x = np.linspace(-1, 1, 17)
        line = np.stack([0.85 * x, 1.0 - 0.10 * (1 - x ** 2) + 0.05 * i, -0.75 + 0.65 * i * (0.5 + 0.5 * x)], axis=-1)
        g.place(g.mesh([(tube(line, 0.004, 4), rubber)]))
    for x, z in ((-0.85, -0.75), (0.85, -0.75), (0.85, -0.10), (0.85, 0.55)):
        g.place(g.mesh([(tube([(x, 0, z), (x, 1.16, z)], 0.014, 6), iron)]))
    g.sun((0.5, -1.0, -0.6), (2.4, 2.3, 2.1))
    g.rings_of_cameras((0, 0.38, 0), ((16, 2.9, 14), (16, 2.9, 34), (12, 2.8, 56)), 45)
    return g


if __name__ == "__main__":
    build().write(pathlib.Path(__file__).with_suffix(".gltf"))
