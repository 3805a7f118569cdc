# SPDX-License-Identifier: Apache-2.0
"""rasterize_to_pixels: the caller's lists of tiles, blended on the device."""

import math

import numpy as np
from torch import Tensor

from .._native import operators
from ._arguments import array, check, integer, mismatch, shape, tensor
from ._autograd import Blend, Images, attach_absgrad, needs_gradient


def rasterize_to_pixels(
    means2d: Tensor,
    conics: Tensor,
    colors: Tensor,
    opacities: Tensor,
    image_width: int,
    image_height: int,
    tile_size: int,
    isect_offsets: Tensor,
    flatten_ids: Tensor,
    backgrounds: Tensor | None = None,
    masks: Tensor | None = None,
    packed: bool = False,
    absgrad: bool = False,
) -> tuple[Tensor, Tensor]:
    """Blends footprints to images [..., H, W, D] and alphas [..., H, W, 1].

    Footprints are [..., N, ...], or [nnz, ...] where `packed` is set. `isect_offsets` [..., rows,
    columns] and `flatten_ids` are from isect_offset_encode and isect_tiles. `masks`, of the shape
    of `isect_offsets`, are False where a tile shall show the background alone. `absgrad` gives
    means2d an attribute of that name, which the backward pass fills. A tile has a multiple
    of 4 pixels a side.
    """
    given, means2d, conics = means2d, tensor("means2d", means2d), tensor("conics", conics)
    colors, opacities = tensor("colors", colors), tensor("opacities", opacities)
    image_width = integer("image_width", image_width)
    image_height = integer("image_height", image_height)
    tile_size = integer("tile_size", tile_size)
    if isect_offsets.dim() < 2:
        raise mismatch("isect_offsets", isect_offsets, "[..., rows, columns]")
    if not colors.dim() or not colors.shape[-1]:
        raise mismatch("colors", colors, "[..., D] with at least one channel")
    dims, (rows, columns) = isect_offsets.shape[:-2], isect_offsets.shape[-2:]
    channels = colors.shape[-1]
    lead = means2d.shape[:1] if packed else dims + means2d.shape[-2:-1]
    shape("means2d", means2d, lead + (2,))
    shape("conics", conics, lead + (3,))
    shape("colors", colors, lead + (channels,))
    shape("opacities", opacities, lead)
    if backgrounds is not None:
        backgrounds = tensor("backgrounds", backgrounds)
        shape("backgrounds", backgrounds, dims + (channels,))
    if masks is not None:
        shape("masks", masks, isect_offsets.shape)
    part = operators.PART_SIZE
    check(tile_size % part == 0, f"tile_size is {tile_size}; expected a multiple of {part}")
    check(rows * tile_size >= image_height, f"{rows} rows of tiles do not cover {image_height} px")
    check(columns * tile_size >= image_width, f"{columns} tiles do not cover {image_width} px")
    rows, lists = _lists(isect_offsets, flatten_ids, lead[-1], packed)
    holder = attach_absgrad(given) if absgrad else None
    size = (image_width, image_height, tile_size)
    images = Images(dims, rows, *size, absgrad=holder, masks=masks, lists=lists)
    keep = needs_gradient(means2d, conics, colors, opacities, backgrounds)
    return Blend.apply(means2d, conics, opacities, colors, backgrounds, images, keep)


def _range(name, values, low, high):
    """The least of the values and one more than the largest; both are within low and high."""
    if not values.size:
        return low, low
    least, largest = int(values.min()), int(values.max())
    check(
        low <= least and largest < high,
        f"{name} holds values from {least} to {largest}; expected at least {low} and below {high}",
    )
    return least, largest + 1


def _lists(isect_offsets, flatten_ids, count, packed):
    """For each image: its range of splats, and offsets and lists from the start of that range."""
    images = math.prod(isect_offsets.shape[:-2])
    ids = array(flatten_ids)
    _range("isect_offsets", array(isect_offsets), 0, len(ids) + 1)
    starts = array(isect_offsets).astype(np.int32, copy=False).reshape(images, -1)
    ends = np.append(starts[1:, 0], len(ids)).astype(np.int32)
    ranges, lists = [], []
    for i in range(images):
        first = starts[i, 0]
        own = ids[first : ends[i]]
        low, high = (0, count) if packed else (i * count, (i + 1) * count)
        used = _range("flatten_ids", own, low, high)
        if packed:
            low, high = used
        ranges.append((low, high))
        offsets = np.append(starts[i] - first, len(own)).astype(np.int32)
        lists.append((offsets, np.ascontiguousarray(own - low, np.int32)))
    return ranges, lists
