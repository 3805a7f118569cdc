# SPDX-License-Identifier: Apache-2.0
"""fully_fused_projection, and the lenses of cameras."""

import numpy as np
from torch import Tensor

from . import _dialect
from .._native import operators
from ._arguments import array, check, integer, mismatch, shape, tensor, unavailable
from ._autograd import Project, ProjectPacked, project_options


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
        width,
        height,
        eps2d,
        near_plane,
        far_plane,
        radius_clip,
        calc_compensations,
        lens_of(camera_model, tensors[4].shape[:-2]),
    )
    out = project(tensors, options, packed, sparse_grad)
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


def project(tensors, options, packed, sparse_grad):
    """The projection of checked tensors, in the dialect of gsplat 1.6."""
    if packed:
        return ProjectPacked.apply(*tensors, options, sparse_grad)
    return Project.apply(*tensors, options)


_MODELS = {"pinhole": "opencv", "ortho": "orthographic", "fisheye": "fisheye"}
# Where an argument's values stand among k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4.
_PINHOLE_TERMS = {
    "radial_coeffs": (0, 1, 4, 5, 6, 7),
    "tangential_coeffs": (2, 3),
    "thin_prism_coeffs": (8, 9, 10, 11),
}
_TERMS = {"pinhole": _PINHOLE_TERMS, "fisheye": {"radial_coeffs": (0, 1, 4, 5)}, "ortho": {}}


def lens_of(camera_model, cameras, **coefficients):
    """The lens of cameras [..., C] as ewa's operators take it: its name, and terms [..., C, 12]."""
    if camera_model in ("ftheta", "lidar"):
        raise unavailable(f"camera_model {camera_model!r}")
    check(
        camera_model in _MODELS,
        f"camera_model {camera_model!r} is none of gsplat's pinhole, ortho and fisheye; ewa.render has"
        " equirectangular, too",
    )
    given = {name: tensor(name, v) for name, v in coefficients.items() if v is not None}
    if camera_model == "pinhole" and not given:
        return "pinhole", None
    terms = np.zeros(tuple(cameras) + (12,), np.float32)
    for name, value in given.items():
        places = _TERMS[camera_model].get(name, ())
        check(places, f"{name} are no terms of camera_model {camera_model!r}")
        shape(name, value, tuple(cameras) + (len(places),))
        terms[..., places] = array(value)
    return _MODELS[camera_model], terms
