# SPDX-License-Identifier: Apache-2.0
"""The differentiable operators: numpy views of tensors in, the device's arrays out."""

import functools
import math

import numpy as np
import torch
from torch.autograd import Function

from ._arguments import array, bytes_of, check
from ._device import operators


def _numpy_or_none(value):
    return None if value is None else array(value)


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


class ProjectOptions:
    """What a projection takes beside tensors."""

    __slots__ = ("width", "height", "eps2d", "near", "far", "radius_clip", "compensations")

    def __init__(self, width, height, eps2d, near, far, radius_clip, compensations):
        check(eps2d >= 0, f"eps2d is {eps2d}; expected 0 or more")
        self.width, self.height = width, height
        self.eps2d, self.near, self.far = float(eps2d), float(near), float(far)
        self.radius_clip, self.compensations = float(radius_clip), bool(compensations)


def _scenes(tensors, batch):
    """For each scene of a batch, the arrays of that scene."""
    arrays = [_numpy_or_none(t) for t in tensors]
    if not batch:
        return [arrays]
    count = math.prod(batch)
    arrays = [None if a is None else a.reshape((count,) + a.shape[len(batch) :]) for a in arrays]
    return [[None if a is None else a[i] for a in arrays] for i in range(count)]


def _joined(parts, batch):
    """One array a result from the results of each scene."""
    if not batch:
        return parts[0]
    return [
        None if p[0] is None else np.stack(p).reshape(tuple(batch) + p[0].shape)
        for p in zip(*parts)
    ]


def _project(means, quats, scales, covars, opacities, viewmats, Ks, options):
    batch = means.shape[:-2]
    scenes = _scenes((means, quats, scales, covars, opacities, viewmats, Ks), batch)
    o = options
    project = operators().project
    return _joined(
        [
            project(
                *scene,
                o.width,
                o.height,
                o.eps2d,
                o.near,
                o.far,
                o.radius_clip,
                o.compensations,
            )
            for scene in scenes
        ],
        batch,
    )


def _project_backward(tensors, options, radii, gradients, need_viewmats):
    """The gradients of means, quats, scales, covars and viewmats as tensors."""
    batch = tensors[0].shape[:-2]
    count = len(batch)
    scenes = _scenes(tensors, batch)
    flat = [radii] + list(gradients)
    if count:
        size = math.prod(batch)
        flat = [None if a is None else a.reshape((size,) + a.shape[count:]) for a in flat]
    backward = operators().project_backward
    parts = []
    for index, scene in enumerate(scenes):
        own = [a if a is None or not count else a[index] for a in flat]
        parts.append(
            backward(*scene, options.width, options.height, options.eps2d, *own, need_viewmats)
        )
    return [_tensor_or_none(a) for a in _joined(parts, batch)]


class Project(Function):
    """Splats to footprints: radii, means2d, depths, conics and compensations [..., C, N, ...]."""

    @staticmethod
    def forward(ctx, means, quats, scales, covars, viewmats, opacities, Ks, options):
        out = _project(means, quats, scales, covars, opacities, viewmats, Ks, options)
        out = [_tensor_or_none(a) for a in out]
        ctx.set_materialize_grads(False)
        ctx.options = options
        ctx.save_for_backward(means, quats, scales, covars, viewmats, Ks, out[0])
        ctx.mark_non_differentiable(out[0])
        return tuple(out)

    @staticmethod
    @first_derivatives
    def backward(ctx, _radii, v_means2d, v_depths, v_conics, v_compensations):
        *tensors, radii = ctx.saved_tensors
        gradients = [_numpy_or_none(v) for v in (v_means2d, v_depths, v_conics, v_compensations)]
        need_viewmats = ctx.needs_input_grad[4]
        out = _project_backward(tensors, ctx.options, array(radii), gradients, need_viewmats)
        return (*out, None, None, None)


