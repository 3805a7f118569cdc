# SPDX-License-Identifier: Apache-2.0
"""rasterization: splats and cameras to images, with the meta data that strategies read."""

import math
from typing import Any, Literal

import torch
from torch import Tensor

from . import _dialect
from .._native import operators
from ._arguments import (
    check,
    integer,
    mismatch,
    refusal,
    shape,
    tensor,
    unavailable,
    warn_of_raw,
)
from ._autograd import Blend, Images, attach_absgrad, needs_gradient, project_options
from ._geometry import camera_offsets, upper_triangle
from ._harmonics import evaluate
from ._projection import cameras_of, lens_of, project
from ._rolling import RollingShutterType, check_rolling, order_of, project_rolling
from ._tiles import isect_offset_encode, isect_tiles

_COLOR_MODES = {"RGB", "RGB+D", "RGB+ED", "RGB-d", "RGB-Ed"}
_DEPTH_MODES = {"D", "ED", "RGB+D", "RGB+ED"}
_HIT_MODES = {"d", "Ed", "RGB-d", "RGB-Ed"}
_EXPECTED_MODES = {"ED", "RGB+ED", "Ed", "RGB-Ed"}

RenderMode = Literal["RGB", "D", "ED", "RGB+D", "RGB+ED", "d", "Ed", "RGB-d", "RGB-Ed"]


def render_mode_has_color(mode: str) -> bool:
    return mode in _COLOR_MODES


def render_mode_has_depth(mode: str) -> bool:
    return mode in _DEPTH_MODES


def render_mode_has_hit_distance(mode: str) -> bool:
    return mode in _HIT_MODES


def render_mode_has_expected_depth(mode: str) -> bool:
    return mode in _EXPECTED_MODES


def render_mode_has_depth_channel(mode: str) -> bool:
    return mode in _DEPTH_MODES or mode in _HIT_MODES


def render_mode_has_only_depth_channel(mode: str) -> bool:
    return render_mode_has_depth_channel(mode) and not render_mode_has_color(mode)


def render_mode_has_only_color(mode: str) -> bool:
    return render_mode_has_color(mode) and not render_mode_has_depth_channel(mode)


class RendererConfig:
    """gsplat's choice between CUDA kernels. It changes nothing here."""

    def __new__(cls, *args, **kwargs):
        if cls is RendererConfig:
            raise TypeError("RendererConfig is abstract; use RendererConfig_MixedBatch()")
        return super().__new__(cls)


class RendererConfig_MixedBatch(RendererConfig):
    pass


class RendererConfig_ParallelBatch(RendererConfig):
    pass


