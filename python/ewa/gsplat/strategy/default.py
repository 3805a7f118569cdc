# SPDX-License-Identifier: Apache-2.0
"""Adaptive density control after Kerbl et al., "3D Gaussian Splatting", 2023, section 5."""

from dataclasses import dataclass
from typing import Any

import torch

from .._arguments import check
from .base import Optimizers, Parameters, Strategy
from .ops import duplicate, remove, reset_opa, split


@dataclass
class DefaultStrategy(Strategy):
    """Clones small splats and splits large ones where the image pulls at them; prunes faint ones.

    The pull is the mean norm of the gradient of means2d, in half images, over the views that see
    the splat since the last refinement. With `absgrad` it is that of absolute gradients (Ye et
    al. 2024), and rasterization needs absgrad=True as well.
    """

    prune_opa: float = 0.005
    grow_grad2d: float = 0.0002
    grow_scale3d: float = 0.01
    grow_scale2d: float = 0.05
    prune_scale3d: float = 0.1
    prune_scale2d: float = 0.15
    refine_scale2d_stop_iter: int = 0
    refine_start_iter: int = 500
    refine_stop_iter: int = 15_000
    reset_every: int = 3000
    refine_every: int = 100
    pause_refine_after_reset: int = 0
    absgrad: bool = False
    revised_opacity: bool = False
    verbose: bool = False
    key_for_gradient: str = "means2d"

    def initialize_state(self, scene_scale: float = 1.0) -> dict[str, Any]:
        """The running values: sums of pulls, numbers of views, and largest radii where used."""
        state = {"grad2d": None, "count": None, "scene_scale": scene_scale}
        if self.refine_scale2d_stop_iter > 0:
            state["radii"] = None
        return state

    def check_sanity(self, params: Parameters, optimizers: Optimizers) -> None:
        """Raises an error where parameters or optimizers are not as the strategy needs them."""
        super().check_sanity(params, optimizers)
        self._check_names(params)

    def step_pre_backward(
        self,
        params: Parameters,
        optimizers: Optimizers,
        state: dict[str, Any],
        step: int,
        info: dict[str, Any],
    ) -> None:
        """Called before loss.backward(): asks for the gradient of the projected means."""
        check(self.key_for_gradient in info, f"info has no {self.key_for_gradient!r}")
        info[self.key_for_gradient].retain_grad()

    def step_post_backward(
        self,
        params: Parameters,
        optimizers: Optimizers,
        state: dict[str, Any],
        step: int,
        info: dict[str, Any],
        packed: bool = False,
    ) -> None:
        """Called after loss.backward(): gathers the pulls and, when it is time, refines."""
        if step >= self.refine_stop_iter:
            return
        self._update_state(params, state, info, packed)
        if (
            step > self.refine_start_iter
            and step % self.refine_every == 0
            and step % self.reset_every >= self.pause_refine_after_reset
        ):
            cloned, parted = self._grow_gs(params, optimizers, state, step)
            pruned = self._prune_gs(params, optimizers, state, step)
            if self.verbose:
                print(
                    f"step {step}: {cloned} cloned, {parted} split, {pruned} pruned: "
                    f"{len(params['means'])} splats"
                )
            for name in ("grad2d", "count", "radii"):
                if state.get(name) is not None:
                    state[name].zero_()
        if step > 0 and step % self.reset_every == 0:
            reset_opa(params, optimizers, state, self.prune_opa * 2.0)

    @torch.no_grad()
    def _update_state(self, params, state, info, packed=False):
        means2d = info[self.key_for_gradient]
        gradient = getattr(means2d, "absgrad", None) if self.absgrad else means2d.grad
        needed = "rasterization(absgrad=True)" if self.absgrad else "step_pre_backward"
        check(
            gradient is not None,
            f"{self.key_for_gradient} has no {'absgrad' if self.absgrad else 'grad'}: "
            f"DefaultStrategy(absgrad={self.absgrad}) needs {needed} before loss.backward()",
        )
        width, height, cameras = info["width"], info["height"], info["n_cameras"]
        x, y = gradient.unbind(-1)
        pull = torch.hypot(x * (0.5 * width * cameras), y * (0.5 * height * cameras))
        count = len(next(iter(params.values())))
        for name in ("grad2d", "count"):
            if state[name] is None:
                state[name] = pull.new_zeros(count)
        radii = info["radii"]
        radii = radii.amax(-1) if radii.dim() > pull.dim() else radii
        if packed:
            splats = info["gaussian_ids"].long()
            state["grad2d"].index_add_(0, splats, pull)
            state["count"].index_add_(0, splats, torch.ones_like(pull))
        else:
            pull, radii = pull.reshape(-1, count), radii.reshape(-1, count)
            seen = radii > 0
            # The gradient of a splat that a view does not see is zero.
            state["grad2d"] += pull[0] if len(pull) == 1 else pull.sum(0)
            state["count"] += seen[0] if len(seen) == 1 else seen.sum(0)
        if self.refine_scale2d_stop_iter > 0:
            share = radii / float(max(width, height))
            if state["radii"] is None:
                state["radii"] = pull.new_zeros(count)
            if packed:
                largest = torch.zeros(count).scatter_reduce_(0, splats, share, "amax")
            else:
                largest = share.amax(0)
            torch.maximum(state["radii"], largest, out=state["radii"])

    @torch.no_grad()
    def _grow_gs(self, params, optimizers, state, step):
        """Clones and splits; returns the number of each."""
        pulled = state["grad2d"] / state["count"].clamp_min(1) > self.grow_grad2d
        size = torch.exp(params["scales"].amax(-1))
        small = size <= self.grow_scale3d * state["scene_scale"]
        cloned, parted = pulled & small, pulled & ~small
        if step < self.refine_scale2d_stop_iter:
            parted |= state["radii"] > self.grow_scale2d
        clones, parts = int(cloned.sum()), int(parted.sum())
        if clones:
            duplicate(params, optimizers, state, cloned)
        if parts:
            # New clones keep their size.
            parted = torch.cat((parted, parted.new_zeros(clones)))
            split(params, optimizers, state, parted, self.revised_opacity)
        return clones, parts

    @torch.no_grad()
    def _prune_gs(self, params, optimizers, state, step):
        """Removes faint splats, and large ones after the first reset; returns their number."""
        pruned = torch.sigmoid(params["opacities"].flatten()) < self.prune_opa
        if step > self.reset_every:
            size = torch.exp(params["scales"].amax(-1))
            pruned |= size > self.prune_scale3d * state["scene_scale"]
            if step < self.refine_scale2d_stop_iter:
                pruned |= state["radii"] > self.prune_scale2d
        count = int(pruned.sum())
        if count:
            remove(params, optimizers, state, pruned)
        return count
