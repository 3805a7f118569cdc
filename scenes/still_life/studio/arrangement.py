# SPDX-License-Identifier: Apache-2.0
"""The still life: what stands on the table, what it is made of, and how it is lit. Lengths in units of about 60 cm."""
import numpy as np

from .shapes import Box, Capsule, Cylinder, Floor, Revolved, Sphere, Torus
from .textures import flat, fractal, gingham, lettering, mottled, noise, rgb, scatter, wood
from .tracer import AreaLight, Item, Material, Room, Scene
from .vectors import column, mix, normalize, rotation, smoothstep

FLOOR = -0.95
CLOTH_TOP = 0.012


def matte(colour, mean, **more):
    """A material without reflections."""
    return Material(colour=colour, mean=mean, **more)


def plain(code, **more):
    """A material of one colour, 0xRRGGBB."""
    return Material(colour=flat(rgb(code)), mean=rgb(code), **more)


def bumps(scale, strength):
    """Normals tilted by the slope of noise."""
    def apply(p, n):
        q, e = p * scale, 0.15
        base = noise(q)
        slope = np.stack([noise(q + column(step)) - base for step in ((e, 0, 0), (0, e, 0), (0, 0, e))]) / e
        return normalize(n - strength * (slope - (slope * n).sum(axis=0) * n))
    return apply


def table():
    """A top of boards on four legs."""
    top = Box((0, 0, -0.035), (1.0, 0.75, 0.035))
    light, dark = rgb(0xC79A63), rgb(0x6E4425)
    boards = Material(lambda p: wood(p, light, dark, 0.25), rgb(0xA0733F), gloss=0.04, roughness=0.42)
    legs = Material(lambda p: wood(p[[2, 0, 1]], light, dark, 0.5), rgb(0x8A5F33), gloss=0.03, roughness=0.5)
    corners = [(x, y) for x in (-0.86, 0.86) for y in (-0.61, 0.61)]
    return [[Item(top, boards, "table")],
            [Item(Cylinder((x, y, FLOOR), 0.035, 0.885, 0.055), legs, "table") for x, y in corners]]


def floor():
    """The ground, which turns into the wall away from the table."""
    shade = rgb(0xB9B2A8)
    fade = lambda p: smoothstep(1.9, 4.9, np.hypot(p[0], p[1]))
    return [[Item(Floor(FLOOR, 5.25), Material(flat(shade), shade, fade=fade), "floor")]]


def cloth():
    """A checked cloth with a plain hem."""
    sheet = Box((-0.36, 0.03, CLOTH_TOP / 2), (0.56, 0.46, CLOTH_TOP / 2), rotation(yaw=14))
    ground, ink = rgb(0xEFE6D6), rgb(0x2F5D8C)

    def colour(p):
        u, v, _ = sheet.local(p)
        hem = np.maximum(np.abs(u) - 0.525, np.abs(v) - 0.425)
        check = gingham(u, v, ground, ink, 0.105)
        return np.where(hem > 0, mix(ground, rgb(0xB8402E), np.abs(hem - 0.012) < 0.006), check)

    return [[Item(sheet, matte(colour, rgb(0x9FB0BE)), "cloth")]]


def apple(base, turn, salt):
    """A red apple with streaks, and its stalk."""
    profile = [(0, 0.022), (0.030, 0.010), (0.062, 0.012), (0.100, 0.060), (0.117, 0.122), (0.100, 0.178),
               (0.060, 0.204), (0.028, 0.196), (0.008, 0.172), (0, 0.168)]
    body = Revolved(base, profile, turn=turn)
    red, yellow = rgb(0xA81C1E), rgb(0xE0B040)

    def colour(p):
        q = body.local(p)
        angle = np.arctan2(q[1], q[0])
        streaks = noise(np.stack([np.cos(angle) * 16 + 20, np.sin(angle) * 16 + 20, q[2] * 9 + salt]))
        blush = 0.5 + 0.5 * np.sin(angle + salt)
        dots = smoothstep(0.80, 0.88, noise(q * 90 + 5))
        return mix(mix(red, yellow, smoothstep(0.45, 1.15, 0.6 * streaks + 0.65 * blush)), yellow, 0.6 * dots)

    up = turn @ column((0, 0, 1))
    start = column(base) + up * 0.165
    stalk = Capsule(start, start + up * 0.07 + column((0.015, 0.01, 0)), 0.008, 0.006)
    return [Item(body, Material(colour, rgb(0xAA3A28), mirror=column((0.04,) * 3)), "apple"),
            Item(stalk, plain(0x4A3320), "apple")]


