# SPDX-License-Identifier: Apache-2.0
"""Helpers for arrays of vectors. A batch of n vectors is an array of shape (3, n)."""
import numpy as np


def column(values):
    """A single vector as an array of shape (3, 1), ready to broadcast over a batch."""
    return np.asarray(values, dtype=np.float64).reshape(3, 1)


def dot(a, b):
    """Dot product of every pair of vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def normalize(v):
    """Every vector at unit length."""
    return v / np.sqrt(np.maximum(dot(v, v), 1e-30))


def mix(a, b, weight):
    """Linear blend from a (weight 0) to b (weight 1)."""
    return a + (b - a) * weight


def smoothstep(low, high, x):
    """0 below low, 1 above high and a smooth cubic between them."""
    s = np.clip((x - low) / (high - low), 0.0, 1.0)
    return s * s * (3.0 - 2.0 * s)


def rotation(yaw=0.0, pitch=0.0, roll=0.0):
    """Local-to-world rotation in degrees: roll about x, then pitch about y, then yaw about z."""
    a, b, c = np.radians([yaw, pitch, roll])
    about_z = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    about_y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    about_x = np.array([[1, 0, 0], [0, np.cos(c), -np.sin(c)], [0, np.sin(c), np.cos(c)]])
    return about_z @ about_y @ about_x


def tangents(n):
    """Two unit vectors that complete every unit vector n to an orthonormal basis (Duff et al. 2017)."""
    sign = np.where(n[2] >= 0, 1.0, -1.0)
    a = -1.0 / (sign + n[2])
    b = n[0] * n[1] * a
    first = np.stack([1.0 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]])
    second = np.stack([b, sign + n[1] * n[1] * a, -n[1]])
    return first, second


def cosine_directions(n, uv):
    """Directions about the normals n, distributed as the cosine to them, from uniform numbers uv (2, count)."""
    first, second = tangents(n)
    radius, angle = np.sqrt(uv[0]), 2.0 * np.pi * uv[1]
    height = np.sqrt(np.maximum(1.0 - uv[0], 0.0))
    return first * (radius * np.cos(angle)) + second * (radius * np.sin(angle)) + n * height
