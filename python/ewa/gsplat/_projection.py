# SPDX-License-Identifier: Apache-2.0
"""fully_fused_projection: pinhole on the device, ortho and fisheye on the host."""

import math

import torch
from torch import Tensor

from . import _dialect
from .._native import operators
from ._arguments import check, full_precision, integer, mismatch, shape, tensor, unavailable
from ._autograd import Project, ProjectPacked, project_options
from ._geometry import footprint, full_matrix, project_rows, quat_scale_to_covar_preci, radii_of


def fully_fused_projection(
    means: Tensor,
    covars: Tensor | None,
    quats: Tensor | None,
    scales: Tensor | None,
    viewmats: Tensor,
    Ks: Tensor,
    width: int,
    height: int,
    eps2d: float = operators.LOW_PASS,
    near_plane: float = operators.NEAR_PLANE,
    far_plane: float = operators.FAR_PLANE,
    radius_clip: float = 0.0,
    packed: bool = False,
    sparse_grad: bool = False,
    calc_compensations: bool = False,
    camera_model: str = "pinhole",
    opacities: Tensor | None = None,
) -> tuple[Tensor, ...]:
    """Projects splats: means [..., N, 3] with covars [..., N, 6] or quats and scales.

    Returns radii int32 [..., C, N, 2], means2d, depths, conics and compensations (or None).
    Packed: batch_ids, camera_ids, gaussian_ids, indptr, and the same with one row [nnz, ...] for
    each splat that reaches an image. `opacities` [..., N] tighten the radii.
    """
    tensors = _checked(means, covars, quats, scales, viewmats, Ks, opacities)
    check(packed or not sparse_grad, "sparse_grad needs packed=True")
    width, height = integer("width", width), integer("height", height)
    options = project_options(
        width, height, eps2d, near_plane, far_plane, radius_clip, calc_compensations
    )
    out = project(tensors, options, packed, sparse_grad, camera_model)
    if _dialect.dialect() == "1.6":
        return out
    if not packed:
        return (_dialect.radii_of(out[0]), *out[1:])
    ids = out[:3] if _dialect.dialect() == "1.5" else out[1:3]
    return (*ids, _dialect.radii_of(out[4]), *out[5:])


def _checked(means, covars, quats, scales, viewmats, Ks, opacities):
    """The tensors in the order of the operators, each with the right shape."""
    means = tensor("means", means)
    if means.dim() < 2:
        raise mismatch("means", means, "[..., N, 3]")
    batch, count = means.shape[:-2], means.shape[-2]
    shape("means", means, batch + (count, 3))
    if covars is not None:
        covars, quats, scales = tensor("covars", covars), None, None
        shape("covars", covars, batch + (count, 6))
    else:
        check(quats is not None and scales is not None, "covars, or quats and scales, are needed")
        quats, scales = tensor("quats", quats), tensor("scales", scales)
        shape("quats", quats, batch + (count, 4))
        shape("scales", scales, batch + (count, 3))
    viewmats, Ks = tensor("viewmats", viewmats), tensor("Ks", Ks)
    cameras = cameras_of(viewmats)
    shape("viewmats", viewmats, batch + (cameras, 4, 4))
    shape("Ks", Ks, batch + (cameras, 3, 3))
    if opacities is not None:
        opacities = tensor("opacities", opacities).detach()
        shape("opacities", opacities, batch + (count,))
    return means, quats, scales, covars, viewmats, opacities, Ks


def cameras_of(viewmats):
    """The number of view matrices [..., C, 4, 4] of a scene."""
    if viewmats.dim() < 3:
        raise mismatch("viewmats", viewmats, "[..., C, 4, 4]")
    return viewmats.shape[-3]


def project(tensors, options, packed, sparse_grad, camera_model):
    """The projection of checked tensors, in the dialect of gsplat 1.6."""
    if camera_model == "pinhole":
        if packed:
            return ProjectPacked.apply(*tensors, options, sparse_grad)
        return Project.apply(*tensors, options)
    if camera_model not in ("ortho", "fisheye"):
        raise unavailable(f"camera_model {camera_model!r}")
    return _project_on_host(tensors, options, packed, camera_model)


@full_precision
def _project_on_host(tensors, options, packed, camera_model):
    means, quats, scales, covars, viewmats, opacities, Ks = tensors
    if covars is None:
        covars = quat_scale_to_covar_preci(quats, scales, compute_preci=False)[0]
    else:
        covars = full_matrix(covars)
    batch, count, cameras = means.shape[:-2], means.shape[-2], viewmats.shape[-3]
    means, covars = means.reshape(-1, 3), covars.reshape(-1, 3, 3)
    viewmats, Ks = viewmats.reshape(-1, 4, 4), Ks.reshape(-1, 3, 3)
    if opacities is not None:
        opacities = opacities.reshape(-1)

    def rows(image, splat):
        """Footprints of (image, splat) pairs; splats are counted over the batch."""
        rotations = viewmats[image, :3, :3]
        moved = (rotations @ means[splat][..., None])[..., 0] + viewmats[image, :3, 3]
        turned = rotations @ covars[splat] @ rotations.transpose(-1, -2)
        center, covars2d = project_rows(
            moved, turned, Ks[image], options.width, options.height, camera_model
        )
        conics, det, compensations, sides = footprint(covars2d, options.eps2d)
        return center, moved[..., 2], conics, compensations, det, sides

    images = math.prod(batch) * cameras
    image = torch.arange(images).repeat_interleave(count)
    splat = image.div(max(cameras, 1), rounding_mode="floor") * count
    splat = splat + torch.arange(count).repeat(images)
    with torch.no_grad():
        center, depths, _, compensations, det, sides = rows(image, splat)
        visibility = None if opacities is None else opacities[splat]
        if visibility is not None and options.compensations:
            visibility = visibility * compensations
        radii = radii_of(center, depths, sides, det, visibility, options)
    # Only what is drawn is differentiated: elsewhere the formulas have no finite gradient.
    drawn = radii[:, 0].nonzero()[:, 0]
    out = list(rows(image[drawn], splat[drawn])[:4])
    if not options.compensations:
        out[3] = None
    if packed:
        image, local = image[drawn], splat[drawn] % max(count, 1)
        scene = image.div(max(cameras, 1), rounding_mode="floor")
        indptr = torch.searchsorted(image, torch.arange(images + 1)).to(torch.int32)
        return (scene, image % max(cameras, 1), local, indptr, radii[drawn], *out)
    lead = batch + (cameras, count)
    dense = [None if v is None else _dense(v, drawn, images * count, lead) for v in out]
    return (radii.reshape(lead + (2,)), *dense)


def _dense(values, places, count, lead):
    full = values.new_zeros((count,) + values.shape[1:])
    return full.index_put((places,), values).reshape(lead + values.shape[1:])
