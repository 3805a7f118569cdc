# SPDX-License-Identifier: Apache-2.0
"""The shapes that rays can hit.

Every shape has `centre` and `radius`, a sphere that holds it (None: unbounded), `intersect`, which returns the distance
along every ray (inf for a miss), and `normal` at points on its surface.
"""
import numpy as np

from .vectors import column, dot, normalize

NEAR = 1e-6       # hits closer than this are the ray's own origin
TOLERANCE = 2e-4  # sphere tracing stops at this distance from the surface
MAX_STEPS = 96


def sphere_span(centre, radius, o, d):
    """Where every ray enters and leaves a sphere; (inf, -inf) where it does not meet it."""
    oc = o - centre
    b = dot(oc, d)
    disc = b * b - dot(oc, oc) + radius * radius
    root = np.sqrt(np.maximum(disc, 0.0))
    meets = disc > 0
    return np.where(meets, -b - root, np.inf), np.where(meets, root - b, -np.inf)


class Sphere:
    """A sphere, in closed form."""

    def __init__(self, centre, radius):
        self.centre, self.radius = column(centre), radius

    def intersect(self, o, d, far):
        enter, leave = sphere_span(self.centre, self.radius, o, d)
        t = np.where(enter > NEAR, enter, leave)
        return np.where(t > NEAR, t, np.inf)

    def normal(self, p):
        return (p - self.centre) / self.radius


class Floor:
    """A horizontal disc of radius `reach` at a height, seen from above."""

    centre = radius = None

    def __init__(self, height, reach):
        self.height, self.reach = height, reach

    def intersect(self, o, d, far):
        t = (self.height - o[2]) / np.where(d[2] < -1e-9, d[2], -1e-9)
        x, y = o[0] + t * d[0], o[1] + t * d[1]
        return np.where((d[2] < -1e-9) & (t > NEAR) & (x * x + y * y < self.reach**2), t, np.inf)

    def normal(self, p):
        return np.broadcast_to(column((0, 0, 1)), p.shape).copy()


class Box:
    """A box of half sizes `half`, turned by `turn` (local to world)."""

    def __init__(self, centre, half, turn=np.eye(3)):
        self.centre, self.half, self.turn = column(centre), column(half), turn
        self.radius = float(np.linalg.norm(half))

    def local(self, p):
        """World points in the box's own axes, from its centre."""
        return self.turn.T @ (p - self.centre)

    def intersect(self, o, d, far):
        lo, ld = self.local(o), self.turn.T @ d
        inverse = 1.0 / np.where(np.abs(ld) < 1e-12, 1e-12, ld)
        middle, reach = -lo * inverse, np.abs(inverse) * self.half
        enter, leave = (middle - reach).max(axis=0), (middle + reach).min(axis=0)
        t = np.where(enter > NEAR, enter, leave)
        return np.where((enter < leave) & (t > NEAR), t, np.inf)

    def normal(self, p):
        local = self.local(p)
        axis = np.argmax(np.abs(local) - self.half, axis=0)
        columns = np.arange(p.shape[1])
        n = np.zeros_like(local)
        n[axis, columns] = np.sign(local[axis, columns])
        return self.turn @ n


