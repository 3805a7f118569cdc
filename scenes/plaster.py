#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""plaster.gltf: every surface is diffuse (KHR_materials_specular with a factor of 0), so no colour depends on where it is
seen from, and SH degree 0 holds all there is. No cameras: the dome is used."""

import pathlib

import numpy as np

from modelling import textures
from modelling.gltf import Gltf
from modelling.shapes import Mesh, ball, box, disc, joined, lathe, turn


def terrazzo():
    size = 256
    y, x = np.mgrid[:size, :size]
    rng = np.random.default_rng(1)
    image = np.full((size, size, 3), (0.82, 0.79, 0.74))
    palette = [(0.75, 0.45, 0.35), (0.40, 0.46, 0.42), (0.30, 0.33, 0.38), (0.88, 0.72, 0.50)]
    for _ in range(260):
        cx, cy, r, squash, angle = rng.uniform(0, size, 2).tolist() + [rng.uniform(2, 7), rng.uniform(0.4, 1), rng.uniform(0, 3)]
        dx, dy = (x - cx + size / 2) % size - size / 2, (y - cy + size / 2) % size - size / 2
        u, v = dx * np.cos(angle) + dy * np.sin(angle), dy * np.cos(angle) - dx * np.sin(angle)
        inside = np.maximum(np.abs(u), np.abs(v) / squash) + 0.4 * np.hypot(u, v) < 1.2 * r
        image = np.where(inside[..., None], palette[rng.integers(4)], image)
    return image


def letters():
    """A block's faces: a frame and a bold sign."""
    size = 64
    y, x = np.mgrid[:size, :size] / size
    image = np.full((size, size, 3), (0.92, 0.86, 0.70))
    frame = (np.minimum(np.minimum(x, 1 - x), np.minimum(y, 1 - y)) < 0.09)
    image = np.where(frame[..., None], (0.70, 0.22, 0.18), image)
    sign = ((np.abs(x - 0.32) < 0.07) | (np.abs(x - 0.68) < 0.07) | (np.abs(y - 0.5) < 0.06)) & (np.abs(y - 0.5) < 0.3) & \
        (np.abs(x - 0.5) < 0.25)
    return np.where(sign[..., None], (0.15, 0.28, 0.50), image)


def stairs(steps, width, rise, run):
    return joined([box((width, rise * (i + 1), run)).moved((0, rise * (i + 1) / 2, -run * i)) for i in range(steps)])


def arch(radius, thickness, depth, segments=20):
    a = np.linspace(0, np.pi, segments + 1)
    inner, outer = radius, radius + thickness

    def wall(r, sign):
        p = np.stack([np.cos(a) * r, np.sin(a) * r], axis=-1)
        positions = np.concatenate([np.c_[p, np.full(len(p), -depth / 2)], np.c_[p, np.full(len(p), depth / 2)]])
        normals = np.tile(sign * np.stack([np.cos(a), np.sin(a), 0 * a], axis=-1), (2, 1))
        i = np.arange(segments)
        quads = np.stack([i, i + 1, i + segments + 1, i + 1, i + segments + 2, i + segments + 1], axis=-1).reshape(-1, 3)
        if sign < 0:
            quads = quads[:, ::-1]
        return Mesh(positions, normals, np.zeros((len(positions), 2)), quads)

    def face(z, sign):
        p = np.concatenate([np.c_[np.cos(a) * inner, np.sin(a) * inner], np.c_[np.cos(a) * outer, np.sin(a) * outer]])
        positions = np.c_[p, np.full(len(p), z)]
        i = np.arange(segments)
        quads = np.stack([i, i + segments + 1, i + 1, i + 1, i + segments + 1, i + segments + 2], axis=-1).reshape(-1, 3)
        return Mesh(positions, np.tile([0.0, 0.0, sign], (len(p), 1)), np.zeros((len(p), 2)),
                    quads if sign > 0 else quads[:, ::-1])

    return joined([wall(outer, 1), wall(inner, -1), face(depth / 2, 1.0), face(-depth / 2, -1.0)])


def build():
    g = Gltf(sky=((0.75, 0.80, 0.90), (0.85, 0.83, 0.80), (0.35, 0.32, 0.30)))
    stone = g.material(texture=g.texture("terrazzo", textures.png(terrazzo())), diffuse=True)
    block = g.material(texture=g.texture("block", textures.png(letters())), diffuse=True)
    white, ochre, rose, teal, slate = (g.material(base=c, diffuse=True) for c in (
        (0.80, 0.78, 0.74), (0.70, 0.42, 0.12), (0.66, 0.24, 0.20), (0.10, 0.36, 0.34), (0.16, 0.18, 0.24)))
    g.place(g.mesh([(disc(1.15, 64, 0.7), stone),
                    (lathe([(1.10, -0.15), (1.15, -0.10), (1.15, 0.0)], 64, smooth=False), slate)]))
    g.place(g.mesh([(stairs(5, 0.6, 0.1, 0.13), white)]), (-0.55, 0, 0.1), turn("y", -60))
    g.place(g.mesh([(arch(0.24, 0.12, 0.26), rose), (box((0.12, 0.34, 0.26)).moved((0.30, -0.17, 0)), rose),
                    (box((0.12, 0.34, 0.26)).moved((-0.30, -0.17, 0)), rose)]), (0.30, 0.34, -0.52), turn("y", -20))
    g.place(g.mesh([(ball(0.17, 32, 16), ochre)]), (0.30, 0.17, -0.40))
    g.place(g.mesh([(lathe([(0.24, 0.0), (0.0, 0.55)], 40, smooth=False), teal)]), (0.58, 0, 0.25))
    toy = g.mesh([(box((0.26, 0.26, 0.26)), block)])
    g.place(toy, (0.08, 0.13, 0.52), turn("y", 20))
    g.place(toy, (-0.20, 0.13, 0.62), turn("y", -12))
    g.place(toy, (-0.05, 0.39, 0.56), turn("y", 48))
    g.place(g.mesh([(ball(0.11, 28, 14), slate)]), (0.42, 0.11, 0.66))
    ring = [(0.16 + 0.05 * np.cos(t), 0.05 + 0.05 * np.sin(t)) for t in np.linspace(-np.pi, np.pi, 13)]
    g.place(g.mesh([(lathe(ring, 32), ochre)]), (-0.62, 0, 0.62))
    g.place(g.mesh([(lathe(ring, 32), rose)]), (-0.60, 0.1, 0.60))
    g.place(g.mesh([(lathe(ring, 32), teal)]), (-0.63, 0.2, 0.63))
    g.sun((-0.6, -1.0, -0.5), (1.9, 1.8, 1.6))
    return g


if __name__ == "__main__":
    build().write(pathlib.Path(__file__).with_suffix(".gltf"))
