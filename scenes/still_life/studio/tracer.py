# SPDX-License-Identifier: Apache-2.0
"""Light transport: an area light, the light of a closed room, one bounce of colour, and reflections."""
from dataclasses import dataclass
from typing import Callable, Optional

import numpy as np

from .shapes import sphere_span
from .vectors import column, cosine_directions, dot, mix, normalize, smoothstep

OFFSET = 1e-3        # secondary rays start this far off the surface
BRIGHTEST = 6.0      # radiance of a sample is cut here, so that one highlight cannot alias a pixel
BOUNCE = 0.42        # light that an occluder is taken to reflect, relative to its colour
MAX_REFLECTIONS = 2


@dataclass
class Material:
    """How a surface answers light."""
    colour: Callable                      # linear albedo at world points
    mean: np.ndarray                      # the albedo's average, for the bounce of colour
    gloss: float = 0.0                    # reflectance at normal incidence of the highlight (GGX); 0: matte
    roughness: float = 0.4                # of the highlight
    mirror: Optional[np.ndarray] = None   # reflectance at normal incidence of sharp reflections, per channel
    bump: Optional[Callable] = None       # (points, normals) to bumped normals
    fade: Optional[Callable] = None       # 1 where the surface turns into the room's wall


@dataclass
class Item:
    """A shape with its material, and the object it is part of."""
    shape: object
    material: Material
    name: str


class AreaLight:
    """A rectangular softbox that shines from `centre` towards `target`."""

    def __init__(self, centre, target, half_width, half_height, radiance):
        self.centre = column(centre)
        self.normal = normalize(column(target) - self.centre)
        self.right = normalize(np.cross(self.normal, column((0, 0, 1)), axis=0)) * half_width
        self.up = normalize(np.cross(self.right, self.normal, axis=0)) * half_height
        self.area = 4.0 * half_width * half_height
        self.radiance = column(radiance)

    def sample(self, uv):
        """Points on the softbox for uniform numbers uv (2, n)."""
        return self.centre + self.right * (2 * uv[0] - 1) + self.up * (2 * uv[1] - 1)

    def seen(self, o, d):
        """How much of the softbox a ray without obstacles sees: 1 on it, 0 beside it, soft at its frame."""
        slope = dot(self.normal, d)
        t = dot(self.normal, self.centre - o) / np.where(slope < -1e-9, slope, -1e-9)
        q = o + t * d - self.centre
        u = np.abs(dot(q, self.right)) / dot(self.right, self.right)
        v = np.abs(dot(q, self.up)) / dot(self.up, self.up)
        edge = smoothstep(1.03, 0.97, np.maximum(u, v))
        return np.where((dot(self.normal, d) < 0) & (t > 0), edge, 0.0)


class Room:
    """The closed backdrop: the inside of a large sphere that glows with a smooth gradient."""

    def __init__(self, centre, radius, low, high, warm, cool):
        self.centre, self.radius = column(centre), radius
        self.low, self.high, self.warm, self.cool = low, high, warm, cool

    def wall(self, p):
        """The wall's glow at points on it."""
        q = (p - self.centre) / self.radius
        tint = mix(self.cool, self.warm, 0.5 + 0.35 * q[0] - 0.35 * q[1])
        return mix(self.low, self.high, smoothstep(-0.35, 0.85, q[2])) * tint

    def glow(self, o, d):
        """What rays that hit nothing see."""
        leave = sphere_span(self.centre, self.radius, o, d)[1]
        return self.wall(o + leave * d)