class ProjectPacked(Function):
    """Splats to the footprints of those that reach an image, one row each [nnz, ...]."""

    @staticmethod
    def forward(ctx, means, quats, scales, covars, viewmats, opacities, Ks, options, sparse):
        dense = _project(means, quats, scales, covars, opacities, viewmats, Ks, options)
        images = math.prod(viewmats.shape[:-2])
        splats = means.shape[-2]
        radii = dense[0].reshape(-1, 2)
        rows = np.flatnonzero(radii[:, 0])
        image, splat = np.divmod(rows, max(splats, 1))
        batch, camera = np.divmod(image, viewmats.shape[-3])
        indptr = np.searchsorted(image, np.arange(images + 1)).astype(np.int32)
        ids = [torch.from_numpy(a) for a in (batch, camera, splat, indptr)]
        depth = dense[0].ndim - 1
        packed = [
            None if a is None else torch.from_numpy(a.reshape((-1,) + a.shape[depth:])[rows])
            for a in dense
        ]
        ctx.set_materialize_grads(False)
        ctx.options, ctx.sparse, ctx.rows, ctx.radii = options, sparse, rows, dense[0]
        ctx.save_for_backward(means, quats, scales, covars, viewmats, Ks)
        ctx.mark_non_differentiable(*ids, packed[0])
        return (*ids, *packed)

    @staticmethod
    @first_derivatives
    def backward(ctx, _batch, _camera, _splat, _indptr, _radii, *packed):
        tensors = ctx.saved_tensors
        shape = ctx.radii.shape[:-1]
        widths = ((2,), (), (3,), ())
        gradients = [_spread(v, ctx.rows, shape, w) for v, w in zip(packed, widths)]
        out = _project_backward(tensors, ctx.options, ctx.radii, gradients, ctx.needs_input_grad[4])
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
        out = operators().spherical_harmonics(degree, array(dirs), array(coeffs), masks)
        return torch.from_numpy(out)

    @staticmethod
    @first_derivatives
    def backward(ctx, v_colors):
        dirs, coeffs = ctx.saved_tensors
        v_coeffs, v_dirs = operators().spherical_harmonics_backward(
            ctx.degree,
            array(dirs),
            array(coeffs),
            ctx.masks,
            array(v_colors),
            ctx.needs_input_grad[0],
        )
        return _tensor_or_none(v_dirs), torch.from_numpy(v_coeffs), None, None


class Images:
    """The images of a blend call: their size, their rows of splats and what orders them.

    `rows[i]` is the range of image i in the flattened tensors of splats. `absgrad` is the tensor
    that each backward pass fills with absolute gradients, or None.
    """

    def __init__(self, dims, width, height, tile_size, rows, absgrad=None, masks=None):
        self.dims, self.width, self.height = tuple(dims), width, height
        self.tile_size, self.rows, self.absgrad = tile_size, rows, absgrad
        self.masks = None
        if masks is not None:
            self.masks = bytes_of(masks).reshape((-1,) + masks.shape[-2:])

    def mask(self, i):
        return None if self.masks is None else self.masks[i]


class ByDepth(Images):
    """Each image draws its splats in order of depth."""

    def order(self, depths, radii):
        self.depths, self.radii = array(depths).reshape(-1), array(radii).reshape(-1, 2)
        return self

    def blend(self, i, part, means2d, conics, opacities, features, background, keep):
        return operators().blend(
            means2d,
            conics,
            self.depths[part],
            opacities,
            features,
            self.radii[part],
            self.width,
            self.height,
            background,
            self.mask(i),
            self.tile_size,
            keep,
        )


class ByLists(Images):
    """Each tile draws the splats of its own list, in the order of the list."""

    def order(self, offsets, ids):
        self.offsets, self.ids = offsets, ids
        return self

    def blend(self, i, part, means2d, conics, opacities, features, background, keep):
        return operators().blend_lists(
            means2d,
            conics,
            opacities,
            features,
            self.width,
            self.height,
            background,
            self.mask(i),
            self.tile_size,
            self.offsets[i],
            self.ids[i],
            keep,
        )