def orange(centre, radius):
    """An orange with a pored skin."""
    skin = mottled(rgb(0xF08A1C), rgb(0xDA6A0A), 14)
    material = Material(skin, rgb(0xE87A14), gloss=0.05, roughness=0.32, bump=bumps(75.0, 0.22))
    return [Item(Sphere(centre, radius), material, "orange")]


def lemon(base, turn):
    """A lemon, lying."""
    profile = [(0, 0), (0.016, 0.004), (0.024, 0.022), (0.058, 0.050), (0.083, 0.105), (0.080, 0.145), (0.054, 0.196),
               (0.026, 0.224), (0.016, 0.240), (0, 0.246)]
    skin = mottled(rgb(0xF2CF2E), rgb(0xE2B415), 16)
    material = Material(skin, rgb(0xEAC224), gloss=0.05, roughness=0.34, bump=bumps(65.0, 0.18))
    return [Item(Revolved(base, profile, turn=turn), material, "lemon")]


def pear(base, turn):
    """A speckled pear with its stalk."""
    profile = [(0, 0.010), (0.040, 0.004), (0.092, 0.040), (0.112, 0.100), (0.096, 0.160), (0.064, 0.215),
               (0.048, 0.262), (0.030, 0.290), (0, 0.298)]
    body = Revolved(base, profile, turn=turn)
    green, brown = rgb(0xA8B23A), rgb(0x8A6A2A)

    def colour(p):
        q = body.local(p)
        speck = smoothstep(0.72, 0.82, noise(q * 80))
        blush = smoothstep(0.35, 0.75, fractal(q * 7 + 3, 2)) * 0.35
        return mix(mix(green, rgb(0xC9A23A), blush), brown, 0.75 * speck)

    up = turn @ column((0, 0, 1))
    start = column(base) + up * 0.29
    stalk = Capsule(start, start + up * 0.07 + column((0.02, -0.01, 0)), 0.009, 0.006)
    return [Item(body, Material(colour, rgb(0xA8A03A), gloss=0.04, roughness=0.36), "pear"),
            Item(stalk, plain(0x4A3320), "pear")]


def bowl():
    """A glazed bowl on a foot, filled with fruit."""
    x, y, z = -0.36, 0.12, CLOTH_TOP
    profile = [(0, 0.030), (0.110, 0.032), (0.200, 0.065), (0.275, 0.125), (0.318, 0.200)]
    shell = Revolved((x, y, z), profile, thickness=0.012)
    foot = Cylinder((x, y, z), 0.125, 0.03)
    cream, blue = rgb(0xEDE7DA), rgb(0x264E8A)

    def colour(p):
        q = shell.local(p)
        r, angle = np.hypot(q[0], q[1]), np.arctan2(q[1], q[0])
        outside = r > np.interp(q[2], shell.line[:, 1], shell.line[:, 0])
        wave = np.abs(q[2] - 0.135 - 0.022 * np.sin(14 * angle)) < 0.011
        rim = q[2] > 0.192
        foot_ring = np.abs(q[2] - 0.070) < 0.007
        return mix(cream, blue, (rim | (outside & (wave | foot_ring))) * 1.0)

    glaze = Material(colour, rgb(0xC8C8CC), mirror=column((0.045,) * 3))
    fruit = (apple((x - 0.095, y - 0.085, z + 0.090), rotation(yaw=20, pitch=-13, roll=8), 1.0)
             + orange((x + 0.118, y - 0.108, z + 0.186), 0.110)
             + orange((x - 0.102, y + 0.134, z + 0.190), 0.108)
             + pear((x + 0.098, y + 0.074, z + 0.118), rotation(yaw=58, pitch=34)))
    return [[Item(shell, glaze, "bowl"), Item(foot, glaze, "bowl"), *fruit]]