def rasterization(
    means: Tensor,
    quats: Tensor | None,
    scales: Tensor | None,
    opacities: Tensor,
    colors: Tensor | None,
    viewmats: Tensor,
    Ks: Tensor,
    width: int,
    height: int,
    near_plane: float = operators.NEAR_PLANE,
    far_plane: float = operators.FAR_PLANE,
    radius_clip: float = 0.0,
    eps2d: float = operators.LOW_PASS,
    sh_degree: int | None = None,
    packed: bool = True,
    tile_size: int | None = None,
    backgrounds: Tensor | None = None,
    render_mode: str = "RGB",
    sparse_grad: bool = False,
    absgrad: bool = False,
    rasterize_mode: str = "classic",
    channel_chunk: int = 32,
    distributed: bool = False,
    camera_model: str = "pinhole",
    segmented: bool = False,
    covars: Tensor | None = None,
    with_ut: bool = False,
    with_eval3d: bool = False,
    return_normals: bool = False,
    global_z_order: bool = True,
    rays: object = None,
    radial_coeffs: Tensor | None = None,
    tangential_coeffs: Tensor | None = None,
    thin_prism_coeffs: Tensor | None = None,
    ftheta_coeffs: object = None,
    lidar_coeffs: object = None,
    external_distortion_coeffs: object = None,
    rolling_shutter: int | None = None,
    viewmats_rs: Tensor | None = None,
    ut_params: object = None,
    extra_signals: Tensor | None = None,
    extra_signals_sh_degree: int | None = None,
    renderer_config: object = None,
) -> tuple[Tensor, Tensor, dict[str, Any]]:
    """Renders splats from cameras.

    means [..., N, 3], quats [..., N, 4] (w first, any length), scales [..., N, 3], opacities
    [..., N], viewmats [..., C, 4, 4] (world to camera), Ks [..., C, 3, 3]. colors are [..., N, D]
    or [..., C, N, D], or with `sh_degree` coefficients [N, K, D], [..., N, K, D] or
    [..., C, N, K, D]. covars [..., N, 3, 3] replace quats and scales. backgrounds [..., C, D].

    render_mode: RGB, D (accumulated depth), ED (expected depth), RGB+D or RGB+ED.
    `packed` keeps one row in meta for each splat that reaches an image; `sparse_grad` then gives
    sparse gradients of means, quats, scales and covars. `absgrad` gives meta["means2d"] an
    attribute of that name after the backward pass. rasterize_mode: classic or antialiased.

    camera_model: pinhole, ortho or fisheye. radial_coeffs [..., C, 6] (k1 to k6), tangential_coeffs
    [..., C, 2] and thin_prism_coeffs [..., C, 4] bend a pinhole as OpenCV's model does, and
    radial_coeffs [..., C, 4] a fisheye. They get no gradient.

    rolling_shutter: a RollingShutterType, with which a pinhole reads its first row from viewmats and
    its last one from viewmats_rs [..., C, 4, 4]. It needs packed=False.

    Returns images [..., C, H, W, X], alphas [..., C, H, W, 1] and meta. The entries isect_ids,
    flatten_ids, isect_offsets and tiles_per_gauss of meta are computed when they are first read.
    """
    _refuse(
        distributed,
        global_z_order,
        return_normals,
        render_mode,
        with_ut=with_ut,
        with_eval3d=with_eval3d,
        rays=rays,
        ftheta_coeffs=ftheta_coeffs,
        lidar_coeffs=lidar_coeffs,
        external_distortion_coeffs=external_distortion_coeffs,
        ut_params=ut_params,
        renderer_config=renderer_config,
    )
    check(
        render_mode in _COLOR_MODES or render_mode in _DEPTH_MODES,
        f"render_mode {render_mode!r} is none of RGB, D, ED, RGB+D, RGB+ED",
    )
    check(
        rasterize_mode in ("classic", "antialiased"),
        f"rasterize_mode {rasterize_mode!r} is neither classic nor antialiased",
    )
    check(packed or not sparse_grad, "sparse_grad needs packed=True")
    width, height = integer("width", width), integer("height", height)
    tile_size = integer("tile_size", operators.TILE_SIZE if tile_size is None else tile_size)
    if sh_degree is not None:
        sh_degree = integer("sh_degree", sh_degree, 0, operators.MAX_SH_DEGREE)
    if extra_signals_sh_degree is not None:
        extra_signals_sh_degree = integer(
            "extra_signals_sh_degree", extra_signals_sh_degree, 0, operators.MAX_SH_DEGREE
        )
    order = order_of(rolling_shutter, viewmats_rs)
    coefficients = dict(
        radial_coeffs=radial_coeffs,
        tangential_coeffs=tangential_coeffs,
        thin_prism_coeffs=thin_prism_coeffs,
    )
    if order is not None:
        check_rolling(camera_model, packed, coefficients)
    scene = _Scene(means, quats, scales, covars, opacities, viewmats, Ks)
    options = project_options(
        width,
        height,
        eps2d,
        near_plane,
        far_plane,
        radius_clip,
        rasterize_mode == "antialiased",
        lens_of(camera_model, scene.dims, **coefficients),
    )
    if order is None:
        prints = project(scene.tensors, options, packed, sparse_grad)
    else:
        prints, scene.seen_along = project_rolling(
            scene.tensors, viewmats_rs, order, options, width, height
        )
    ids, (radii, means2d, depths, conics, factors) = (
        (prints[:4], prints[4:]) if packed else ((None,) * 4, prints)
    )
    opacities = scene.spread(scene.opacities, ids)
    if factors is not None:
        opacities = opacities * factors
    features, backgrounds, channels = _features(
        scene,
        ids,
        radii,
        depths,
        (colors, sh_degree) if render_mode in _COLOR_MODES else None,
        (extra_signals, extra_signals_sh_degree) if extra_signals is not None else None,
        render_mode in _DEPTH_MODES,
        backgrounds,
    )
    holder = attach_absgrad(means2d) if absgrad else None
    rows = scene.rows(ids)
    images = Images(scene.dims, rows, width, height, tile_size, holder, depths, radii)
    keep = needs_gradient(means2d, conics, opacities, features, backgrounds)
    image, alpha = Blend.apply(means2d, conics, opacities, features, backgrounds, images, keep)
    meta = _Meta(
        batch_ids=ids[0],
        camera_ids=ids[1],
        gaussian_ids=ids[2],
        radii=_dialect.radii_of(radii),
        means2d=means2d,
        depths=depths,
        conics=conics,
        opacities=opacities,
        tile_width=math.ceil(width / tile_size),
        tile_height=math.ceil(height / tile_size),
        width=width,
        height=height,
        tile_size=tile_size,
        n_batches=scene.batches,
        n_cameras=scene.cameras,
    )
    meta.footprints = radii, scene.dims
    image = _outputs(image, alpha, channels, render_mode, meta)
    return image, alpha, meta


