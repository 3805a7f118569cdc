# SPDX-License-Identifier: Apache-2.0
"""gsplat's Python API on any Vulkan device, with torch tensors on the CPU.

`from ewa.gsplat import rasterization, DefaultStrategy`. A script that says `import gsplat` runs
unchanged under `python -m ewa.gsplat script.py`, or after ewa.gsplat.install().
"""

import importlib
import os
import sys

if "torch" not in sys.modules:
    # Otherwise torch's threads spin after each operation, on the cores that a CPU device needs.
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")

try:
    importlib.import_module("torch")
except ModuleNotFoundError as error:
    if error.name != "torch":
        raise
    raise ImportError(
        "ewa.gsplat needs PyTorch: pip install torch", name="torch"
    ) from None

from ._dialect import dialect
from .compression import PngCompression
from .cuda._wrapper import (
    RollingShutterType,
    accumulate,
    accumulate_2dgs,
    fully_fused_projection,
    fully_fused_projection_2dgs,
    fully_fused_projection_with_ut,
    has_2dgs,
    has_3dgs,
    has_3dgut,
    has_adam,
    has_camera_wrappers,
    has_losses,
    has_reloc,
    isect_offset_encode,
    isect_tiles,
    proj,
    quat_scale_to_covar_preci,
    rasterize_to_indices_in_range,
    rasterize_to_indices_in_range_2dgs,
    rasterize_to_pixels,
    rasterize_to_pixels_2dgs,
    rasterize_to_pixels_eval3d,
    spherical_harmonics,
    spherical_harmonics_l0,
    spherical_harmonics_l1_plus,
    world_to_cam,
)
from .exporter import export_splats
from .optimizers import SelectiveAdam
from .rendering import (
    RendererConfig,
    RendererConfig_MixedBatch,
    RendererConfig_ParallelBatch,
    rasterization,
    rasterization_2dgs,
    rasterization_2dgs_inria_wrapper,
    rasterization_inria_wrapper,
)
from .strategy import DefaultStrategy, MCMCStrategy, Strategy
from .version import __version__

__all__ = [
    "DefaultStrategy",
    "MCMCStrategy",
    "PngCompression",
    "RendererConfig",
    "RendererConfig_MixedBatch",
    "RendererConfig_ParallelBatch",
    "RollingShutterType",
    "SelectiveAdam",
    "Strategy",
    "__version__",
    "accumulate",
    "accumulate_2dgs",
    "dialect",
    "export_splats",
    "fully_fused_projection",
    "fully_fused_projection_2dgs",
    "fully_fused_projection_with_ut",
    "has_2dgs",
    "has_3dgs",
    "has_3dgut",
    "has_adam",
    "has_camera_wrappers",
    "has_losses",
    "has_reloc",
    "install",
    "isect_offset_encode",
    "isect_tiles",
    "proj",
    "quat_scale_to_covar_preci",
    "rasterization",
    "rasterization_2dgs",
    "rasterization_2dgs_inria_wrapper",
    "rasterization_inria_wrapper",
    "rasterize_to_indices_in_range",
    "rasterize_to_indices_in_range_2dgs",
    "rasterize_to_pixels",
    "rasterize_to_pixels_2dgs",
    "rasterize_to_pixels_eval3d",
    "spherical_harmonics",
    "spherical_harmonics_l0",
    "spherical_harmonics_l1_plus",
    "world_to_cam",
]

_SUBMODULES = (
    "compression",
    "cuda",
    "cuda._constants",
    "cuda._torch_impl",
    "cuda._wrapper",
    "distributed",
    "exporter",
    "optimizers",
    "optimizers.selective_adam",
    "relocation",
    "rendering",
    "strategy",
    "strategy.base",
    "strategy.default",
    "strategy.mcmc",
    "strategy.ops",
    "utils",
    "version",
)


def install() -> None:
    """Lets `import gsplat`, and its modules, mean this package for the rest of the process."""
    known = sys.modules.get("gsplat")
    if known is not None and known is not sys.modules[__name__]:
        raise RuntimeError("gsplat is imported already; call ewa.gsplat.install() before")
    sys.modules["gsplat"] = sys.modules[__name__]
    for name in _SUBMODULES:
        sys.modules[f"gsplat.{name}"] = importlib.import_module(f"{__name__}.{name}")
