# SPDX-License-Identifier: Apache-2.0
"""Splats as samples after Kheradmand et al., "3D Gaussian Splatting as MCMC", 2024."""

import math
from dataclasses import dataclass
from typing import Any

import torch

from ..._native import operators
from .base import Optimizers, Parameters, Strategy
from .ops import inject_noise_to_position, relocate, sample_add

# The most splats that may come to stand on one, with the one itself.
_MOST_COPIES = 51
_GROWTH = 1.05


@dataclass
class MCMCStrategy(Strategy):
    """Moves dead splats onto living ones, adds 5% at a time up to `cap_max`, and adds noise."""

    cap_max: int = 1_000_000
    noise_lr: float = 5e5
    refine_start_iter: int = 500
    refine_stop_iter: int = 25_000
    noise_injection_stop_iter: int = -1
    refine_every: int = 100
    min_opacity: float = 0.005
    verbose: bool = False
    noise_opacity_t: float = operators.MCMC_GATE_OPACITY
    noise_opacity_k: float = operators.MCMC_GATE_SLOPE

    def initialize_state(self) -> dict[str, Any]:
        """The table of binomial coefficients that relocation needs."""
        rows = [[math.comb(n, k) for k in range(_MOST_COPIES)] for n in range(_MOST_COPIES)]
        return {"binoms": torch.tensor(rows, dtype=torch.float32)}

    def check_sanity(self, params: Parameters, optimizers: Optimizers) -> None:
        """Raises an error where parameters or optimizers are not as the strategy needs them."""
        super().check_sanity(params, optimizers)
        self._check_names(params)

    def step_post_backward(
        self,
        params: Parameters,
        optimizers: Optimizers,
        state: dict[str, Any],
        step: int,
        info: dict[str, Any],
        lr: float,
    ) -> None:
        """Called after loss.backward(). `lr` is the learning rate of the means."""
        if self.refine_start_iter < step < self.refine_stop_iter and step % self.refine_every == 0:
            moved = self._relocate_gs(params, optimizers, state["binoms"])
            added = self._add_new_gs(params, optimizers, state["binoms"])
            if self.verbose:
                print(f"step {step}: {moved} moved, {added} added: {len(params['means'])} splats")
        if self.noise_injection_stop_iter < 0 or step < self.noise_injection_stop_iter:
            inject_noise_to_position(
                params,
                optimizers,
                {},
                lr * self.noise_lr,
                self.noise_opacity_t,
                self.noise_opacity_k,
            )

    @torch.no_grad()
    def _relocate_gs(self, params, optimizers, binoms):
        dead = torch.sigmoid(params["opacities"].flatten()) <= self.min_opacity
        count = int(dead.sum())
        if count:
            relocate(params, optimizers, {}, dead, binoms, self.min_opacity)
        return count

    @torch.no_grad()
    def _add_new_gs(self, params, optimizers, binoms):
        now = len(params["means"])
        count = max(0, min(self.cap_max, int(_GROWTH * now)) - now)
        if count:
            sample_add(params, optimizers, {}, count, binoms, self.min_opacity)
        return count