def _refuse(
    distributed,
    global_z_order,
    return_normals,
    render_mode,
    renderer_config,
    **others,
):
    """Raises the error for what only gsplat's CUDA kernels do."""
    if renderer_config is not None:
        if not isinstance(renderer_config, RendererConfig):
            raise TypeError("renderer_config is no RendererConfig")
        known = (RendererConfig_MixedBatch, RendererConfig_ParallelBatch)
        if not isinstance(renderer_config, known):
            raise NotImplementedError(f"renderer_config {type(renderer_config).__name__}")
        if isinstance(renderer_config, known[1]) and not others["with_eval3d"]:
            raise ValueError("RendererConfig_ParallelBatch needs with_eval3d=True")
    for name, value in others.items():
        if value is not None and value is not False:
            raise unavailable(name)
    if distributed:
        raise unavailable("distributed=True")
    if not global_z_order:
        raise unavailable("global_z_order=False")
    if return_normals:
        raise unavailable("return_normals=True")
    if render_mode in _HIT_MODES:
        raise unavailable(f"render_mode {render_mode!r} (hit distance)")


class _Scene:
    """The checked tensors of a call, and how values of splats become values of footprints."""

    def __init__(self, means, quats, scales, covars, opacities, viewmats, Ks):
        means = tensor("means", means)
        if means.dim() < 2:
            raise mismatch("means", means, "[..., N, 3]")
        self.batch, self.splats = means.shape[:-2], means.shape[-2]
        own = self.batch + (self.splats,)
        shape("means", means, own + (3,))
        if covars is not None:
            covars = tensor("covars", covars)
            shape("covars", covars, own + (3, 3))
            quats, scales, covars = None, None, upper_triangle(covars)
        else:
            quats, scales = tensor("quats", quats), tensor("scales", scales)
            shape("quats", quats, own + (4,))
            shape("scales", scales, own + (3,))
            warn_of_raw("scales", scales, math.inf, "exp")
        self.opacities = tensor("opacities", opacities)
        shape("opacities", self.opacities, own)
        warn_of_raw("opacities", self.opacities, 1, "sigmoid")
        self.viewmats, Ks = tensor("viewmats", viewmats), tensor("Ks", Ks)
        self.cameras = cameras_of(self.viewmats)
        self.dims = self.batch + (self.cameras,)
        shape("viewmats", self.viewmats, self.dims + (4, 4))
        shape("Ks", Ks, self.dims + (3, 3))
        self.batches = math.prod(self.batch)
        check(self.batches > 0, f"means has shape {tuple(means.shape)}: a batch without scenes")
        self.means = means
        known = self.opacities.detach()
        self.tensors = (means, quats, scales, covars, self.viewmats, known, Ks)
        self._places = None
        self.seen_along = None  # directions through a rolling shutter

    def rows(self, ids):
        """The range of footprints of each image."""
        images = self.batches * self.cameras
        if ids[3] is None:
            return [(i * self.splats, (i + 1) * self.splats) for i in range(images)]
        bounds = ids[3].tolist()
        return list(zip(bounds, bounds[1:]))

    def _place(self, ids, per_view):
        """For each packed row, its place in the flattened [..., N] or [..., C, N]."""
        if self._places is None:
            batch, camera, splat = ids[:3]
            if self.batches == 1:
                self._places = (splat, camera * self.splats + splat)
            else:
                image = batch * self.cameras + camera
                self._places = (batch * self.splats + splat, image * self.splats + splat)
        return self._places[per_view]

    def spread(self, values, ids, per_view=False):
        """Values [..., N, ...], or [..., C, N, ...] per view, as values of footprints."""
        depth = len(self.batch)
        if ids[0] is not None:
            tail = values.shape[depth + 1 + per_view :]
            flat = values.reshape((-1,) + tail) if values.dim() > len(tail) + 1 else values
            return flat.index_select(0, self._place(ids, per_view))
        if per_view:
            return values
        values = values.unsqueeze(depth)
        return values.expand(values.shape[:depth] + (self.cameras,) + values.shape[depth + 1 :])

    def directions(self, ids):
        """From each camera to each footprint's splat."""
        if self.seen_along is not None:
            return self.seen_along
        offsets = camera_offsets(self.viewmats)
        if ids[0] is None:
            return self.means.unsqueeze(-3) + offsets.unsqueeze(-2)
        image = ids[1] if self.batches == 1 else ids[0] * self.cameras + ids[1]
        return self.spread(self.means, ids) + offsets.reshape(-1, 3).index_select(0, image)


