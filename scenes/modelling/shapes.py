# SPDX-License-Identifier: Apache-2.0
"""Triangle meshes: positions, normals and texture coordinates per vertex, and vertex indices, three a triangle."""

import numpy as np


class Mesh:
    def __init__(self, positions, normals, uvs, indices):
        self.positions = np.asarray(positions, np.float64).reshape(-1, 3)
        self.normals = np.asarray(normals, np.float64).reshape(-1, 3)
        self.uvs = np.asarray(uvs, np.float64).reshape(-1, 2)
        self.indices = np.asarray(indices, np.int64).ravel()

    def moved(self, offset=(0, 0, 0), rotation=None, scale=1.0):
        """rotation: 3 x 3, applied after the uniform scale."""
        r = np.eye(3) if rotation is None else np.asarray(rotation, np.float64)
        return Mesh(self.positions * scale @ r.T + np.asarray(offset, np.float64), self.normals @ r.T, self.uvs,
                    self.indices)


def joined(meshes):
    first, indices = 0, []
    for mesh in meshes:
        indices.append(mesh.indices + first)
        first += len(mesh.positions)
    return Mesh(np.concatenate([m.positions for m in meshes]), np.concatenate([m.normals for m in meshes]),
                np.concatenate([m.uvs for m in meshes]), np.concatenate(indices))


def turn(axis, degrees):
    """Rotation about "x", "y" or "z"."""
    a = np.radians(degrees)
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    r = np.eye(3)
    r[i, i] = r[j, j] = np.cos(a)
    r[i, j], r[j, i] = -np.sin(a), np.sin(a)
    return r


def grid_indices(rows, columns):
    """Quads of a (rows + 1) x (columns + 1) grid of vertices, row after row."""
    r, c = np.mgrid[:rows, :columns]
    a = (r * (columns + 1) + c).ravel()
    b, d = a + 1, a + columns + 1
    return np.stack([a, b, d, b, d + 1, d], axis=-1).ravel()


def box(size, texture_scale=None):
    """Centred; each face has the whole texture, or one repeat every `texture_scale`."""
    half = np.asarray(size, np.float64) / 2
    faces = []
    for axis in range(3):
        for sign in (-1, 1):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            corners = np.zeros((4, 3))
            corners[:, axis] = sign * half[axis]
            corners[:, u] = np.array([-1, 1, 1, -1]) * half[u] * sign
            corners[:, v] = np.array([-1, -1, 1, 1]) * half[v]
            normal = np.zeros(3)
            normal[axis] = sign
            uv = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float64)
            if texture_scale:
                uv *= np.array([2 * half[u], 2 * half[v]]) / texture_scale
            faces.append(Mesh(corners, np.tile(normal, (4, 1)), uv, [0, 1, 2, 0, 2, 3]))
    return joined(faces)


def lathe(profile, segments=32, smooth=True):
    """Turns (radius, height) points, from bottom to top on the outside, about y."""
    profile = np.asarray(profile, np.float64)
    if not smooth:  # each stretch has its own normals
        return joined([lathe(profile[i:i + 2], segments) for i in range(len(profile) - 1)])
    tangent = np.gradient(profile, axis=0)
    slope = np.stack([tangent[:, 1], -tangent[:, 0]], axis=-1)
    slope /= np.maximum(np.linalg.norm(slope, axis=-1, keepdims=True), 1e-12)
    a = np.linspace(0, 2 * np.pi, segments + 1)
    ring = np.stack([np.sin(a), np.zeros_like(a), np.cos(a)], axis=-1)
    up = np.array([0.0, 1.0, 0.0])
    positions = profile[:, None, :1] * ring + profile[:, None, 1:] * up
    normals = slope[:, None, :1] * ring + slope[:, None, 1:] * up
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(profile, axis=0), axis=-1))])
    uvs = np.stack(np.broadcast_arrays(a / (2 * np.pi), 1 - (along / max(along[-1], 1e-12))[:, None]), axis=-1)
    return Mesh(positions, normals, uvs, grid_indices(len(profile) - 1, segments))


def ball(radius, segments=32, rings=16):
    a = np.linspace(-np.pi / 2, np.pi / 2, rings + 1)
    return lathe(np.stack([radius * np.cos(a), radius * np.sin(a)], axis=-1), segments)


def disc(radius, segments=48, texture_scale=1.0):
    """Flat, facing up; texture coordinates are x and z over texture_scale."""
    a = np.linspace(0, 2 * np.pi, segments + 1)
    rim = radius * np.stack([np.sin(a), np.zeros_like(a), np.cos(a)], axis=-1)
    positions = np.concatenate([[[0.0, 0.0, 0.0]], rim])
    i = np.arange(1, segments + 1)
    return Mesh(positions, np.tile([0.0, 1.0, 0.0], (len(positions), 1)), positions[:, [0, 2]] / texture_scale,
                np.stack([np.zeros_like(i), i, i + 1], axis=-1))


def tube(path, radius, sides=6, closed=False):
    """Round wire along points; parallel transport keeps it from twisting."""
    path = np.asarray(path, np.float64)
    if closed:
        path = np.concatenate([path, path[:1]])
    tangents = np.gradient(path, axis=0)
    if closed:
        tangents[0] = tangents[-1] = path[1] - path[-2]
    tangents /= np.linalg.norm(tangents, axis=-1, keepdims=True)
    side = np.cross(tangents[0], [0.0, 1.0, 0.0] if abs(tangents[0, 1]) < 0.9 else [1.0, 0.0, 0.0])
    a = np.linspace(0, 2 * np.pi, sides + 1)
    positions, normals = [], []
    for point, tangent in zip(path, tangents):
        side = side - np.dot(side, tangent) * tangent
        side /= np.linalg.norm(side)
        normal = np.cos(a)[:, None] * side + np.sin(a)[:, None] * np.cross(tangent, side)
        positions.append(point + radius * normal)
        normals.append(normal)
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=-1))])
    uvs = np.stack(np.broadcast_arrays(along[:, None], a / (2 * np.pi)), axis=-1)
    return Mesh(positions, normals, uvs, grid_indices(len(path) - 1, sides))


def leaf(length, width, droop=0.3, parts=4):
    """From the origin along z, curved downwards; both sides are seen where the material says so."""
    t = np.linspace(0, 1, parts + 1)
    half = width / 2 * np.sin(np.pi * np.clip(t, 0.02, 0.98)) ** 0.7
    spine = np.stack([np.zeros_like(t), -droop * length * t ** 2, length * t], axis=-1)
    across = np.array([1.0, 0.0, 0.0])
    positions = np.stack([spine - half[:, None] * across, spine + half[:, None] * across], axis=1)
    normal = np.stack([np.zeros_like(t), np.ones_like(t), 2 * droop * t], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    uvs = np.stack([np.broadcast_to([0.0, 1.0], (parts + 1, 2)), np.repeat(t[:, None], 2, axis=1)], axis=-1)
    mesh = Mesh(positions, np.repeat(normal[:, None], 2, axis=1), uvs, grid_indices(parts, 1))
    mesh.indices = mesh.indices.reshape(-1, 3)[:, ::-1].ravel()
    return mesh
