#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""orchard.gltf: outdoors. A hut and trees on a meadow, hills far behind, and the sky. Cameras on an arc at the height of the
eyes; one of them has a tree half a metre before it."""

import pathlib

import numpy as np

from modelling import textures
from modelling.gltf import Gltf
from modelling.shapes import Mesh, box, disc, grid_indices, joined, tube, turn

HEIGHT = 1.5  # of the cameras, m


def meadow():
    size = 256
    blades = textures.noise(size, 64, 1, octaves=2)
    green = textures.mixed((0.13, 0.22, 0.05), (0.42, 0.47, 0.16), textures.noise(size, 6, 2) * 0.5 + blades * 0.5)
    flowers = (textures.noise(size, 90, 3, octaves=1) > 0.93)[..., None]
    return np.where(flowers, (0.85, 0.80, 0.55), green)


def planks():
    size = 128
    y, x = np.mgrid[:size, :size] / size
    tone = np.random.default_rng(4).random(8)[np.floor(8 * x).astype(int)]
    wood = textures.mixed((0.30, 0.17, 0.09), (0.55, 0.36, 0.20), 0.6 * tone + 0.4 * textures.noise(size, 16, 5))
    return np.where((((8 * x) % 1) < 0.08)[..., None], 0.08, wood)


def bark():
    size = 128
    rough = textures.noise(size, 12, 6)
    return textures.mixed((0.12, 0.09, 0.07), (0.42, 0.34, 0.27), rough ** 2)


def leaves():
    """A twig's leaves, transparent between them."""
    size = 128
    y, x = np.mgrid[:size, :size] / size
    rng = np.random.default_rng(7)
    alpha, shade = np.zeros((size, size), bool), np.zeros((size, size))
    for _ in range(26):
        cx, cy, angle, long = rng.uniform(0.12, 0.88), rng.uniform(0.12, 0.88), rng.uniform(0, np.pi), rng.uniform(0.07, 0.12)
        u = (x - cx) * np.cos(angle) + (y - cy) * np.sin(angle)
        v = (y - cy) * np.cos(angle) - (x - cx) * np.sin(angle)
        inside = (u / long) ** 2 + (v / (0.45 * long)) ** 2 < 1
        alpha |= inside
        shade = np.where(inside, rng.uniform(0.1, 0.9) + 2 * np.abs(v), shade)
    green = textures.mixed((0.10, 0.24, 0.05), (0.48, 0.60, 0.16), np.clip(shade, 0, 1))
    return np.concatenate([green, alpha[..., None].astype(float)], axis=-1)


def crown(radius, count, seed):
    """Cards at random in a ball, each turned at random."""
    rng = np.random.default_rng(seed)
    cards = []
    for _ in range(count):
        way = rng.normal(size=3)
        place = way / np.linalg.norm(way) * radius * rng.random() ** 0.4 * (1, 0.8, 1)
        axes = turn("y", rng.uniform(0, 360)) @ turn("x", rng.uniform(-70, 70))
        half = 0.5 * rng.uniform(0.5, 0.8)
        corners = np.array([[-half, -half, 0], [half, -half, 0], [half, half, 0], [-half, half, 0]]) @ axes.T + place
        uvs = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float64)
        normals = np.tile(axes[:, 2], (4, 1))
        cards.append(Mesh(corners, normals, uvs, np.array([[0, 1, 2], [0, 2, 3]])))
    return joined(cards)


def hills(distance, seed):
    """A wall around everything, facing inwards, whose top is a line of hills."""
    count = 96
    a = np.linspace(0, 2 * np.pi, count + 1)
    line = np.random.default_rng(seed).random((2, 12)) * 2 * np.pi
    top = 0.11 * distance + sum(distance * 0.045 / (k + 1) * np.sin((k + 2) * a + line[0, k]) for k in range(6))
    levels = np.linspace(0, 1, 5)
    positions = np.stack([np.stack([distance * np.sin(a), -1 + level * (top + 1), distance * np.cos(a)], axis=-1)
                          for level in levels]).reshape(-1, 3)
    inward = -positions * (1, 0, 1) / distance
    uvs = np.stack([np.stack([24 * a / (2 * np.pi), np.full(count + 1, 1 - level)], axis=-1) for level in levels]).reshape(-1, 2)
    return Mesh(positions, inward, uvs, grid_indices(4, count)[::-1])


