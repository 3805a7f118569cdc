# SPDX-License-Identifier: Apache-2.0
"""Tiles on the host, in torch: which tiles a splat touches, and what a pixel draws."""

import math

import torch
from torch import Tensor

from .._native import operators
from ._arguments import check, shape


def _tile_bits(tile_width, tile_height):
    return (tile_width * tile_height).bit_length()


@torch.no_grad()
def isect_tiles(
    means2d: Tensor,
    radii: Tensor,
    depths: Tensor,
    tile_size: int,
    tile_width: int,
    tile_height: int,
    sort: bool = True,
    segmented: bool = False,
    packed: bool = False,
    n_images: int | None = None,
    image_ids: Tensor | None = None,
    gaussian_ids: Tensor | None = None,
    conics: Tensor | None = None,
    opacities: Tensor | None = None,
) -> tuple[Tensor, Tensor, Tensor]:
    """The tiles that splats touch.

    Returns tiles per splat int32 [..., N] or [nnz], ids int64 [n] and splats int32 [n]. An id is
    image | tile | depth as 32 bits. With conics and opacities, a tile counts where the splat's
    ellipse reaches it, and without where its box does.
    """
    lead = means2d.shape[:-1]
    shape("means2d", means2d, lead + (2,))
    shape("radii", radii, lead + (2,))
    shape("depths", depths, lead)
    if packed:
        check(image_ids is not None and n_images is not None, "packed needs image_ids and n_images")
        image_ids = image_ids.reshape(-1).long()
    else:
        images = math.prod(lead[:-1])
        image_ids = torch.arange(images).repeat_interleave(lead[-1])
    means2d, radii, depths = means2d.reshape(-1, 2), radii.reshape(-1, 2), depths.reshape(-1)
    # As gsplat does, the bounds are found in tiles: (mean -+ radius) / size.
    center, reach = means2d / tile_size, radii / tile_size
    limit = torch.tensor((tile_width, tile_height))
    low = torch.minimum(torch.floor(center - reach).clamp(min=0).long(), limit)
    high = torch.minimum(torch.ceil(center + reach).clamp(min=0).long(), limit)
    extent = (high - low) * (radii > 0).all(-1, keepdim=True)
    counts = extent[:, 0] * extent[:, 1]
    splat = torch.repeat_interleave(counts)
    place = torch.arange(len(splat)) - (counts.cumsum(0) - counts)[splat]
    column = low[splat, 0] + place % extent[splat, 0].clamp(min=1)
    row = low[splat, 1] + place.div(extent[splat, 0].clamp(min=1), rounding_mode="floor")
    if conics is not None and opacities is not None:
        corner = torch.stack((column, row), -1) * tile_size - means2d[splat]
        shapes, visible = conics.reshape(-1, 3)[splat], opacities.reshape(-1)[splat]
        kept = _reached(corner, tile_size, shapes, visible)
        splat, column, row = splat[kept], column[kept], row[kept]
        counts = torch.bincount(splat, minlength=len(counts))
    bits = depths.float().contiguous().view(torch.int32).long() & 0xFFFFFFFF
    key = (image_ids[splat] << _tile_bits(tile_width, tile_height)) | (row * tile_width + column)
    ids = (key << 32) | bits[splat]
    if sort:
        ids, order = torch.sort(ids, stable=True)
        splat = splat[order]
    return counts.to(torch.int32).reshape(lead), ids, splat.to(torch.int32)


def _reached(corner, tile_size, conics, opacities):
    """Whether a tile, by its corner relative to the mean, holds a point of the splat's ellipse."""
    (x0, y0), (a, b, c) = corner.unbind(-1), conics.unbind(-1)
    x1, y1 = x0 + tile_size, y0 + tile_size
    inside = (x0 <= 0) & (x1 >= 0) & (y0 <= 0) & (y1 >= 0)
    least = torch.full_like(a, float("inf"))
    for x in (x0, x1):
        y = torch.minimum(torch.maximum(-b * x / c, y0), y1)
        least = torch.minimum(least, _exponent(a, b, c, x, y))
    for y in (y0, y1):
        x = torch.minimum(torch.maximum(-b * y / a, x0), x1)
        least = torch.minimum(least, _exponent(a, b, c, x, y))
    # A little more than the ellipse, so that rounding drops no pixel.
    limit = torch.log(torch.clamp(opacities / operators.ALPHA_MIN, min=1.0))
    return inside | (least <= limit * 1.0001 + 1e-4)


def _exponent(a, b, c, x, y):
    return 0.5 * (a * x * x + c * y * y) + b * x * y


@torch.no_grad()
def isect_offset_encode(
    isect_ids: Tensor, n_images: int, tile_width: int, tile_height: int
) -> Tensor:
    """Where the list of each tile starts in the sorted ids: int32 [n_images, rows, columns]."""
    bits = _tile_bits(tile_width, tile_height)
    tiles = torch.arange(tile_width * tile_height)
    keys = (torch.arange(n_images)[:, None] << bits) | tiles
    starts = torch.searchsorted(isect_ids >> 32, keys.reshape(-1))
    return starts.to(torch.int32).reshape(n_images, tile_height, tile_width)


