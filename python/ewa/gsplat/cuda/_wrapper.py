# SPDX-License-Identifier: Apache-2.0
"""The lower functions under the names that gsplat.cuda._wrapper has."""

import warnings

from .._arguments import refusal
from .._blending import rasterize_to_pixels
from .._geometry import proj, quat_scale_to_covar_preci, world_to_cam
from .._harmonics import (
    spherical_harmonics,
    spherical_harmonics_l0,
    spherical_harmonics_l1_plus,
)
from .._projection import fully_fused_projection
from .._tiles import (
    accumulate,
    isect_offset_encode,
    isect_tiles,
    rasterize_to_indices_in_range,
)
from ..optimizers.selective_adam import adam
from ..rendering import RollingShutterType


def persp_proj(means, covars, Ks, width, height):
    """Deprecated: proj with camera_model="pinhole"."""
    warnings.warn("persp_proj is deprecated; use proj", DeprecationWarning, stacklevel=2)
    return proj(means, covars, Ks, width, height)


def has_3dgs() -> bool:
    return True


def has_adam() -> bool:
    return True


def has_reloc() -> bool:
    return True


def has_2dgs() -> bool:
    return False


def has_3dgut() -> bool:
    return False


def has_camera_wrappers() -> bool:
    return False


def has_losses() -> bool:
    return False


_2DGS, _3DGUT, _SPARSE = "2D Gaussian splatting", "3DGUT", "rendering of single pixels"
fully_fused_projection_2dgs = refusal("fully_fused_projection_2dgs", _2DGS)
rasterize_to_pixels_2dgs = refusal("rasterize_to_pixels_2dgs", _2DGS)
rasterize_to_indices_in_range_2dgs = refusal("rasterize_to_indices_in_range_2dgs", _2DGS)
accumulate_2dgs = refusal("accumulate_2dgs", _2DGS)
fully_fused_projection_with_ut = refusal("fully_fused_projection_with_ut", _3DGUT)
rasterize_to_pixels_eval3d = refusal("rasterize_to_pixels_eval3d", _3DGUT)
rasterize_to_pixels_eval3d_extra = refusal("rasterize_to_pixels_eval3d_extra", _3DGUT)
isect_tiles_lidar = refusal("isect_tiles_lidar", "lidar")
isect_tiles_sparse = refusal("isect_tiles_sparse", _SPARSE)
build_sparse_tile_layout = refusal("build_sparse_tile_layout", _SPARSE)
rasterize_to_pixels_sparse = refusal("rasterize_to_pixels_sparse", _SPARSE)
rasterize_num_contributing_gaussians = refusal(
    "rasterize_num_contributing_gaussians", "contributing ids"
)
rasterize_contributing_gaussian_ids = refusal(
    "rasterize_contributing_gaussian_ids", "contributing ids"
)
rasterize_top_contributing_gaussian_ids = refusal(
    "rasterize_top_contributing_gaussian_ids", "contributing ids"
)
