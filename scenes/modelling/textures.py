# SPDX-License-Identifier: Apache-2.0
"""Pictures for textures, as arrays of sRGB values in 0..1, and the PNG files they go into."""

import struct
import zlib

import numpy as np


def noise(size, cells, seed, octaves=4):
    """Smooth noise in 0..1 that repeats at the borders."""
    rng = np.random.default_rng(seed)
    total, weight = np.zeros((size, size)), 0.0
    for octave in range(octaves):
        n = cells * 2 ** octave
        lattice = rng.random((n, n))
        at = np.arange(size) * n / size
        i, f = np.floor(at).astype(int) % n, at % 1.0
        f = f * f * (3 - 2 * f)
        rows = lattice[i] * (1 - f)[:, None] + lattice[(i + 1) % n] * f[:, None]
        total += (rows[:, i] * (1 - f) + rows[:, (i + 1) % n] * f) / 2 ** octave
        weight += 1 / 2 ** octave
    return total / weight


def mixed(a, b, t):
    return np.asarray(a) * (1 - t[..., None]) + np.asarray(b) * t[..., None]


def png(pixels):
    """8 bits a channel; grey, RGB or RGBA."""
    values = np.clip(np.round(np.asarray(pixels) * 255), 0, 255).astype(np.uint8)
    if values.ndim == 2:
        values = values[..., None]
    height, width, channels = values.shape
    kind = {1: 0, 3: 2, 4: 6}[channels]
    # Each row as its difference from the one above: smooth pictures pack well so.
    rows = np.concatenate([np.zeros((1, width * channels), np.uint8), values.reshape(height, -1)])
    filtered = np.concatenate([np.full((height, 1), 2, np.uint8), rows[1:] - rows[:-1]], axis=1)

    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, kind, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(filtered.tobytes(), 9)) + chunk(b"IEND", b""))
