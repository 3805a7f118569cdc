# SPDX-License-Identifier: Apache-2.0
"""nerfstudio's Splatfacto on ewa, on any device: an example to copy, for nerfstudio 1.1.5.

export NERFSTUDIO_METHOD_CONFIGS="splatfacto-ewa=splatfacto:splatfacto_ewa"
export PYTHONPATH=examples/python
ns-train splatfacto-ewa --data DATA
"""

import contextlib
from dataclasses import dataclass, field
from typing import Type

import torch

import ewa.gsplat

# Before nerfstudio imports gsplat. It is written for gsplat 1.4: radii are one number a splat.
ewa.gsplat.install()
ewa.gsplat.dialect("1.4")

from nerfstudio.configs.base_config import MachineConfig, ViewerConfig
from nerfstudio.configs.method_configs import method_configs
from nerfstudio.models.splatfacto import SplatfactoModel, SplatfactoModelConfig
from nerfstudio.plugins.types import MethodSpecification


@contextlib.contextmanager
def cuda_calls_do_nothing():
    """Splatfacto moves its first coefficients to CUDA, whatever the device is."""
    original = torch.Tensor.cuda
    torch.Tensor.cuda = lambda self, *args, **kwargs: self
    try:
        yield
    finally:
        torch.Tensor.cuda = original


class EwaSplatfactoModel(SplatfactoModel):
    def populate_modules(self):
        with cuda_calls_do_nothing():
            super().populate_modules()


@dataclass
class EwaSplatfactoModelConfig(SplatfactoModelConfig):
    _target: Type = field(default_factory=lambda: EwaSplatfactoModel)


def _config():
    config = method_configs["splatfacto"]
    config.method_name = "splatfacto-ewa"
    config.machine = MachineConfig(device_type="cpu")
    config.pipeline.model = EwaSplatfactoModelConfig()
    config.viewer = ViewerConfig(num_rays_per_chunk=1 << 15, quit_on_train_completion=True)
    return config


splatfacto_ewa = MethodSpecification(_config(), description="Splatfacto on ewa's renderer")