class Cylinder:
    """An upright cylinder with both caps, in closed form; `top_radius` makes it a cone's frustum."""

    def __init__(self, base, radius, height, top_radius=None):
        self.base, self.height = column(base), height
        self.bottom, self.top = radius, radius if top_radius is None else top_radius
        self.slope = (self.top - self.bottom) / height
        self.centre = self.base + column((0, 0, height / 2))
        self.radius = float(np.hypot(max(self.bottom, self.top), height / 2))

    def intersect(self, o, d, far):
        o = o - self.base
        rim, rate = self.bottom + self.slope * o[2], self.slope * d[2]
        a = d[0] * d[0] + d[1] * d[1] - rate * rate
        a = np.where(np.abs(a) < 1e-12, 1e-12, a)
        b = o[0] * d[0] + o[1] * d[1] - rim * rate
        disc = b * b - a * (o[0] * o[0] + o[1] * o[1] - rim * rim)
        root = np.sqrt(np.maximum(disc, 0.0))
        best = np.full(o.shape[1], np.inf)
        for t in ((-b - root) / a, (root - b) / a):
            z = o[2] + t * d[2]
            fits = (disc > 0) & (t > NEAR) & (z > 0) & (z < self.height)
            best = np.where(fits & (t < best), t, best)
        fall = np.where(np.abs(d[2]) < 1e-12, 1e-12, d[2])
        for level, radius in ((0.0, self.bottom), (self.height, self.top)):
            t = (level - o[2]) / fall
            x, y = o[0] + t * d[0], o[1] + t * d[1]
            fits = (t > NEAR) & (x * x + y * y < radius * radius)
            best = np.where(fits & (t < best), t, best)
        return best

    def normal(self, p):
        q = p - self.base
        side = normalize(np.stack([q[0], q[1], -self.slope * np.hypot(q[0], q[1])]))
        cap = np.zeros_like(q)
        cap[2] = np.where(q[2] > self.height / 2, 1.0, -1.0)
        gap_side = np.abs(np.hypot(q[0], q[1]) - self.bottom - self.slope * q[2])
        gap_cap = np.minimum(np.abs(q[2]), np.abs(q[2] - self.height))
        return np.where(gap_cap < gap_side, cap, side)


class Traced:
    """A shape given by its signed distance, found by sphere tracing inside its bounding sphere."""

    def intersect(self, o, d, far):
        enter, leave = sphere_span(self.centre, self.radius, o, d)
        result = np.full(o.shape[1], np.inf)
        ray = np.flatnonzero((leave > 0) & (enter < far))
        o, d, leave = o[:, ray], d[:, ray], np.minimum(leave, far)[ray]
        t = np.maximum(enter[ray], 0.0)
        for _ in range(MAX_STEPS):
            if not ray.size:
                break
            gap = self.distance(o + t * d)
            hit = gap < TOLERANCE
            result[ray[hit]] = np.maximum(t[hit], 2 * NEAR)
            t = t + gap
            going = ~hit & (t < leave)
            ray, o, d, t, leave = ray[going], o[:, going], d[:, going], t[going], leave[going]
        return result


class Torus(Traced):
    """A ring of radius `ring` and thickness `tube` about the local z axis.

    `cut` = (x, y, radius) takes away what lies inside an upright cylinder in the world.
    """

    def __init__(self, centre, ring, tube, turn=np.eye(3), cut=None):
        self.centre, self.ring, self.tube, self.turn, self.cut = column(centre), ring, tube, turn, cut
        self.radius = ring + tube + 0.005

    def local(self, p):
        """World points in the ring's own axes."""
        return self.turn.T @ (p - self.centre)

    def distance(self, p):
        q = self.local(p)
        gap = np.hypot(np.hypot(q[0], q[1]) - self.ring, q[2]) - self.tube
        if self.cut is not None:
            gap = np.maximum(gap, self.cut[2] - np.hypot(p[0] - self.cut[0], p[1] - self.cut[1]))
        return gap

    def normal(self, p):
        q = self.local(p)
        shrink = 1.0 - self.ring / np.maximum(np.hypot(q[0], q[1]), 1e-9)
        return self.turn @ normalize(np.stack([q[0] * shrink, q[1] * shrink, q[2]]))


class Capsule(Traced):
    """A straight rod with round ends whose thickness runs from `thick` to `thin`."""

    def __init__(self, start, end, thick, thin):
        self.start, self.along = column(start), column(end) - column(start)
        self.thick, self.thin = thick, thin
        self.centre = self.start + self.along / 2
        self.radius = float(np.linalg.norm(self.along)) / 2 + thick + 0.005

    def axis(self, p):
        """For every point, the vector from the rod's axis and the position along it, 0 to 1."""
        q = p - self.start
        s = np.clip(dot(q, self.along) / dot(self.along, self.along), 0.0, 1.0)
        return q - s * self.along, s

    def distance(self, p):
        away, s = self.axis(p)
        return np.sqrt(dot(away, away)) - (self.thick + (self.thin - self.thick) * s)

    def normal(self, p):
        return normalize(self.axis(p)[0])