def grapes():
    """A small bunch on the cloth."""
    skin = Material(mottled(rgb(0x4A2450), rgb(0x6E3A5C), 22), rgb(0x55304F), gloss=0.05, roughness=0.22)
    bunch, r = [], 0.046
    for row, count in enumerate((1, 2, 3, 2)):
        for k in range(count):
            bunch.append((row * 0.079, (k - (count - 1) / 2) * 0.091, r))
    bunch += [(0.112, -0.044, 0.118), (0.115, 0.046, 0.116), (0.190, 0.002, 0.120), (0.040, 0.003, 0.112)]
    turn, origin = rotation(yaw=-35), column((-0.50, -0.25, CLOTH_TOP))
    balls = [Item(Sphere(origin + turn @ column(p), r), skin, "grapes") for p in bunch]
    start = origin + turn @ column((0.19, 0.0, 0.16))
    end = origin + turn @ column((0.33, 0.03, 0.055))
    return [balls + [Item(Capsule(start, end, 0.008, 0.010), plain(0x6E6A2E), "grapes")]]


def vase():
    """A tall glazed vase with painted bands and a few berry twigs."""
    x, y = 0.22, 0.46
    profile = [(0, 0.014), (0.085, 0.014), (0.130, 0.075), (0.158, 0.170), (0.146, 0.270), (0.094, 0.365),
               (0.058, 0.440), (0.060, 0.505), (0.092, 0.560)]
    body = Revolved((x, y, 0), profile, thickness=0.011)
    teal, sand, dark = rgb(0x1F7A78), rgb(0xE3D3A8), rgb(0x123C46)

    def colour(p):
        q = body.local(p)
        angle = np.arctan2(q[1], q[0]) / (2 * np.pi)
        zigzag = np.abs(np.mod(12 * angle, 1.0) - 0.5) * 2
        band = np.abs(q[2] - 0.195) < 0.062
        tooth = (q[2] - 0.133) / 0.124 > zigzag
        lines = (np.abs(np.abs(q[2] - 0.195) - 0.075) < 0.007) | (np.abs(q[2] - 0.42) < 0.010)
        glaze = mix(teal, dark, 0.7 * smoothstep(0.3, 0.7, fractal(q * 18, 3)))
        painted = np.where(band, np.where(tooth, sand, dark), glaze)
        return np.where(lines, sand, painted)

    items = [Item(body, Material(colour, rgb(0x4A7A70), mirror=column((0.05,) * 3)), "vase")]
    # The twigs lean on the far side inside and cross in the neck.
    tips = ((-0.17, 0.06, 0.84), (0.14, 0.10, 0.79), (0.04, -0.14, 0.88))
    twigs = [twig((x - 0.7 * dx, y - 0.7 * dy, 0.15), (x + dx, y + dy, z), k) for k, (dx, dy, z) in enumerate(tips)]
    return [items, *twigs]


def twig(start, end, salt):
    """A straight twig with berries on short stalks along its upper part."""
    start, end = np.array(start), np.array(end)
    bark = Material(mottled(rgb(0x5C4326), rgb(0x3B2C1A), 40), rgb(0x4A3620))
    berry = Material(mottled(rgb(0xC4271F), rgb(0xD9541E), 30), rgb(0xC8331F), gloss=0.05, roughness=0.25)
    items = [Item(Capsule(start, end, 0.011, 0.006), bark, "twigs"), Item(Sphere(end, 0.026), berry, "twigs")]
    for k, along in enumerate((0.66, 0.75, 0.84, 0.92)):
        joint = start + (end - start) * along
        angle = 2.4 * (k + 1) + 1.7 * salt
        tip = joint + np.array([0.062 * np.cos(angle), 0.062 * np.sin(angle), 0.035])
        items += [Item(Capsule(joint, tip, 0.005, 0.004), bark, "twigs"), Item(Sphere(tip, 0.025), berry, "twigs")]
    return items


