# SPDX-License-Identifier: Apache-2.0
"""3D Gaussian splatting on any Vulkan device, a plain CPU included. docs/python.md describes the package."""

from . import _native
from ._errors import DeviceError, InputError
from ._native import (
    Dataset,
    DeviceInfo,
    EvalFrame,
    Evaluation,
    Frame,
    Images,
    Mesh,
    Renderer,
    Renders,
    Splats,
    StepReport,
    Trainer,
    __version__,
    current_device,
    devices,
    evaluate,
    find_cameras,
    join,
    load,
    load_image,
    mesh,
    metrics,
    render,
    save,
    save_image,
    set_device,
)
from ._signatures import add_signatures

add_signatures(_native)
del add_signatures

__all__ = [
    "Dataset",
    "DeviceError",
    "DeviceInfo",
    "EvalFrame",
    "Evaluation",
    "Frame",
    "Images",
    "InputError",
    "Mesh",
    "Renderer",
    "Renders",
    "Splats",
    "StepReport",
    "Trainer",
    "__version__",
    "current_device",
    "devices",
    "evaluate",
    "find_cameras",
    "join",
    "load",
    "load_image",
    "mesh",
    "metrics",
    "render",
    "save",
    "save_image",
    "set_device",
]