def _features(scene, ids, radii, depths, color, extra, with_depth, backgrounds):
    """The channels to blend, their background, and the counts of colour and extra channels."""
    parts = []
    if color is not None:
        values = _channels(scene, ids, radii, "colors", *color)
        parts.append(values if color[1] is None else torch.clamp_min(values, 0.0))
    if extra is not None:
        parts.append(_channels(scene, ids, radii, "extra_signals", *extra))
    counts = [p.shape[-1] for p in parts]
    if with_depth:
        parts.append(depths.unsqueeze(-1))
    features = parts[0] if len(parts) == 1 else torch.cat(parts, -1)
    colors = counts[0] if color is not None else 0
    if backgrounds is not None:
        backgrounds = tensor("backgrounds", backgrounds)
        if color is None:
            backgrounds = None
        else:
            backgrounds = _background(scene, backgrounds, colors, sum(counts), features.shape[-1])
    return features, backgrounds, (colors, sum(counts) - colors)


def _background(scene, backgrounds, colors, signals, channels):
    """Backgrounds of the colours, widened by zeros for the channels after them."""
    given = backgrounds.shape[-1] if backgrounds.dim() else 0
    shape("backgrounds", backgrounds, scene.dims + (given if given == signals else colors,))
    if given == channels:
        return backgrounds
    return torch.cat((backgrounds, backgrounds.new_zeros(scene.dims + (channels - given,))), -1)


def _channels(scene, ids, radii, name, values, degree):
    """Colours or signals of footprints, where a degree is given by harmonics and their offset."""
    values = tensor(name, values)
    batch, splats, cameras = scene.batch, scene.splats, scene.cameras
    own, per_view = batch + (splats,), batch + (cameras, splats)
    if values.dim() < (len(own) + 1 if degree is None else 3):
        raise mismatch(name, values, "[..., N, D]" if degree is None else "[..., N, K, D]")
    if name == "colors" and not values.shape[-1]:
        raise mismatch(name, values, "at least one channel")
    if degree is None:
        viewed = values.shape[:-1] == per_view
        if not viewed:
            shape(name, values, own + values.shape[-1:])
        return scene.spread(values, ids, viewed)
    bands = values.shape[-2:]
    check(
        (degree + 1) ** 2 <= bands[0],
        f"{name} has shape {tuple(values.shape)}; degree {degree} needs {(degree + 1) ** 2} bands",
    )
    shared, viewed = values.shape[:-2] == (splats,), values.shape[:-2] == per_view
    if not shared and not viewed:
        shape(name, values, own + bands)
    one = ids[0] is not None and scene.batches * cameras == 1
    if one:
        # The coefficients stay where they are: a copy of some takes longer than the colours of all.
        values = values.reshape((splats,) + bands)
        masks = torch.zeros(splats, dtype=torch.bool).index_fill_(0, ids[2], True)
        # Selected, so that its gradient adds up row by row, as that of several images does.
        offset = camera_offsets(scene.viewmats).reshape(1, 3)
        dirs = scene.means.reshape(splats, 3) + offset.index_select(0, ids[2].new_zeros(splats))
    else:
        dirs, masks = scene.directions(ids), radii[..., 0] > 0 if ids[0] is None else None
        if not shared:
            values = scene.spread(values, ids, viewed)
        elif ids[0] is not None:
            values = values.index_select(0, ids[2])
    colors = evaluate(degree, dirs, values, masks) + operators.COLOR_OFFSET
    return colors.index_select(0, ids[2]) if one else colors


