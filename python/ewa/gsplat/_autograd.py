# SPDX-License-Identifier: Apache-2.0
"""The differentiable operators: numpy views of tensors in, the device's arrays out."""

import functools
import math
from typing import Any, NamedTuple

import numpy as np
import torch
from torch.autograd import Function

from .._native import operators
from ._arguments import array, bytes_of, check


def _tensor_or_none(value):
    return None if value is None else torch.from_numpy(value)


class _Derivative(Function):
    """A gradient that depends on tensors in a way that cannot be differentiated."""

    @staticmethod
    def forward(ctx, value, *_tensors):
        return value.clone()

    @staticmethod
    def backward(ctx, _gradient):
        raise NotImplementedError("ewa.gsplat has first derivatives only")


def first_derivatives(backward):
    """Makes derivatives of gradients an error. torch's once_differentiable lets some be zero."""

    @functools.wraps(backward)
    def run(ctx, *gradients):
        with torch.no_grad():
            out = backward(ctx, *gradients)
        if not torch.is_grad_enabled():  # create_graph=True enables it
            return out
        given = (*ctx.saved_tensors, *gradients)
        causes = [t for t in given if t is not None and t.requires_grad]
        if not causes:
            return out
        return tuple(None if v is None else _Derivative.apply(v, *causes) for v in out)

    return run


class ProjectOptions(NamedTuple):
    """What a projection takes beside tensors."""

    width: int
    height: int
    eps2d: float
    near: float
    far: float
    radius_clip: float
    compensations: bool
    camera_model: str = "pinhole"
    distortions: np.ndarray | None = None


def project_options(width, height, eps2d, near, far, radius_clip, compensations, lens):
    check(eps2d >= 0, f"eps2d is {eps2d}; expected 0 or more")
    floats = map(float, (eps2d, near, far, radius_clip))
    return ProjectOptions(width, height, *floats, bool(compensations), *lens)


_FOOTPRINT = ("radii", "means2d", "depths", "conics", "compensations")


def _project(ctx, means, quats, scales, covars, viewmats, opacities, Ks, options):
    """The arrays of the footprints. Their gradient needs what stays in ctx."""
    tensors = (means, quats, scales, covars, opacities, viewmats, Ks)
    ctx.projection = operators.Projection(*map(array, tensors), *options)
    ctx.set_materialize_grads(False)
    footprints = ctx.projection.footprints()
    ctx.radii = footprints.radii
    return [getattr(footprints, name) for name in _FOOTPRINT]


def _save(ctx, means, quats, scales, covars, viewmats, _opacities, Ks, _options, *radii):
    """For first_derivatives, and for torch's check that none changes before the backward pass."""
    ctx.save_for_backward(means, quats, scales, covars, viewmats, Ks, *radii)


def _project_backward(ctx, *gradients):
    """The gradients of means, quats, scales, covars and viewmats as tensors."""
    ctx.saved_tensors  # torch raises here when the graph is already freed
    by = operators.Footprints(**dict(zip(_FOOTPRINT, (ctx.radii, *gradients))))
    return [_tensor_or_none(a) for a in ctx.projection.gradients(by, ctx.needs_input_grad[4])]


class Project(Function):
    """Splats to footprints: radii, means2d, depths, conics and compensations [..., C, N, ...]."""

    @staticmethod
    def forward(ctx, *arguments):
        out = tuple(_tensor_or_none(a) for a in _project(ctx, *arguments))
        _save(ctx, *arguments, out[0])
        ctx.mark_non_differentiable(out[0])
        return out

    @staticmethod
    @first_derivatives
    def backward(ctx, _radii, *gradients):
        return (*_project_backward(ctx, *map(array, gradients)), None, None, None)


class ProjectPacked(Function):
    """Splats to the footprints of those that reach an image, one row each [nnz, ...]."""

    @staticmethod
    def forward(ctx, *arguments):
        *arguments, ctx.sparse = arguments
        arrays = _project(ctx, *arguments)
        _save(ctx, *arguments)
        *dims, splats = ctx.radii.shape[:-1]
        ctx.rows = np.flatnonzero(ctx.radii[..., 0])
        image, splat = np.divmod(ctx.rows, max(splats, 1))
        batch, camera = np.divmod(image, dims[-1])
        indptr = np.searchsorted(image, np.arange(math.prod(dims) + 1)).astype(np.int32)
        ids = [torch.from_numpy(a) for a in (batch, camera, splat, indptr)]
        depth = len(dims) + 1
        packed = [
            None if a is None else torch.from_numpy(a.reshape((-1,) + a.shape[depth:])[ctx.rows])
            for a in arrays
        ]
        ctx.mark_non_differentiable(*ids, packed[0])
        return (*ids, *packed)

    @staticmethod
    @first_derivatives
    def backward(ctx, _batch, _camera, _splat, _indptr, _radii, *packed):
        shape = ctx.radii.shape[:-1]
        widths = ((2,), (), (3,), ())
        gradients = [_spread(v, ctx.rows, shape, w) for v, w in zip(packed, widths)]
        out = _project_backward(ctx, *gradients)
        if ctx.sparse:
            out[:4] = _sparse(out[:4], ctx.rows, shape)
        return (*out, None, None, None, None)


