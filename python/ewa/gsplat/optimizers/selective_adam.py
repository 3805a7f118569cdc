# SPDX-License-Identifier: Apache-2.0
"""Adam over the rows of visible splats."""

from typing import Any

import torch
from torch import Tensor

from .._arguments import check


@torch.no_grad()
def adam(
    param: Tensor,
    param_grad: Tensor,
    exp_avg: Tensor,
    exp_avg_sq: Tensor,
    valid: Tensor | None,
    lr: float,
    b1: float,
    b2: float,
    eps: float,
) -> None:
    """One Adam step, without bias correction, of the rows where `valid` is set (None: all)."""
    rows = slice(None) if valid is None else valid.reshape(-1).nonzero()[:, 0]
    gradient = param_grad[rows]
    first = exp_avg[rows].mul_(b1).add_(gradient, alpha=1 - b1)
    second = exp_avg_sq[rows].mul_(b2).addcmul_(gradient, gradient, value=1 - b2)
    exp_avg[rows], exp_avg_sq[rows] = first, second
    param[rows] = param[rows].addcdiv_(first, second.sqrt().add_(eps), value=-lr)


class SelectiveAdam(torch.optim.Adam):
    """Adam whose step takes a mask [N] of visible splats. Each group holds one tensor [N, ...]."""

    def __init__(self, params: Any, eps: float, betas: tuple[float, float]) -> None:
        super().__init__(params=params, eps=eps, betas=betas)

    @torch.no_grad()
    def step(self, visibility: Tensor) -> None:
        for group in self.param_groups:
            check(len(group["params"]) == 1, "a group of SelectiveAdam holds one tensor")
            param = group["params"][0]
            if param.grad is None:
                continue
            state = self.state[param]
            if not state:
                state["step"] = torch.tensor(0.0)
                state["exp_avg"] = torch.zeros_like(param)
                state["exp_avg_sq"] = torch.zeros_like(param)
            adam(
                param,
                param.grad,
                state["exp_avg"],
                state["exp_avg_sq"],
                visibility,
                group["lr"],
                *group["betas"],
                group["eps"],
            )
