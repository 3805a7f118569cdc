# SPDX-License-Identifier: Apache-2.0
"""The hooks of a strategy."""

from collections.abc import MutableMapping
from dataclasses import dataclass
from typing import Any, Union

import torch

from .._arguments import check

# A dict, or a ParameterDict, which is none to type checkers.
Parameters = Union[MutableMapping[str, torch.nn.Parameter], torch.nn.ParameterDict]
Optimizers = MutableMapping[str, torch.optim.Optimizer]


@dataclass
class Strategy:
    """Changes the number of splats between steps: hooks before and after the backward pass."""

    def check_sanity(self, params: Parameters, optimizers: Optimizers) -> None:
        """Raises an error unless each trained parameter has an optimizer with one group."""
        trained = {name for name, p in params.items() if p.requires_grad}
        check(
            trained == set(optimizers),
            f"trained parameters {sorted(trained)} and optimizers {sorted(optimizers)} differ",
        )
        for name, optimizer in optimizers.items():
            groups = len(optimizer.param_groups)
            check(groups == 1, f"the optimizer of {name} has {groups} groups; expected 1")

    def _check_names(self, params):
        for name in ("means", "scales", "quats", "opacities"):
            check(name in params, f"params has no {name!r}")

    def step_pre_backward(self, *args: Any, **kwargs: Any) -> None:
        """Called before loss.backward()."""

    def step_post_backward(self, *args: Any, **kwargs: Any) -> None:
        """Called after loss.backward()."""