@torch.no_grad()
def rasterize_to_indices_in_range(
    range_start: float,
    range_end: float,
    transmittances: Tensor,
    means2d: Tensor,
    conics: Tensor,
    opacities: Tensor,
    image_width: int,
    image_height: int,
    tile_size: int,
    isect_offsets: Tensor,
    flatten_ids: Tensor,
) -> tuple[Tensor, Tensor, Tensor]:
    """What each pixel draws of batches [range_start, range_end) of its tile's list.

    A batch has tile_size**2 entries. Returns splats, pixels and images, int64 [M], grouped by
    pixel and in the order of the list.
    """
    dims, count = means2d.shape[:-2], means2d.shape[-2]
    images = math.prod(dims)
    shape("conics", conics, dims + (count, 3))
    shape("opacities", opacities, dims + (count,))
    shape("transmittances", transmittances, dims + (image_height, image_width))
    rows, columns = isect_offsets.shape[-2:]
    shape("isect_offsets", isect_offsets, dims + (rows, columns))
    splats = (means2d.reshape(-1, 2), conics.reshape(-1, 3), opacities.reshape(-1))
    starts = torch.cat((isect_offsets.reshape(-1), flatten_ids.new_tensor([len(flatten_ids)])))
    light = transmittances.reshape(images, image_height, image_width)
    batch, found = tile_size * tile_size, []
    for tile, (start, stop) in enumerate(zip(starts.tolist(), starts.tolist()[1:])):
        listed = flatten_ids[start:stop][int(range_start * batch) : int(range_end * batch)].long()
        if not len(listed):
            continue
        image, place = divmod(tile, rows * columns)
        x = torch.arange(tile_size) + place % columns * tile_size
        y = torch.arange(tile_size) + place // columns * tile_size
        x, y = x[x < image_width], y[y < image_height]
        pixels = (y[:, None] * image_width + x).reshape(-1)
        drawn = _drawn(pixels, light[image].reshape(-1), splats, listed, image_width)
        pixel, entry = drawn.nonzero(as_tuple=True)
        found.append((image * image_height * image_width + pixels[pixel], listed[entry] % count))
    if not found:
        empty = torch.zeros(0, dtype=torch.int64)
        return empty, empty, empty
    pixel, splat = (torch.cat(parts) for parts in zip(*found))
    pixel, order = torch.sort(pixel, stable=True)
    size = image_width * image_height
    return splat[order], pixel % size, pixel.div(size, rounding_mode="floor")


def _drawn(pixels, light, splats, listed, width):
    """[pixels, entries]: whether the pixel draws the entry."""
    means2d, conics, opacities = splats
    x = (pixels % width)[:, None] + 0.5 - means2d[listed, 0]
    y = pixels.div(width, rounding_mode="floor")[:, None] + 0.5 - means2d[listed, 1]
    exponent = _exponent(*conics[listed].unbind(-1), x, y)
    alpha = torch.clamp(opacities[listed] * torch.exp(-exponent), max=operators.ALPHA_MAX)
    counted = (exponent >= 0) & (alpha >= operators.ALPHA_MIN)
    left = torch.cumprod(1 - alpha * counted, 1) * light[pixels][:, None]
    return counted & (left > operators.TRANSMITTANCE_STOP)


def accumulate(
    means2d: Tensor,
    conics: Tensor,
    opacities: Tensor,
    colors: Tensor,
    gaussian_ids: Tensor,
    pixel_ids: Tensor,
    image_ids: Tensor,
    image_width: int,
    image_height: int,
) -> tuple[Tensor, Tensor]:
    """Blends (splat, pixel, image) triples front to back, differentiably, in torch alone.

    Returns images [..., H, W, D] and alphas [..., H, W, 1]. Triples of one pixel must be in the
    order that rasterize_to_indices_in_range gives.
    """
    dims, count, channels = means2d.shape[:-2], means2d.shape[-2], colors.shape[-1]
    shape("means2d", means2d, dims + (count, 2))
    shape("conics", conics, dims + (count, 3))
    shape("opacities", opacities, dims + (count,))
    shape("colors", colors, dims + (count, channels))
    size = dims + (image_height, image_width)
    total = math.prod(size)
    row = image_ids * count + gaussian_ids
    ray = image_ids * (image_height * image_width) + pixel_ids
    ray, order = torch.sort(ray, stable=True)
    row, pixel = row[order], pixel_ids[order]
    mean = means2d.reshape(-1, 2)[row]
    x = pixel % image_width + 0.5 - mean[:, 0]
    y = pixel.div(image_width, rounding_mode="floor") + 0.5 - mean[:, 1]
    exponent = _exponent(*conics.reshape(-1, 3)[row].unbind(-1), x, y)
    alpha = torch.clamp(opacities.reshape(-1)[row] * torch.exp(-exponent), max=operators.ALPHA_MAX)
    # A table with one row a ray turns the product over a ray's entries into a cumprod.
    used, entries = torch.unique_consecutive(ray, return_counts=True)
    first = torch.repeat_interleave(entries.cumsum(0) - entries, entries)
    line = torch.repeat_interleave(entries)
    place = torch.arange(len(ray)) - first
    longest = int(entries.max()) if len(entries) else 0
    table = alpha.new_zeros((len(used), longest + 1)).index_put((line, place + 1), alpha)
    weight = alpha * torch.cumprod(1 - table, 1)[line, place]
    renders = colors.new_zeros((total, channels))
    renders = renders.index_add(0, ray, weight[:, None] * colors.reshape(-1, channels)[row])
    alphas = alpha.new_zeros(total).index_add(0, ray, weight)
    return renders.reshape(size + (channels,)), alphas.reshape(size + (1,))
