# SPDX-License-Identifier: Apache-2.0
"""Procedural colour: noise, wood, cloth, lettering. Colours are linear RGB; functions take points of shape (3, n)."""
import numpy as np

from .vectors import column, mix, smoothstep

_LATTICE = np.random.default_rng(20240229).random(64 * 64 * 64)

GLYPHS = {
    "A": "01110 10001 10001 11111 10001 10001 10001",
    "E": "11111 10000 10000 11110 10000 10000 11111",
    "F": "11111 10000 10000 11110 10000 10000 10000",
    "I": "11111 00100 00100 00100 00100 00100 11111",
    "L": "10000 10000 10000 10000 10000 10000 11111",
    "S": "01111 10000 10000 01110 00001 00001 11110",
    "T": "11111 00100 00100 00100 00100 00100 00100",
    "W": "10001 10001 10001 10101 10101 11011 10001",
}


def rgb(code):
    """A colour written as 0xRRGGBB in sRGB, as a linear column vector."""
    c = np.array([(code >> 16) & 255, (code >> 8) & 255, code & 255]) / 255.0
    return column(np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4))


def noise(p):
    """Smooth value noise with unit cells, 0 to 1, of period 64."""
    cell = np.floor(p)
    f = p - cell
    f = f * f * (3.0 - 2.0 * f)
    low = cell.astype(np.int64) & 63
    high = (low + 1) & 63
    x0, x1 = low[0] << 12, high[0] << 12
    y0, y1 = low[1] << 6, high[1] << 6
    z0, z1 = low[2], high[2]
    bottom = mix(mix(_LATTICE[x0 | y0 | z0], _LATTICE[x1 | y0 | z0], f[0]),
                 mix(_LATTICE[x0 | y1 | z0], _LATTICE[x1 | y1 | z0], f[0]), f[1])
    top = mix(mix(_LATTICE[x0 | y0 | z1], _LATTICE[x1 | y0 | z1], f[0]),
              mix(_LATTICE[x0 | y1 | z1], _LATTICE[x1 | y1 | z1], f[0]), f[1])
    return mix(bottom, top, f[2])


def fractal(p, octaves):
    """Sum of noise octaves, scaled to 0 to 1."""
    total, weight = np.zeros(p.shape[1]), 0.0
    for octave in range(octaves):
        total += noise(p * 2.0**octave + 11.3 * octave) * 0.5**octave
        weight += 0.5**octave
    return total / weight


def scatter(a, b, salt):
    """A uniform number for every pair of integers a, b."""
    return _LATTICE[((a.astype(np.int64) * 73 + salt * 911) & 511) * 512 + ((b.astype(np.int64) * 151 + salt) & 511)]


def flat(colour):
    """One colour everywhere."""
    return lambda p: np.broadcast_to(colour, p.shape).copy()


def mottled(first, second, scale, octaves=3):
    """A cloudy blend of two colours."""
    return lambda p: mix(first, second, smoothstep(0.25, 0.75, fractal(p * scale, octaves)))


def wood(p, light, dark, board):
    """Boards along x, `board` wide, with rings, fine grain and dark joints. p is in the wood's own axes."""
    row = np.floor(p[1] / board)
    shift = scatter(row, row * 0, 3)
    q = np.stack([p[0] + 7.0 * shift, p[1] + 3.0 * shift, p[2] + shift])
    warp = fractal(q * column((1.6, 7.0, 7.0)), 3)
    rings = 0.5 + 0.5 * np.sin(2 * np.pi * (q[1] * 9.0 + 5.0 * warp))
    fibres = noise(q * column((9.0, 110.0, 60.0)))
    tone = 0.50 * rings * rings + 0.38 * fibres + 0.30 * (shift - 0.5) + 0.10
    joint = np.abs(p[1] / board - row - 0.5) > 0.5 - 0.0045 / board
    return mix(light, dark, np.clip(tone, 0, 1)) * np.where(joint, 0.25, 1.0)


def gingham(u, v, ground, ink, period):
    """A woven check: bands of ink across bands of ink, with the threads showing."""
    def bands(x):
        return (np.mod(x / period, 1.0) < 0.5) * 1.0
    def threads(x):
        return np.sin(2 * np.pi * x / 0.022)
    warp, weft = bands(u), bands(v)
    over = 0.5 + 0.5 * threads(u) * threads(v)
    cover = mix(warp, weft, 0.3 + 0.4 * over)
    return mix(ground, ink, cover) * (0.86 + 0.14 * over)


def lettering(u, v, lines, cell):
    """1 inside the letters of the centred lines of text, else 0; u to the right, v up, `cell` the size of a dot."""
    height = 9 * len(lines) - 2
    ink = np.zeros(u.shape)
    for index, text in enumerate(lines):
        width = 6 * len(text) - 1
        bitmap = np.zeros((7, width))
        for place, letter in enumerate(text):
            rows = GLYPHS[letter].split()
            bitmap[:, 6 * place:6 * place + 5] = [[int(dot) for dot in row] for row in rows]
        x = np.floor(u / cell + width / 2).astype(np.int64)
        y = np.floor(height / 2 - v / cell).astype(np.int64) - 9 * index
        inside = (x >= 0) & (x < width) & (y >= 0) & (y < 7)
        ink[inside] = bitmap[y[inside], x[inside]]
    return ink