def build():
    g = Gltf(sky=((0.08, 0.16, 0.36), (0.27, 0.30, 0.33), (0.10, 0.09, 0.07)))
    ground = g.texture("meadow", textures.png(meadow()))
    grass = g.material(texture=ground, diffuse=True)
    wood = g.material(roughness=0.8, texture=g.texture("planks", textures.png(planks())))
    trunk = g.material(texture=g.texture("bark", textures.png(bark())), diffuse=True)
    leaf = g.material(roughness=0.6, texture=g.texture("leaves", textures.png(leaves())), two_sided=True, cutoff=0.5)
    roof = g.material(base=(0.45, 0.12, 0.07), roughness=0.7)
    glass = g.material(base=(0.03, 0.04, 0.05), roughness=0.1)
    far = g.material(base=(0.55, 0.70, 0.75), texture=ground, diffuse=True, two_sided=True)

    g.place(g.mesh([(disc(70, 96, 2.5), grass)]))
    g.place(g.mesh([(hills(60, 8), far)]))
    hut = box((3.0, 2.0, 2.2), 1.2).moved((0, 1.0, 0))
    slope = [box((3.4, 0.10, 1.60)).moved((0, 2.40, side * 0.62), turn("x", side * 33)) for side in (-1, 1)]
    panes = [box((0.6, 0.6, 0.04)).moved((x, 1.2, 1.1)) for x in (-0.9, 0.9)]
    door = box((0.7, 1.5, 0.05)).moved((0, 0.75, 1.1))
    g.place(g.mesh([(hut, wood), (joined(slope), roof), (joined(panes), glass), (door, roof)]), (0, 0, -0.6))

    def tree(x, z, height, radius, seed):
        lean = np.array([(0, 0, 0), (0.05, height * 0.5, 0.03), (0.0, height, 0.08)])
        shape = tube(lean, 0.13, 10)
        g.place(g.mesh([(shape, trunk), (crown(radius, 70, seed).moved((0, height + 0.5 * radius, 0)), leaf)]), (x, 0, z))

    for number, (x, z, height, radius) in enumerate((
            (-3.1, 0.9, 1.5, 1.0), (3.0, 1.4, 1.7, 1.1), (-2.6, -3.4, 2.0, 1.4), (2.7, -3.0, 1.8, 1.3), (-5.5, -1.5, 1.9, 1.3),
            (5.6, -0.6, 1.6, 1.2), (0.4, -5.2, 2.2, 1.5))):
        tree(x, z, height, radius, 10 + number)
    rails = [tube([(-4.5, h, 2.6), (-1.2, h, 2.6)], 0.03, 6) for h in (0.35, 0.7)]
    posts = [tube([(x, 0, 2.6), (x, 0.85, 2.6)], 0.045, 6) for x in np.linspace(-4.5, -1.2, 5)]
    g.place(g.mesh([(joined(rails + posts), trunk)]))

    count, distance = 18, 6.2
    for i in range(count):
        a = np.radians(-55 + 110 * i / (count - 1))
        position = np.array([distance * np.sin(a), HEIGHT + 0.25 * np.sin(2.4 * i), distance * np.cos(a)])
        g.camera(f"view_{i:02}", position, (0, 1.3, 0), 52)
        if i == 7:  # the trunk covers a part of the left of this image
            forward = (np.array([0, 1.3, 0]) - position) * (1, 0, 1)
            forward /= np.linalg.norm(forward)
            left = np.array([forward[2], 0, -forward[0]])
            x, _, z = position + 0.55 * forward + 0.33 * left
            g.place(g.mesh([(tube([(0, 0, 0), (0.02, 1.5, 0), (0, 3.2, 0.05)], 0.09, 10), trunk),
                            (crown(0.9, 50, 30).moved((0, 3.8, 0)), leaf)]), (x, 0, z))
    g.sun((0.5, -1.0, -0.45), (2.9, 2.7, 2.3))
    return g


if __name__ == "__main__":
    build().write(pathlib.Path(__file__).with_suffix(".gltf"))
