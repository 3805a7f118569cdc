# SPDX-License-Identifier: Apache-2.0
"""Checks of arguments: device, type and shape of tensors, and what ewa does not have."""

import functools
import math
import operator
import sys
import warnings
from collections.abc import Callable
from typing import NoReturn

import numpy as np
import torch
from torch import Tensor

_warned_of_double = False
_warned_of_raw = set()  # names, each with the function that called


class ArgumentError(ValueError, AssertionError, RuntimeError):
    """A wrong argument. gsplat's functions assert such conditions, or its kernels check them."""


def check(condition, message):
    if not condition:
        raise ArgumentError(message)


def tensor(name, value):
    """`value` as a float32 tensor in the memory of the CPU; the gradient flows through the cast."""
    if not isinstance(value, Tensor):
        raise TypeError(f"{name} is a {type(value).__name__}; expected a torch.Tensor")
    if value.device.type != "cpu":
        raise TypeError(
            f"{name} is on {value.device}; ewa takes tensors on the CPU: pass {name}.cpu()"
        )
    if value.dtype is torch.float32:
        return value
    if value.dtype.is_complex:
        raise TypeError(f"{name} is complex; ewa takes real numbers")
    if value.dtype is torch.float64:
        _warn_of_double(name)
    return value.float()


def _warn_of_double(name):
    global _warned_of_double
    if not _warned_of_double:
        _warned_of_double = True
        warnings.warn(f"{name} is float64; ewa computes in float32", stacklevel=4)


def warn_of_raw(name, value, most, function):
    """Warns of values that `function` was not applied to: once in each caller of rasterization.

    For rasterization's own callees.
    """
    place = name, sys._getframe(3).f_code
    if place in _warned_of_raw or not value.numel():
        return
    low, high = value.detach().aminmax()
    if low < 0 or high > most:
        _warned_of_raw.add(place)
        wrong = f"above {most}" if high > most else "below 0" if most < math.inf else "are negative"
        warnings.warn(f"{name} {wrong}: pass torch.{function}({name})", stacklevel=4)


def shape(name, value, expected):
    if tuple(value.shape) != tuple(expected):
        raise ArgumentError(f"{name} has shape {tuple(value.shape)}; expected {tuple(expected)}")


def mismatch(name, value, expected):
    """The error for a tensor without the dimensions that `expected` describes."""
    return ArgumentError(f"{name} has shape {tuple(value.shape)}; expected {expected}")


_LARGEST = 2**31 - 1  # what the device counts with


def integer(name, value, low=1, high=_LARGEST):
    """`value` as an int from `low` to `high`."""
    try:
        value = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} is {value!r}; expected an integer") from None
    check(low <= value <= high, f"{name} is {value}; expected {low} to {high}")
    return value


def full_precision(function):
    """The function without autocast: products of half precision place splats some pixels off."""

    @functools.wraps(function)
    def run(*args, **kwargs):
        with torch.autocast("cpu", enabled=False):
            return function(*args, **kwargs)

    return run


def array(value):
    """The numpy view of a tensor, or None."""
    return None if value is None else value.detach().numpy()


def bytes_of(mask):
    """A mask as the uint8 array that the device takes."""
    return (mask.detach().numpy() != 0).view(np.uint8)


def unavailable(what):
    """The error for what gsplat has in CUDA alone."""
    return NotImplementedError(
        f"{what} is CUDA-only; ewa renders 3D Gaussians through pinhole, ortho and fisheye cameras,"
        " with coefficients of their lenses too"
    )


def refusal(name: str, what: str) -> Callable[..., NoReturn]:
    """A function of gsplat's name that says why it cannot run."""

    def refuse(*args: object, **kwargs: object) -> NoReturn:
        raise unavailable(f"{name} ({what})")

    refuse.__name__ = refuse.__qualname__ = name
    refuse.__doc__ = f"Not available: {what} is CUDA-only."
    return refuse