class Group:
    """Items that stand together, inside a common bounding sphere (None: unbounded)."""

    def __init__(self, items):
        self.items = items
        self.centre = self.radius = None
        if all(item.shape.radius is not None for item in items):
            centres = np.concatenate([item.shape.centre for item in items], axis=1)
            self.centre = (centres.min(axis=1) + centres.max(axis=1)).reshape(3, 1) / 2
            reach = np.linalg.norm(centres - self.centre, axis=0)
            self.radius = max(r + item.shape.radius for r, item in zip(reach, items))

    def candidates(self, o, d, far):
        """Which rays can meet the group closer than `far`."""
        if self.centre is None:
            return np.arange(o.shape[1])
        enter, leave = sphere_span(self.centre, self.radius, o, d)
        return np.flatnonzero((leave > 0) & (enter < far))


class Scene:
    """Everything that is photographed, and how it is lit."""

    def __init__(self, groups, light, room, shiny=True):
        self.groups = [Group(items) for items in groups]
        self.items = [item for items in groups for item in items]
        self.means = np.concatenate([item.material.mean for item in self.items], axis=1)
        self.light, self.room, self.shiny = light, room, shiny

    def nearest(self, o, d, far=np.inf, any_hit=False):
        """Distance and item index of every ray's first hit (inf, -1 for none); any hit will do with any_hit."""
        t = np.broadcast_to(np.asarray(far, dtype=np.float64), o.shape[1:]).copy()
        which = np.full(o.shape[1], -1)
        first = 0
        for group in self.groups:
            ray = group.candidates(o, d, t)
            if any_hit:
                ray = ray[which[ray] < 0]
            if ray.size:
                go, gd, gt, gw = o[:, ray], d[:, ray], t[ray], which[ray]
                for index, item in enumerate(group.items, first):
                    distance = item.shape.intersect(go, gd, gt)
                    closer = distance < gt
                    gt, gw = np.where(closer, distance, gt), np.where(closer, index, gw)
                t[ray], which[ray] = gt, gw
            first += len(group.items)
        return np.where(which >= 0, t, np.inf), which

    def _by_item(self, which):
        """The items among the hits, each with the positions of its hits."""
        for index in np.unique(which):
            yield self.items[index], np.flatnonzero(which == index)

    def surface(self, p, which):
        """Normals, bumped normals, colours, gloss, roughness, mirror reflectance and fade at hit points."""
        count = p.shape[1]
        normal, bumped, colour, mirror = (np.zeros((3, count)) for _ in range(4))
        gloss, roughness, fade = np.zeros(count), np.ones(count), np.zeros(count)
        for item, at in self._by_item(which):
            material, q = item.material, p[:, at]
            n = item.shape.normal(q)
            normal[:, at] = n
            bumped[:, at] = n if material.bump is None else material.bump(q, n)
            colour[:, at] = material.colour(q)
            if self.shiny:
                gloss[at], roughness[at] = material.gloss, material.roughness
                if material.mirror is not None:
                    mirror[:, at] = material.mirror
            if material.fade is not None:
                fade[at] = material.fade(q)
        return normal, bumped, colour, gloss, roughness, mirror, fade

    def _lit(self, p, normal, bumped, colour, gloss, roughness, view, uv):
        """Light that comes straight from the softbox, diffuse and highlight, with soft shadow."""
        to = self.light.sample(uv) - p
        distance = np.sqrt(dot(to, to))
        to = to / distance
        cosine = np.maximum(dot(bumped, to), 0.0)
        falloff = np.maximum(dot(self.light.normal, -to), 0.0) * self.light.area / (distance * distance)
        facing = np.flatnonzero((cosine > 0) & (dot(normal, to) > 0))
        shadow = self.nearest((p + OFFSET * normal)[:, facing], to[:, facing], distance[facing] - 2 * OFFSET, True)[1]
        open_ = np.zeros(p.shape[1])
        open_[facing] = shadow < 0
        highlight = gloss_lobe(bumped, view, to, gloss, roughness)
        return (colour / np.pi + highlight) * self.light.radiance * (open_ * cosine * falloff)

    def _ambient(self, p, normal, bumped, colour, uv):
        """Light of the room, and the colour that occluders throw back."""
        d = cosine_directions(bumped, uv)
        below = dot(d, normal) <= 0
        d = np.where(below, d - 2 * dot(d, normal) * normal, d)
        o = p + OFFSET * normal
        t, which = self.nearest(o, d)
        incoming = self.room.glow(o, d)
        hit = np.flatnonzero(which >= 0)
        incoming[:, hit] = self.means[:, which[hit]] * BOUNCE
        return colour * incoming

    def radiance(self, o, d, light_uv, sky_uv, rng, depth=0):
        """What every ray sees. light_uv and sky_uv are uniform numbers (2, samples, rays)."""
        t, which = self.nearest(o, d)
        result = self.room.glow(o, d)
        if depth:
            seen = self.light.seen(o, d)
            result = mix(result, self.light.radiance, seen)
        hit = np.flatnonzero(which >= 0)
        if hit.size:
            sub = (o[:, hit] + t[hit] * d[:, hit], d[:, hit], which[hit], light_uv[..., hit], sky_uv[..., hit])
            result[:, hit] = self._shade(*sub, rng, depth)
        return np.minimum(result, BRIGHTEST)

    def _shade(self, p, d, which, light_uv, sky_uv, rng, depth):
        """Radiance that leaves hit points against the rays' directions d."""
        normal, bumped, colour, gloss, roughness, mirror, fade = self.surface(p, which)
        total = np.zeros_like(p)
        for k in range(light_uv.shape[1]):
            total += self._lit(p, normal, bumped, colour, gloss, roughness, -d, light_uv[:, k]) / light_uv.shape[1]
        for k in range(sky_uv.shape[1]):
            total += self._ambient(p, normal, bumped, colour, sky_uv[:, k]) / sky_uv.shape[1]
        shiny = np.flatnonzero(mirror[0] > 0)
        if shiny.size:
            total[:, shiny] = self._reflect(p[:, shiny], d[:, shiny], normal[:, shiny], bumped[:, shiny],
                                            mirror[:, shiny], total[:, shiny], rng, depth)
        if fade.any():
            flat = p - self.room.centre
            wall = self.room.wall(self.room.centre + normalize(flat) * self.room.radius)
            total = mix(total, wall, fade)
        return total

    def _reflect(self, p, d, normal, bumped, mirror, base, rng, depth):
        """The surface's own radiance `base` under a sharp reflection (Schlick's Fresnel)."""
        cosine = np.clip(-dot(bumped, d), 0.0, 1.0)
        share = mirror + (1.0 - mirror) * (1.0 - cosine) ** 5
        out = d - 2.0 * dot(d, bumped) * bumped
        sink = np.minimum(dot(out, normal), 0.0)
        out = normalize(out - 1.01 * sink * normal)
        o = p + OFFSET * normal
        if depth + 1 >= MAX_REFLECTIONS:
            seen = self.room.glow(o, out)
        else:
            seen = self.radiance(o, out, rng.random((2, 1, p.shape[1])), rng.random((2, 1, p.shape[1])), rng, depth + 1)
        return base * (1.0 - share.max(axis=0)) + seen * share


def gloss_lobe(n, view, to, gloss, roughness):
    """GGX highlight with Schlick's Fresnel and the Smith-Schlick visibility term."""
    half = normalize(view + to)
    nh, vh = np.maximum(dot(n, half), 0.0), np.maximum(dot(view, half), 0.0)
    nv, nl = np.maximum(dot(n, view), 1e-3), np.maximum(dot(n, to), 1e-3)
    alpha2 = roughness**4
    spread = alpha2 / (np.pi * (nh * nh * (alpha2 - 1.0) + 1.0) ** 2)
    k = roughness * roughness / 2.0
    visibility = 0.25 / ((nv * (1 - k) + k) * (nl * (1 - k) + k))
    fresnel = gloss + (1.0 - gloss) * (1.0 - vh) ** 5
    return np.where(gloss > 0, spread * visibility * fresnel, 0.0)
