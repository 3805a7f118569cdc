# SPDX-License-Identifier: Apache-2.0
"""Changes of splats in place, with the state of their optimizers.

`params` are parameters by name with one row a splat; `state` are running values of a strategy, of
which tensors have one row a splat too. Scales are logarithms and opacities logits.
"""

from typing import Any

import torch
import torch.nn.functional as F
from torch import Tensor

from ..._native import operators
from .._geometry import normalized_quat_to_rotmat
from ..relocation import compute_relocation
from .base import Optimizers, Parameters


def _multinomial_sample(weights, n, replacement=True):
    """`n` indices, each drawn in proportion to its weight; any number of weights."""
    if not replacement:
        return torch.multinomial(weights, n, replacement=False)
    sums = weights.double().cumsum(0)
    drawn = torch.rand(n, dtype=torch.float64) * sums[-1]
    return torch.searchsorted(sums, drawn, right=True).clamp(max=len(weights) - 1)


@torch.no_grad()
def _update_param_with_optimizer(param_fn, optimizer_fn, params, optimizers, names=None):
    """Replaces parameters by param_fn(name, p) and moments by optimizer_fn(key, value)."""
    for name in list(params.keys()) if names is None else names:
        old = params[name]
        new = param_fn(name, old)
        params[name] = new
        optimizer = optimizers.get(name)
        if optimizer is None:
            if old.requires_grad:
                raise AssertionError(f"{name} is trained but has no optimizer")
            continue
        values = optimizer.state.pop(old, {})
        for key, value in values.items():
            if key != "step":
                values[key] = optimizer_fn(key, value)
        for group in optimizer.param_groups:
            group["params"] = [new]
        if values:
            optimizer.state[new] = values


def _parameter(value, old):
    return torch.nn.Parameter(value, requires_grad=old.requires_grad)


def _rows_of_zeros(like, count):
    return like.new_zeros((count,) + like.shape[1:])


def _update_state(state, change):
    for key, value in state.items():
        if isinstance(value, torch.Tensor):
            state[key] = change(value)


@torch.no_grad()
def duplicate(
    params: Parameters, optimizers: Optimizers, state: dict[str, Any], mask: Tensor
) -> None:
    """Appends a copy of the splats of `mask`."""
    chosen = mask.nonzero()[:, 0]
    count = len(chosen)
    _update_param_with_optimizer(
        lambda name, p: _parameter(torch.cat((p, p[chosen])), p),
        lambda key, v: torch.cat((v, _rows_of_zeros(v, count))),
        params,
        optimizers,
    )
    _update_state(state, lambda v: torch.cat((v, v[chosen])))


@torch.no_grad()
def split(
    params: Parameters,
    optimizers: Optimizers,
    state: dict[str, Any],
    mask: Tensor,
    revised_opacity: bool = False,
) -> None:
    """Replaces each splat of `mask` by two smaller ones, drawn from its distribution.

    `revised_opacity` lowers the opacity so that the two together look as the one did.
    """
    chosen, rest = mask.nonzero()[:, 0], (~mask).nonzero()[:, 0]
    count = len(chosen)
    scales = torch.exp(params["scales"][chosen])
    rotations = normalized_quat_to_rotmat(F.normalize(params["quats"][chosen], dim=-1))
    local = torch.randn(2, count, 3) * scales
    moves = (rotations @ local[..., None])[..., 0]

    def halves(name, p):
        own = p[chosen]
        if name == "means":
            both = (own + moves).flatten(0, 1)
        elif name == "scales":
            both = torch.log(scales / operators.SPLIT_SCALE).repeat(2, 1)
        elif name == "opacities" and revised_opacity:
            alpha = 1.0 - torch.sqrt(1.0 - torch.sigmoid(own))
            both = torch.cat((torch.logit(alpha),) * 2)
        else:
            both = torch.cat((own, own))
        return _parameter(torch.cat((p[rest], both)), p)

    _update_param_with_optimizer(
        halves,
        lambda key, v: torch.cat((v[rest], _rows_of_zeros(v, 2 * count))),
        params,
        optimizers,
    )
    _update_state(state, lambda v: torch.cat((v[rest], v[chosen], v[chosen])))