def book(centre, half, yaw, cover, title):
    """A bound book lying flat: two boards, a spine and a block of pages."""
    turn = rotation(yaw=yaw)
    board = 0.009
    place = lambda offset: column(centre) + turn @ column(offset)
    block = Box(place((0.008, 0, 0)), (half[0] - 0.018, half[1] - 0.016, half[2] - board), turn)
    boards = [Box(place((0, 0, side * (half[2] - board / 2))), (half[0], half[1], board / 2), turn) for side in (-1, 1)]
    spine = Box(place((-half[0] + board / 2, 0, 0)), (board / 2, half[1], half[2] - board), turn)

    def pages(p):
        leaf = 0.5 + 0.5 * np.sin(block.local(p)[2] * 2 * np.pi / 0.018)
        return mix(rgb(0xCDBE9F), rgb(0xF1E9D6), leaf)

    def binding(p):
        return cover(turn.T @ (p - column(centre)), half)

    linen = Material(binding, rgb(0x7A4038), gloss=0.03, roughness=0.5)
    paper = Material(pages, rgb(0xDCD0B8))
    return [Item(block, paper, title)] + [Item(part, linen, title) for part in (*boards, spine)]


def red_cover(q, half):
    """Red linen with a cream label that reads STILL LIFE, and EWA on the spine."""
    linen = rgb(0x9C2A26) * (0.85 + 0.3 * noise(q * 95))
    cream, ink = rgb(0xEFE3C4), rgb(0x2A2320)
    # The title is read with the spine at the left: x to the right, y up.
    u, v = q[0] - 0.01, q[1] - 0.07
    label = (np.abs(u) < 0.165) & (np.abs(v) < 0.115)
    frame = label & ((np.abs(u) > 0.150) | (np.abs(v) > 0.100))
    text = lettering(u, v, ("STILL", "LIFE"), 0.0098)
    colour = np.where(label, np.where(frame, rgb(0xC7A24A), mix(cream, ink, text)), linen)
    rule = (np.abs(q[0] - 0.01) < 0.165) & (np.abs(np.abs(q[1] + 0.17) - 0.018) < 0.008)
    colour = np.where(rule, rgb(0xD9B65A), colour)
    on_top = q[2] > half[2] - 0.002
    letters = lettering(-q[1], q[2], ("EWA",), 0.0085)
    on_spine = q[0] < -half[0] + 0.002
    return np.where(on_top, colour, np.where(on_spine, mix(linen, cream, letters), linen))


def green_cover(q, half):
    """Green linen with ochre stripes across spine and boards."""
    linen = rgb(0x2F5B41) * (0.85 + 0.3 * noise(q * 95))
    stripe = (np.abs(np.abs(q[1]) - 0.20) < 0.016) | (np.abs(np.abs(q[1]) - 0.245) < 0.008)
    return np.where(stripe, rgb(0xD9A441), linen)


def books():
    """Two books, one on the other."""
    lower = book((0.61, 0.10, 0.046), (0.225, 0.30, 0.045), -12, green_cover, "green book")
    upper = book((0.60, 0.11, 0.131), (0.200, 0.265, 0.040), 10, red_cover, "red book")
    return [lower + upper]


def mirror_ball():
    """A polished sphere in which the others are reflected."""
    brass = Material(flat(rgb(0x9C8A58)), rgb(0x9C8A58), mirror=column((0.90, 0.67, 0.33)))
    return [[Item(Sphere((0.13, -0.31, 0.18 + CLOTH_TOP), 0.18), brass, "ball")]]


def mug():
    """An enamelled mug with dots and a ring for a handle."""
    x, y = -0.70, 0.56
    profile = [(0, 0.008), (0.095, 0.008), (0.104, 0.017), (0.104, 0.210)]
    body = Revolved((x, y, 0), profile, thickness=0.008, smooth=False)
    turn = rotation(yaw=130)
    hold = column((x, y, 0.112)) + turn @ column((0.118, 0, 0))
    handle = Torus(hold, 0.058, 0.014, turn @ rotation(roll=90), cut=(x, y, 0.106))
    yellow, white, black = rgb(0xE2A62B), rgb(0xF4F0E6), rgb(0x24303C)

    def colour(p):
        q = body.local(p)
        turnaround = np.arctan2(q[1], q[0]) / (2 * np.pi) * 12
        row = np.floor(q[2] / 0.055)
        u = np.mod(turnaround + 0.5 * np.mod(row, 2), 1.0) - 0.5
        v = q[2] / 0.055 - row - 0.5
        dots = u * u + v * v < 0.085
        outside = np.hypot(q[0], q[1]) > 0.104
        painted = np.where(dots, white, yellow)
        return np.where(q[2] > 0.208, black, np.where(outside, painted, white))

    enamel = Material(colour, rgb(0xD8A848), mirror=column((0.045,) * 3))
    ring = plain(0x24303C, mirror=column((0.045,) * 3))
    return [[Item(body, enamel, "mug"), Item(handle, ring, "mug")]]


