# SPDX-License-Identifier: Apache-2.0
"""Spherical harmonics, in the calls of gsplat 1.6 and of 1.5 and older."""

import torch
from torch import Tensor

from .._native import operators
from ._arguments import bytes_of, check, integer, mismatch, shape, tensor, unavailable
from ._autograd import Harmonics
from ._geometry import camera_offsets


_NAMES_OF_VIEWS = (
    "means",
    "viewmats",
    "coeffs",
    "masks",
    "batch_ids",
    "camera_ids",
    "gaussian_ids",
    "viewmats_rs",
)
_NAMES_OF_DIRS = ("dirs", "coeffs", "masks")


def spherical_harmonics(
    degrees_to_use: int, *arguments: Tensor | None, **named: Tensor | None
) -> Tensor:
    """Colours of spherical harmonics, without the 0.5 that renderers add.

    gsplat 1.6: (degree, means [..., N, 3], viewmats [..., C, 4, 4], coeffs [N, K, D], masks
    [..., C, N]) gives [..., C, N, D]; with batch_ids, camera_ids and gaussian_ids, [nnz, D].
    gsplat 1.5 and older: (degree, dirs [..., 3], coeffs [..., K, D], masks [...]) gives [..., D];
    coefficients [N, K, D] serve every leading dimension of `dirs`.
    """
    given = _named(arguments, named)
    if "means" in given:
        return _from_views(degrees_to_use, **given)
    dirs, coeffs = tensor("dirs", given["dirs"]), tensor("coeffs", given["coeffs"])
    return evaluate(degrees_to_use, dirs, coeffs, given.get("masks"))


def _is_float(value):
    return isinstance(value, torch.Tensor) and value.dtype.is_floating_point


def _named(arguments, named):
    """The arguments by name, in the call of the version that they belong to."""
    of_views = (
        "means" in named
        or "viewmats" in named
        or (len(arguments) > 2 and _is_float(arguments[2]))
        or (len(arguments) == 2 and "coeffs" in named)
    )
    names = _NAMES_OF_VIEWS if of_views else _NAMES_OF_DIRS
    given = dict(zip(names, arguments))
    given.update(named)
    needed = names[:3] if of_views else names[:2]
    if len(arguments) > len(names) or not set(needed) <= set(given) <= set(names):
        raise TypeError(f"spherical_harmonics takes degrees_to_use, {', '.join(names)}")
    return given


def _from_views(
    degree,
    means,
    viewmats,
    coeffs,
    masks=None,
    batch_ids=None,
    camera_ids=None,
    gaussian_ids=None,
    viewmats_rs=None,
):
    if viewmats_rs is not None:
        raise unavailable("viewmats_rs (rolling shutter)")
    means, viewmats = tensor("means", means), tensor("viewmats", viewmats)
    coeffs = tensor("coeffs", coeffs)
    batch, count = means.shape[:-2], means.shape[-2]
    shape("means", means, batch + (count, 3))
    shape("viewmats", viewmats, batch + (viewmats.shape[-3], 4, 4))
    offsets = camera_offsets(viewmats)
    if batch_ids is None:
        return evaluate(degree, means[..., None, :, :] + offsets[..., None, :], coeffs, masks)
    scene, camera, splat = batch_ids.long(), camera_ids.long(), gaussian_ids.long()
    cameras = viewmats.shape[-3]
    rows = means.reshape(-1, 3).index_select(0, scene * count + splat)
    dirs = rows + offsets.reshape(-1, 3).index_select(0, scene * cameras + camera)
    if coeffs.shape[0] != splat.shape[0]:
        coeffs = coeffs.index_select(0, splat)
    return evaluate(degree, dirs, coeffs, masks)


def evaluate(degree, dirs, coeffs, masks):
    """Directions [..., 3] with coefficients [..., K, D], or [N, K, D] for every leading dim."""
    degree = integer("degrees_to_use", degree, 0, operators.MAX_SH_DEGREE)
    if coeffs.dim() < 2 or not coeffs.shape[-1]:
        raise mismatch("coeffs", coeffs, "[..., K, D] with at least one channel")
    lead, (bands, channels) = dirs.shape[:-1], coeffs.shape[-2:]
    check(
        (degree + 1) ** 2 <= bands,
        f"coeffs has {bands} bands; degree {degree} needs {(degree + 1) ** 2}",
    )
    shape("dirs", dirs, lead + (3,))
    shared = coeffs.dim() == 3 and len(lead) > 1 and coeffs.shape[:1] == lead[-1:]
    if not shared:
        shape("coeffs", coeffs, lead + (bands, channels))
        dirs = dirs.reshape(1, -1, 3)
        coeffs = coeffs.reshape(-1, bands, channels)
    else:
        dirs = dirs.reshape(-1, lead[-1], 3)
    if masks is not None:
        shape("masks", masks, lead)
        masks = bytes_of(masks).reshape(dirs.shape[:-1])
    return Harmonics.apply(dirs, coeffs, masks, degree).reshape(lead + (channels,))


def spherical_harmonics_l0(sh0: Tensor) -> Tensor:
    """The part of degree 0: sh0 [N, 1, D] gives [N, D]."""
    return tensor("sh0", sh0)[:, 0] * operators.SH_C0


def spherical_harmonics_l1_plus(
    degrees_to_use: int, *arguments: Tensor | None, **named: Tensor | None
) -> Tensor:
    """The parts of degree 1 and above: as spherical_harmonics, with coefficients [N, K - 1, D]."""
    if "shN" in named:
        named["coeffs"] = named.pop("shN")
    given = _named(arguments, named)
    rest = given["coeffs"]
    constant = rest.new_zeros(rest.shape[:-2] + (1,) + rest.shape[-1:])
    given["coeffs"] = torch.cat((constant, rest), -2)
    return spherical_harmonics(degrees_to_use, **given)