def _outputs(image, alpha, channels, mode, meta):
    """The image of the mode; extra signals go to meta."""
    colors, signals = channels
    if signals:
        meta["render_extra_signals"] = image[..., colors : colors + signals]
    if mode not in _DEPTH_MODES:
        return image[..., :colors] if signals else image
    if mode not in _EXPECTED_MODES and not signals:
        return image
    depth = image[..., -1:]
    if mode in _EXPECTED_MODES:
        depth = depth / alpha.clamp(min=1e-10)
    return torch.cat((image[..., :colors], depth), -1) if colors else depth


class _Meta(dict):
    """A dict whose entries about tiles are computed when they are first read."""

    _LATE = ("tiles_per_gauss", "isect_ids", "flatten_ids", "isect_offsets")
    _completed = False

    def __missing__(self, key):
        if key not in self._LATE or self._completed:
            raise KeyError(key)
        return dict.__getitem__(self._complete(), key)

    def _complete(self):
        if self._completed:
            return self
        radii, dims = self.footprints
        images, packed = math.prod(dims), self["gaussian_ids"] is not None
        columns, rows = self["tile_width"], self["tile_height"]
        image_ids = self["batch_ids"] * dims[-1] + self["camera_ids"] if packed else None
        counts, ids, splats = isect_tiles(
            self["means2d"].detach(),
            radii,
            self["depths"].detach(),
            self["tile_size"],
            columns,
            rows,
            packed=packed,
            n_images=images,
            image_ids=image_ids,
            gaussian_ids=self["gaussian_ids"],
            conics=self["conics"].detach(),
            opacities=self["opacities"].detach(),
        )
        offsets = isect_offset_encode(ids, images, columns, rows).reshape(dims + (rows, columns))
        self._completed = True
        for key, value in zip(self._LATE, (counts, ids, splats, offsets)):
            dict.setdefault(self, key, value)  # a value that the caller has set stays
        return self

    def __contains__(self, key):
        return dict.__contains__(self, key) or (key in self._LATE and not self._completed)

    def setdefault(self, key, default=None):
        return self[key] if key in self else dict.setdefault(self, key, default)

    def pop(self, key, *default):
        return dict.pop(self._complete() if key in self._LATE else self, key, *default)

    def __delitem__(self, key):
        dict.__delitem__(self._complete() if key in self._LATE else self, key)

    def get(self, key, default=None):
        return self[key] if key in self else default

    def __iter__(self):
        return dict.__iter__(self._complete())

    def __len__(self):
        return dict.__len__(self._complete())

    def keys(self):
        return dict.keys(self._complete())

    def values(self):
        return dict.values(self._complete())

    def items(self):
        return dict.items(self._complete())

    def copy(self):
        return dict(self)

    def __reduce__(self):
        return dict, (dict(self),)


rasterization_2dgs = refusal("rasterization_2dgs", "2D Gaussian splatting")
rasterization_2dgs_inria_wrapper = refusal("rasterization_2dgs_inria_wrapper", "Inria's renderer")
rasterization_inria_wrapper = refusal("rasterization_inria_wrapper", "Inria's renderer")