def ring_cake():
    """An iced ring with sprinkles on a plate."""
    x, y = 0.67, -0.47
    rim = [(0, 0.012), (0.130, 0.012), (0.165, 0.020), (0.215, 0.036)]
    plate = Revolved((x, y, 0), rim, thickness=0.008)
    ring = Torus((x, y, 0.083), 0.098, 0.062)
    icing, dough = rgb(0xE58FA3), rgb(0xB87836)
    sprinkles = np.concatenate([rgb(c) for c in (0xFFFFFF, 0xF6D743, 0x3C9AD1, 0x58B368, 0x7B4BA8)], axis=1)

    def colour(p):
        q = ring.local(p)
        around = np.arctan2(q[1], q[0])
        across = np.arctan2(q[2], np.hypot(q[0], q[1]) - ring.ring)
        edge = -0.016 + 0.014 * np.sin(7 * around) + 0.008 * np.sin(11 * around + 1)
        result = np.where(q[2] > edge, icing, dough * (0.8 + 0.4 * noise(p * 45)))
        u, v = around * 26 / (2 * np.pi), across * 11 / (2 * np.pi)
        i, j = np.floor(u), np.floor(v)
        tilt = 2 * np.pi * scatter(i, j, 1)
        du, dv = (u - i - 0.5) * 0.8, v - j - 0.5
        along, aside = du * np.cos(tilt) + dv * np.sin(tilt), dv * np.cos(tilt) - du * np.sin(tilt)
        grain = (np.abs(along) < 0.34) & (np.abs(aside) < 0.13) & (q[2] > edge + 0.012) & (scatter(i, j, 3) > 0.25)
        return np.where(grain, sprinkles[:, (scatter(i, j, 2) * 4.999).astype(int)], result)

    def plate_colour(p):
        r = np.hypot(*plate.local(p)[:2])
        return mix(rgb(0xEDEBE4), rgb(0x8A2F3C), ((np.abs(r - 0.197) < 0.007) | (np.abs(r - 0.178) < 0.003)) * 1.0)

    china = Material(plate_colour, rgb(0xE0DDD6), mirror=column((0.045,) * 3))
    cake = Material(colour, rgb(0xC08870), gloss=0.05, roughness=0.3)
    return [[Item(plate, china, "plate"), Item(ring, cake, "cake")]]


def toy():
    """A turned wooden cone with painted rings."""
    x, y = -0.36, -0.61
    body = Cylinder((x, y, 0), 0.115, 0.30, 0.018)
    paints = [rgb(c) for c in (0xD8472F, 0xF0E6CE, 0x2F6FA6, 0xF0E6CE, 0xE6A92E)]

    def colour(p):
        level = np.clip((p[2] / 0.0601).astype(int), 0, 4)
        grain = 0.86 + 0.22 * noise((p - column((x, y, 0))) * column((60, 60, 12)))
        return np.concatenate(paints, axis=1)[:, level] * grain

    paint = Material(colour, rgb(0xB08A66), gloss=0.05, roughness=0.3)
    knob = plain(0xD8472F, gloss=0.05, roughness=0.25)
    return [[Item(body, paint, "toy"), Item(Sphere((x, y, 0.315), 0.032), knob, "toy")]]


def still_life(shiny=True):
    """The whole arrangement; without `shiny` nothing reflects or has highlights."""
    groups = (floor() + table() + cloth() + bowl() + books() + vase() + mirror_ball() + grapes() + mug() + ring_cake()
              + toy() + [lemon((-0.01, 0.12, CLOTH_TOP + 0.086), rotation(yaw=-70, pitch=90))])
    light = AreaLight((-2.3, -1.9, 3.4), (0, 0, 0.1), 0.60, 0.60, rgb(0xFFF2DC) * 42.0)
    room = Room((0, 0, 0.5), 5.5, rgb(0x96908C), rgb(0xDDE3EC), column((1.05, 1.0, 0.93)), column((0.93, 0.98, 1.05)))
    return Scene(groups, light, room, shiny)
