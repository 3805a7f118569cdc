# SPDX-License-Identifier: Apache-2.0
"""Splats that a rolling shutter sees, in torch, so that autograd differentiates them.

A splat X is at y(t) = exp(t turn) R X + T + t shift in the camera at the share t of the readout. Its
pixel is at the time of its own row: t = first + slope pixel(y(t)). With its velocity v = dy/dt and
r = d(slope pixel)/dy, a step dy of the splat moves its pixel as (I + k v r^T) dy does for a camera
at rest, k = 1 / (1 - r v). So a camera at rest shows the splat at y, sheared by that matrix, as the
rolling shutter does. check/reference/readout.h has the same formulas.
"""

from enum import IntEnum
from typing import NamedTuple

import torch
from torch import Tensor

from .._native import operators
from ._arguments import check, full_precision, integer, shape, tensor, unavailable
from ._geometry import quat_scale_to_covar_preci, upper_triangle
from ._projection import project

_VIEWS = 8  # steps of Newton's method
_MARGIN = 0.15  # of the image, beyond which the camera is at rest
_LEAST_RATE = 0.1  # of 1 - r v: a splat below almost keeps up with the readout
_MOST_LATE = 1e-3  # what is left of Newton's method


class RollingShutterType(IntEnum):
    """gsplat's names."""

    ROLLING_TOP_TO_BOTTOM = 0
    ROLLING_LEFT_TO_RIGHT = 1
    ROLLING_BOTTOM_TO_TOP = 2
    ROLLING_RIGHT_TO_LEFT = 3
    GLOBAL = 4


def order_of(rolling_shutter, viewmats_rs):
    """The order of the readout, or None with a global shutter."""
    order = RollingShutterType.GLOBAL
    if rolling_shutter is not None:
        number = integer("rolling_shutter", int(rolling_shutter), 0)
        check(number <= 4, f"rolling_shutter {number} is no RollingShutterType")
        order = RollingShutterType(number)
    if order == RollingShutterType.GLOBAL:
        check(viewmats_rs is None, "viewmats_rs needs a rolling_shutter other than GLOBAL")
        return None
    check(viewmats_rs is not None, f"rolling_shutter {order.name} needs viewmats_rs")
    return order


def check_rolling(camera_model, packed, coefficients):
    """Raises the error for what does not go with a rolling shutter."""
    if camera_model != "pinhole":
        raise unavailable(f"rolling_shutter with camera_model {camera_model!r}")
    for name, value in coefficients.items():
        if value is not None:
            raise unavailable(f"rolling_shutter with {name}")
    check(not packed, "rolling_shutter needs packed=False")


class Seen(NamedTuple):
    """What project_rolling returns."""

    prints: tuple  # radii, means2d, depths, conics and compensations: [..., C, N, ...]
    directions: Tensor  # from each camera, at its time, to the splat


def _turn_between(start, end):
    """Axis times angle of the rotation from one view matrix to another."""
    turned = end @ start.transpose(-1, -2)
    axis = 0.5 * torch.stack(
        (
            turned[..., 2, 1] - turned[..., 1, 2],
            turned[..., 0, 2] - turned[..., 2, 0],
            turned[..., 1, 0] - turned[..., 0, 1],
        ),
        -1,
    )
    square = (axis * axis).sum(-1, keepdim=True)
    sine = torch.sqrt(square.clamp(min=1e-12))
    cosine = 0.5 * (turned.diagonal(dim1=-2, dim2=-1).sum(-1, keepdim=True) - 1)
    factor = torch.where(square > 1e-8, torch.atan2(sine, cosine) / sine, 1 + square / 6)
    return axis * factor


def _turned(turn, time, vectors):
    """exp(time turn) vectors. time: [..., 1]."""
    # 1e-20 keeps the root's derivative finite without a turn.
    angle = torch.sqrt((turn * turn).sum(-1, keepdim=True) + 1e-20) * time
    sine = torch.sinc(angle / torch.pi)
    half = torch.sinc(0.5 * angle / torch.pi)
    across = torch.cross(turn.expand_as(vectors), vectors, dim=-1)
    return (
        vectors
        + time * sine * across
        + 0.5
        * (time * half) ** 2
        * torch.cross(turn.expand_as(vectors), across, dim=-1)
    )


