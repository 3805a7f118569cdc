# SPDX-License-Identifier: Apache-2.0
"""Strategies that add and remove splats during training."""

from .base import Strategy
from .default import DefaultStrategy
from .mcmc import MCMCStrategy