def smooth_curve(knots, pieces=8):
    """Catmull-Rom curve through the knots as a polyline."""
    knots = np.asarray(knots, dtype=np.float64)
    ends = np.concatenate([[2 * knots[0] - knots[1]], knots, [2 * knots[-1] - knots[-2]]])
    s = np.linspace(0.0, 1.0, pieces, endpoint=False)[:, None]
    line = [0.5 * (2 * b + (c - a) * s + (2 * a - 5 * b + 4 * c - d) * s**2 + (3 * b - a - 3 * c + d) * s**3)
            for a, b, c, d in zip(ends, ends[1:], ends[2:], ends[3:])]
    return np.concatenate(line + [knots[-1:]])


class Revolved(Traced):
    """A profile of (distance from the axis, height) turned about the local z axis.

    With `thickness` the profile is a shell (a vase, a bowl), without it the profile runs from axis to axis and bounds a
    solid (a fruit). The signed distance is tabulated once over the half plane and interpolated.
    """

    CELLS = 320

    def __init__(self, base, profile, thickness=0.0, turn=np.eye(3), smooth=True):
        line = smooth_curve(profile) if smooth else np.asarray(profile, dtype=np.float64)
        line[:, 0] = np.maximum(line[:, 0], 0.0)
        self.turn, self.base, self.line = turn, column(base), line
        middle = (line[:, 1].min() + line[:, 1].max()) / 2
        self.radius = float(np.hypot(line[:, 0], line[:, 1] - middle).max()) + thickness + 0.01
        self.bottom = middle - self.radius
        self.centre = self.base + turn @ column((0, 0, middle))
        self.step = self.radius / self.CELLS
        self._tabulate(line, thickness)

    def _tabulate(self, line, thickness):
        """Distances at the nodes of a grid over the half plane, and their gradients."""
        cells = self.CELLS
        r, z = np.meshgrid(np.arange(cells + 2) * self.step, self.bottom + np.arange(2 * cells + 2) * self.step,
                           indexing="ij")
        nearest, inside = np.full(r.shape, np.inf), np.zeros(r.shape, dtype=bool)
        for (r0, z0), (r1, z1) in zip(line, line[1:]):
            dr, dz = r1 - r0, z1 - z0
            length = dr * dr + dz * dz
            if length < 1e-14:
                continue
            s = np.clip(((r - r0) * dr + (z - z0) * dz) / length, 0.0, 1.0)
            nearest = np.minimum(nearest, np.hypot(r - r0 - s * dr, z - z0 - s * dz))
            if dz != 0:
                crosses = (z0 > z) != (z1 > z)
                inside ^= crosses & (r < r0 + (z - z0) / dz * dr)
        table = nearest - thickness if thickness else np.where(inside, -nearest, nearest)
        slope_r, slope_z = np.gradient(table, self.step)
        self.table = np.ascontiguousarray(table).ravel()
        self.slopes = slope_r.ravel(), slope_z.ravel()
        self.stride = table.shape[1]

    def local(self, p):
        """World points in the shape's own axes, from its base."""
        return self.turn.T @ (p - self.base)

    def _interpolate(self, tables, q):
        """Bilinear values of the tables at local points."""
        r = np.clip(np.hypot(q[0], q[1]) / self.step, 0.0, self.CELLS)
        z = np.clip((q[2] - self.bottom) / self.step, 0.0, 2 * self.CELLS)
        i, j = r.astype(np.int64), z.astype(np.int64)
        r, z, k = r - i, z - j, i * self.stride + j
        near, far = (1 - r), r
        low, high = (1 - z), z
        return [near * (low * f[k] + high * f[k + 1]) + far * (low * f[k + self.stride] + high * f[k + self.stride + 1])
                for f in tables]

    def distance(self, p):
        return self._interpolate([self.table], self.local(p))[0]

    def normal(self, p):
        q = self.local(p)
        slope_r, slope_z = self._interpolate(self.slopes, q)
        r = np.maximum(np.hypot(q[0], q[1]), 1e-9)
        return self.turn @ normalize(np.stack([slope_r * q[0] / r, slope_r * q[1] / r, slope_z]))