class _Readout:
    """The motion of cameras [..., C] during the readout, for splats [..., C, N]."""

    def __init__(self, means, viewmats, ends, Ks, order, width, height):
        rotations = viewmats[..., :3, :3]
        self.turn = _turn_between(rotations, ends[..., :3, :3])[..., None, :]
        self.start = viewmats[..., None, :3, 3]
        self.shift = ends[..., None, :3, 3] - self.start
        self.rotations = rotations[..., None, :, :]
        self.points = (self.rotations @ means[..., None, :, :, None])[..., 0]  # R X
        Ks = Ks[..., None, :, :]
        columns = order in (
            RollingShutterType.ROLLING_LEFT_TO_RIGHT,
            RollingShutterType.ROLLING_RIGHT_TO_LEFT,
        )
        self.axis = 0 if columns else 1
        self.focal, self.center = Ks[..., self.axis, self.axis], Ks[..., self.axis, 2]
        side = max((width if columns else height) - 1, 1)  # the view matrices are of the outer rows
        backward = order in (
            RollingShutterType.ROLLING_BOTTOM_TO_TOP,
            RollingShutterType.ROLLING_RIGHT_TO_LEFT,
        )
        self.slope = (-1.0 if backward else 1.0) / side
        self.first = 1 + 0.5 / side if backward else -0.5 / side

    def at(self, time):
        """Place, velocity, r and the time of the pixel, at times [..., C, N]."""
        time = time[..., None]
        turned = _turned(self.turn, time, self.points)
        place = turned + self.start + time * self.shift
        velocity = torch.cross(self.turn.expand_as(turned), turned, dim=-1) + self.shift
        z = place[..., 2]
        inverse = 1 / torch.where(z > operators.NEAR_PLANE, z, torch.ones_like(z))
        tangent = place[..., self.axis] * inverse
        own = self.first + self.slope * (self.focal * tangent + self.center)
        rate = self.slope * self.focal * inverse
        zero = torch.zeros_like(rate)
        sides = [zero, zero, -rate * tangent]
        sides[self.axis] = rate
        return place, velocity, torch.stack(sides, -1), own

    @torch.no_grad()
    def times(self):
        """The time of each splat's row, the gain k there, whether it is cut off, and whether there is one."""
        time = torch.full_like(self.points[..., 0], 0.5)
        for _ in range(_VIEWS):
            place, velocity, row, own = self.at(time)
            cut = own.clamp(-_MARGIN, 1 + _MARGIN)
            free = cut == own
            rate = 1 - torch.where(free, (row * velocity).sum(-1), torch.zeros_like(own))
            late = cut - time
            shown = (place[..., 2] > operators.NEAR_PLANE) & (rate >= _LEAST_RATE)
            last = time
            time = (time + late / rate.clamp(min=_LEAST_RATE)).clamp(-_MARGIN, 1 + _MARGIN)
        return last, 1 / rate.clamp(min=_LEAST_RATE), free, shown & (late.abs() <= _MOST_LATE)


@full_precision
def project_rolling(tensors, viewmats_rs, order, options, width, height):
    """The footprints of checked tensors through the rolling shutters of cameras [..., C]."""
    means, quats, scales, covars, viewmats, opacities, Ks = tensors
    ends = tensor("viewmats_rs", viewmats_rs)
    shape("viewmats_rs", ends, viewmats.shape)
    if covars is None:
        covars = quat_scale_to_covar_preci(quats, scales, compute_preci=False)[0]
    else:
        covars = covars[..., [0, 1, 2, 1, 3, 4, 2, 4, 5]].unflatten(-1, (3, 3))
    # What is not finite is not shown, and spoils no camera's gradient.
    finite = means.isfinite().all(-1) & covars.flatten(-2).isfinite().all(-1)
    means = torch.where(finite[..., None], means, torch.zeros_like(means))
    covars = torch.where(finite[..., None, None], covars, torch.zeros_like(covars))
    readout = _Readout(means, viewmats, ends, Ks, order, width, height)
    time, gain, free, shown = readout.times()
    shown = shown & finite[..., None, :]
    # One more step of Newton's method has the derivative of the time.
    own = readout.at(time)[3]
    time = torch.where(free, time + gain * (own - time), time)
    place, velocity, row, _ = readout.at(time)
    row = torch.where(free[..., None], row, torch.zeros_like(row))
    rate = 1 - (row * velocity).sum(-1)
    rate = torch.where(shown, rate, torch.ones_like(rate))
    eye = torch.eye(3, dtype=means.dtype)
    sheared = eye + (velocity / rate[..., None])[..., :, None] * row[..., None, :]
    axes = readout.rotations.expand(place.shape + (3,)).transpose(-1, -2)
    axes = torch.stack(
        [_turned(readout.turn, time[..., None], axes[..., k, :]) for k in range(3)], -1
    )
    moved = sheared @ axes
    covars = upper_triangle(moved @ covars[..., None, :, :, :] @ moved.transpose(-1, -2))
    behind = torch.tensor([0.0, 0.0, -1.0])
    place = torch.where(shown[..., None], place, behind)
    covars = torch.where(shown[..., None], covars, torch.zeros_like(covars))
    still = torch.eye(4).expand(viewmats.shape[:-2] + (1, 4, 4))
    spread = opacities[..., None, :].expand(place.shape[:-1])
    prints = project(
        (place, None, None, covars, still, spread, Ks[..., None, :, :]), options, False, False
    )
    prints = tuple(None if p is None else p.squeeze(place.dim() - 2) for p in prints)
    directions = (axes.transpose(-1, -2) @ place[..., None])[..., 0]
    return Seen(prints, directions)