def _spread(packed, rows, shape, width):
    """Packed rows in an array of all footprints, zero elsewhere."""
    if packed is None:
        return None
    dense = np.zeros((math.prod(shape),) + width, np.float32)
    dense[rows] = packed.detach().numpy()
    return dense.reshape(shape + width)


def _sparse(gradients, rows, shape):
    """COO tensors with a row for each splat that reaches an image."""
    *batch, cameras, splats = shape
    scene, splat = np.divmod(rows, cameras * splats)[0], rows % max(splats, 1)
    used = np.unique(scene * splats + splat)
    place = np.unravel_index(used, tuple(batch) + (splats,))
    place, used = torch.from_numpy(np.stack(place)), torch.from_numpy(used)
    depth = len(batch) + 1
    return [
        (
            None
            if g is None
            else torch.sparse_coo_tensor(place, g.flatten(0, depth - 1)[used], g.shape)
        )
        for g in gradients
    ]


class Harmonics(Function):
    """Spherical harmonics of directions [V, N, 3] with coefficients [N, K, D]: [V, N, D]."""

    @staticmethod
    def forward(ctx, dirs, coeffs, masks, degree):
        ctx.degree, ctx.masks = degree, masks
        ctx.save_for_backward(dirs, coeffs)
        out = operators.spherical_harmonics(degree, array(dirs), array(coeffs), masks)
        return torch.from_numpy(out)

    @staticmethod
    @first_derivatives
    def backward(ctx, v_colors):
        dirs, coeffs = ctx.saved_tensors
        v_coeffs, v_dirs = operators.spherical_harmonics_backward(
            ctx.degree,
            array(dirs),
            array(coeffs),
            ctx.masks,
            array(v_colors),
            ctx.needs_input_grad[0],
        )
        return _tensor_or_none(v_dirs), torch.from_numpy(v_coeffs), None, None


class Images(NamedTuple):
    """The images of a blend call, their ranges of splats, and what orders these.

    Image i draws the range `rows[i]` of the flattened tensors of splats: by depth, or by the lists
    of its tiles, `lists[i]`. Each backward pass fills `absgrad` with absolute gradients.
    """

    dims: tuple
    rows: list
    width: int
    height: int
    tile_size: int
    absgrad: Any = None
    depths: Any = None
    radii: Any = None
    masks: Any = None
    lists: list = []


class Blend(Function):
    """Footprints and features to images [..., H, W, D] and alphas [..., H, W, 1]."""

    @staticmethod
    def forward(ctx, means2d, conics, opacities, features, backgrounds, images, keep):
        splats = dict(means2d=means2d, conics=conics, opacities=opacities, features=features)
        splats.update(depths=images.depths, radii=images.radii)
        ctx.blending = operators.Blending(
            operators.Footprints(**{name: array(v) for name, v in splats.items()}),
            images.rows,
            images.width,
            images.height,
            images.tile_size,
            array(backgrounds),
            None if images.masks is None else bytes_of(images.masks),
            images.lists,
        )
        out = ctx.blending.blend(keep)
        ctx.background_shape, ctx.absgrad = images.dims + features.shape[-1:], images.absgrad
        ctx.set_materialize_grads(False)
        # For first_derivatives alone: the device keeps the values that the backward pass reads.
        ctx.save_for_backward(means2d, conics, opacities, features)
        return tuple(torch.from_numpy(a.reshape(images.dims + a.shape[1:])) for a in out)

    @staticmethod
    @first_derivatives
    def backward(ctx, v_colors, v_alphas):
        ctx.saved_tensors  # torch raises here when the graph is already freed
        v, backgrounds, absolute = ctx.blending.gradients(
            array(v_colors), array(v_alphas), ctx.absgrad is not None
        )
        if ctx.absgrad is not None:
            ctx.absgrad.copy_(torch.from_numpy(absolute))
        v_background = None
        if ctx.needs_input_grad[4]:
            v_background = torch.from_numpy(backgrounds.reshape(ctx.background_shape))
        splats = (torch.from_numpy(a) for a in (v.means2d, v.conics, v.opacities, v.features))
        return (*splats, v_background, None, None)


def attach_absgrad(means2d):
    """Gives means2d its attribute `absgrad`: zeros, which each backward pass fills (gsplat 1.6)."""
    means2d.absgrad = torch.zeros_like(means2d, requires_grad=False)
    return means2d.absgrad


def needs_gradient(*tensors):
    """Whether autograd will ask for the gradient of one of the tensors."""
    return torch.is_grad_enabled() and any(t is not None and t.requires_grad for t in tensors)
