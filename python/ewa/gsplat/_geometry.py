# SPDX-License-Identifier: Apache-2.0
"""Geometry on the host, in torch, so that autograd differentiates it."""

import torch
from torch import Tensor

from .._native import operators
from ._arguments import ArgumentError, check, full_precision, shape, tensor

_UPPER = ([0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2])


def normalized_quat_to_rotmat(quat: Tensor) -> Tensor:
    """Unit quaternions [..., 4] (w first) to rotations [..., 3, 3]."""
    w, x, y, z = quat.unbind(-1)
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return torch.stack([torch.stack(row, -1) for row in rows], -2)


def upper_triangle(matrices):
    """Symmetric [..., 3, 3] to [..., 6]: xx xy xz yy yz zz."""
    return matrices[..., _UPPER[0], _UPPER[1]]


def _spread(rotations, factors, triu):
    axes = rotations * factors[..., None, :]
    matrices = axes @ axes.transpose(-1, -2)
    return upper_triangle(matrices) if triu else matrices


@full_precision
def quat_scale_to_covar_preci(
    quats: Tensor,
    scales: Tensor,
    compute_covar: bool = True,
    compute_preci: bool = True,
    triu: bool = False,
) -> tuple[Tensor | None, Tensor | None]:
    """Covariances and precisions of splats: [..., 3, 3], or [..., 6] where `triu` is set.

    Quaternions [..., 4] need no unit length. A result that is not asked for is None.
    """
    quats, scales = tensor("quats", quats), tensor("scales", scales)
    shape("quats", quats, scales.shape[:-1] + (4,))
    shape("scales", scales, quats.shape[:-1] + (3,))
    if not compute_covar and not compute_preci:
        return None, None
    rotations = normalized_quat_to_rotmat(torch.nn.functional.normalize(quats, dim=-1))
    covars = _spread(rotations, scales, triu) if compute_covar else None
    precis = _spread(rotations, 1.0 / scales, triu) if compute_preci else None
    return covars, precis


@full_precision
def world_to_cam(means: Tensor, covars: Tensor, viewmats: Tensor) -> tuple[Tensor, Tensor]:
    """Means [..., N, 3] and covariances [..., N, 3, 3] in each camera's frame: [..., C, N, ...]."""
    means, covars = tensor("means", means), tensor("covars", covars)
    viewmats = tensor("viewmats", viewmats)
    batch, count = means.shape[:-2], means.shape[-2]
    shape("means", means, batch + (count, 3))
    shape("covars", covars, batch + (count, 3, 3))
    shape("viewmats", viewmats, batch + (viewmats.shape[-3], 4, 4))
    rotations = viewmats[..., None, :3, :3]
    moved = (rotations @ means[..., None, :, :, None])[..., 0] + viewmats[..., None, :3, 3]
    turned = rotations @ covars[..., None, :, :, :] @ rotations.transpose(-1, -2)
    return moved, turned


@full_precision
def proj(
    means: Tensor,
    covars: Tensor,
    Ks: Tensor,
    width: int,
    height: int,
    camera_model: str = "pinhole",
) -> tuple[Tensor, Tensor]:
    """Means [..., C, N, 2] and covariances [..., C, N, 2, 2] on the image plane."""
    means, covars, Ks = tensor("means", means), tensor("covars", covars), tensor("Ks", Ks)
    lead = means.shape[:-1]
    check(means.dim() >= 3, f"means has shape {tuple(means.shape)}; expected [..., C, N, 3]")
    shape("means", means, lead + (3,))
    shape("covars", covars, lead + (3, 3))
    shape("Ks", Ks, lead[:-1] + (3, 3))
    Ks = Ks[..., None, :, :]
    fx, fy, cx, cy = Ks[..., 0, 0], Ks[..., 1, 1], Ks[..., 0, 2], Ks[..., 1, 2]
    if camera_model == "pinhole":
        center, jacobian = _pinhole(means, fx, fy, cx, cy, width, height)
    elif camera_model == "ortho":
        center, jacobian = _ortho(means, fx, fy, cx, cy)
    elif camera_model == "fisheye":
        center, jacobian = _fisheye(means, fx, fy, cx, cy)
    else:
        raise ArgumentError(f"camera_model {camera_model!r} is none of pinhole, ortho, fisheye")
    return center, jacobian @ covars @ jacobian.transpose(-1, -2)


def _rows(first, second):
    """A Jacobian [..., 2, 3] from the entries of its rows."""
    return torch.stack(torch.broadcast_tensors(*first, *second), -1).unflatten(-1, (2, 3))


def _pinhole(means, fx, fy, cx, cy, width, height):
    x, y, z = means.unbind(-1)
    # Beyond this share of the half image, the linear approximation does not hold.
    margin = operators.JACOBIAN_MARGIN / 2
    margin_x, margin_y = margin * width / fx, margin * height / fy
    u = _within(x / z, -cx / fx - margin_x, (width - cx) / fx + margin_x)
    v = _within(y / z, -cy / fy - margin_y, (height - cy) / fy + margin_y)
    zero = torch.zeros_like(z)
    center = torch.stack((fx * x / z + cx, fy * y / z + cy), -1)
    return center, _rows((fx / z, zero, -fx * u / z), (zero, fy / z, -fy * v / z))


def _within(value, low, high):
    return torch.minimum(torch.maximum(value, low), high)


def _ortho(means, fx, fy, cx, cy):
    x, y, z = means.unbind(-1)
    zero = torch.zeros_like(z)
    center = torch.stack((fx * x + cx, fy * y + cy), -1)
    return center, _rows((fx, zero, zero), (zero, fy, zero))


def _fisheye(means, fx, fy, cx, cy):
    """Equidistant: the distance from the principal point is the angle to the axis."""
    tiny = 1e-7
    x, y, z = means.unbind(-1)
    radial = torch.sqrt(x * x + y * y) + tiny
    angle = torch.atan2(radial, z + tiny)
    center = torch.stack((fx * x * angle / radial + cx, fy * y * angle / radial + cy), -1)
    xx, yy, xy = x * x + tiny, y * y, x * y
    rr = xx + yy
    inverse = 1.0 / (rr + z * z)
    along, across = z * inverse / rr, torch.atan2(radial, z) / radial / rr
    return center, _rows(
        (fx * (xx * along + yy * across), fx * xy * (along - across), -fx * x * inverse),
        (fy * xy * (along - across), fy * (yy * along + xx * across), -fy * y * inverse),
    )


def camera_offsets(viewmats):
    """What turns a mean into its direction from each camera: R^T t, [..., 3]."""
    return (viewmats[..., :3, :3] * viewmats[..., :3, 3:]).sum(-2)
