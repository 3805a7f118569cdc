# SPDX-License-Identifier: Apache-2.0
"""Optimizers that update the splats of a step alone."""

from .selective_adam import SelectiveAdam