@torch.no_grad()
def remove(params: Parameters, optimizers: Optimizers, state: dict[str, Any], mask: Tensor) -> None:
    """Removes the splats of `mask`."""
    kept = (~mask).nonzero()[:, 0]
    _update_param_with_optimizer(
        lambda name, p: _parameter(p[kept], p), lambda key, v: v[kept], params, optimizers
    )
    _update_state(state, lambda v: v[kept])


@torch.no_grad()
def reset_opa(
    params: Parameters, optimizers: Optimizers, state: dict[str, Any], value: float
) -> None:
    """Lowers opacities to at most `value` and forgets their moments."""
    limit = torch.logit(torch.tensor(value, dtype=torch.float64)).item()
    _update_param_with_optimizer(
        lambda name, p: _parameter(torch.clamp(p, max=limit), p),
        lambda key, v: torch.zeros_like(v),
        params,
        optimizers,
        names=["opacities"],
    )


def _relocated(params, chosen, binoms, min_opacity):
    """Logits and log scales with which each chosen splat makes room for those drawn from it."""
    opacities = torch.sigmoid(params["opacities"])
    copies = torch.bincount(chosen, minlength=len(opacities))[chosen] + 1
    flat, scales = compute_relocation(
        opacities[chosen].flatten(),
        torch.exp(params["scales"][chosen]),
        copies,
        binoms,
        min_opacity,
    )
    return torch.logit(flat).reshape(opacities[chosen].shape), torch.log(scales)


def _set_relocated(name, p, chosen, logits, log_scales):
    if name == "opacities":
        p[chosen] = logits
    elif name == "scales":
        p[chosen] = log_scales


@torch.no_grad()
def relocate(
    params: Parameters,
    optimizers: Optimizers,
    state: dict[str, Any],
    mask: Tensor,
    binoms: Tensor,
    min_opacity: float = 0.005,
) -> None:
    """Moves the dead splats of `mask` onto living ones, drawn in proportion to opacity."""
    dead, living = mask.nonzero()[:, 0], (~mask).nonzero()[:, 0]
    if not len(dead) or not len(living):
        return
    weights = torch.sigmoid(params["opacities"][living]).flatten()
    chosen = living[_multinomial_sample(weights, len(dead))]
    logits, log_scales = _relocated(params, chosen, binoms, min_opacity)

    def moved(name, p):
        new = p.detach().clone()
        _set_relocated(name, new, chosen, logits, log_scales)
        new[dead] = new[chosen]
        return _parameter(new, p)

    def forgotten(v):
        # Both ends of a move start anew: neither is where its moments were gathered.
        v[chosen] = 0
        v[dead] = 0
        return v

    _update_param_with_optimizer(moved, lambda key, v: forgotten(v), params, optimizers)
    _update_state(state, forgotten)


@torch.no_grad()
def sample_add(
    params: Parameters,
    optimizers: Optimizers,
    state: dict[str, Any],
    n: int,
    binoms: Tensor,
    min_opacity: float = 0.005,
) -> None:
    """Adds `n` splats onto living ones, drawn in proportion to opacity."""
    chosen = _multinomial_sample(torch.sigmoid(params["opacities"]).flatten(), n)
    logits, log_scales = _relocated(params, chosen, binoms, min_opacity)

    def grown(name, p):
        new = p.detach().clone()
        _set_relocated(name, new, chosen, logits, log_scales)
        return _parameter(torch.cat((new, new[chosen])), p)

    def longer(v):
        v[chosen] = 0
        return torch.cat((v, _rows_of_zeros(v, n)))

    _update_param_with_optimizer(grown, lambda key, v: longer(v), params, optimizers)
    _update_state(state, longer)


@torch.no_grad()
def inject_noise_to_position(
    params: Parameters,
    optimizers: Optimizers,
    state: dict[str, Any],
    scaler: float,
    t: float = operators.MCMC_GATE_OPACITY,
    k: float = operators.MCMC_GATE_SLOPE,
) -> None:
    """Moves each mean by noise of its own covariance; splats more opaque than `t` barely move."""
    opacities = torch.sigmoid(params["opacities"].flatten())
    rotations = normalized_quat_to_rotmat(F.normalize(params["quats"], dim=-1))
    noise = (
        torch.randn_like(params["means"]) * (torch.sigmoid(k * (t - opacities)) * scaler)[:, None]
    )
    local = (rotations.transpose(-1, -2) @ noise[..., None])[..., 0]
    local = local * torch.exp(2.0 * params["scales"])
    params["means"].add_((rotations @ local[..., None])[..., 0])