class Blend(Function):
    """Footprints and features to images [..., H, W, D] and alphas [..., H, W, 1]."""

    @staticmethod
    def forward(ctx, means2d, conics, opacities, features, backgrounds, images, keep):
        channels = features.shape[-1]
        splats = [
            array(means2d).reshape(-1, 2),
            array(conics).reshape(-1, 3),
            array(opacities).reshape(-1),
            array(features).reshape(-1, channels),
        ]
        if backgrounds is not None:
            backgrounds = array(backgrounds).reshape(-1, channels)
        colors, alphas, ctx.handles = [], [], []
        for i, (start, stop) in enumerate(images.rows):
            part = slice(start, stop)
            background = None if backgrounds is None else backgrounds[i]
            own = [a[part] for a in splats]
            color, alpha, handle = images.blend(i, part, *own, background, keep)
            colors.append(color)
            alphas.append(alpha)
            ctx.handles.append(handle)
        size = images.dims + (images.height, images.width)
        ctx.images, ctx.channels, ctx.count = images, channels, len(splats[0])
        ctx.shapes = [t.shape for t in (means2d, conics, opacities, features)]
        ctx.set_materialize_grads(False)
        # For first_derivatives alone: the device keeps the values that the backward pass reads.
        ctx.save_for_backward(means2d, conics, opacities, features)
        return _stack(colors, size + (channels,)), _stack(alphas, size + (1,))

    @staticmethod
    @first_derivatives
    def backward(ctx, v_colors, v_alphas):
        ctx.saved_tensors  # torch raises here when the graph is already freed
        images = ctx.images
        size = (len(images.rows), images.height, images.width)
        if v_colors is None:
            v_colors = np.zeros(size + (ctx.channels,), np.float32)
        else:
            v_colors = array(v_colors).reshape(size + (ctx.channels,))
        v_alphas = [None] * size[0] if v_alphas is None else array(v_alphas).reshape(size)
        parts = [
            operators().blend_backward(handle, v_colors[i], v_alphas[i], images.absgrad is not None)
            for i, handle in enumerate(ctx.handles)
        ]
        results = zip(*parts) if parts else [()] * 6  # there may be no camera
        v_means2d, v_conics, v_opacities, v_features, v_backgrounds, absolute = results
        joined = [
            torch.from_numpy(_gather(v, images.rows, ctx.count)).reshape(s) if v else torch.zeros(s)
            for v, s in zip((v_means2d, v_conics, v_opacities, v_features), ctx.shapes)
        ]
        if images.absgrad is not None and parts:
            absolute = torch.from_numpy(_gather(absolute, images.rows, ctx.count))
            images.absgrad.copy_(absolute.reshape(ctx.shapes[0]))
        v_background = None
        if ctx.needs_input_grad[4]:
            v_background = _stack(v_backgrounds, images.dims + (ctx.channels,))
        return (*joined, v_background, None, None)


def attach_absgrad(means2d):
    """Gives means2d its attribute `absgrad`: zeros, which each backward pass fills (gsplat 1.6)."""
    means2d.absgrad = torch.zeros_like(means2d, requires_grad=False)
    return means2d.absgrad


def _stack(arrays, shape):
    if not arrays:
        return torch.zeros(shape)
    joined = arrays[0] if len(arrays) == 1 else np.stack(arrays)
    return torch.from_numpy(joined.reshape(shape))


def _gather(parts, rows, count):
    """The rows of each image added up in one array of `count` rows."""
    if len(parts) == 1 and len(parts[0]) == count:
        return parts[0]
    out = np.zeros((count,) + parts[0].shape[1:], np.float32)
    for (start, stop), part in zip(rows, parts):
        out[start:stop] += part
    return out


def needs_gradient(*tensors):
    """Whether autograd will ask for the gradient of one of the tensors."""
    return torch.is_grad_enabled() and any(t is not None and t.requires_grad for t in tensors)
