# SPDX-License-Identifier: Apache-2.0
"""LPIPS (Zhang et al. 2018, version 0.1) by the Python package lpips, where it is installed."""

import functools
import importlib
import math
import warnings
from typing import Any

import numpy as np
import numpy.typing as npt

from ._errors import InputError

Pixels = npt.NDArray[np.float32]
_NETWORKS = {"lpips_vgg": "vgg", "lpips_alex": "alex"}
_SMALLEST = {"lpips_vgg": 16, "lpips_alex": 31}  # side of an image, px


@functools.cache
def network(name: str) -> Any:
    """The network behind a metric, loaded once. Raises InputError without the package."""
    try:
        package: Any = importlib.import_module("lpips")
    except ImportError:
        raise InputError(f"metrics: {name} needs the package lpips: pip install lpips") from None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of torchvision, about arguments of lpips
            return package.LPIPS(net=_NETWORKS[name], verbose=False)
    except Exception as error:  # the network may come from a server: many things can be wrong
        raise InputError(f"metrics: {name}: {' '.join(str(error).split())}") from None


def distance(name: str, image: Pixels, reference: Pixels, weights: Pixels | None) -> float:
    """LPIPS of an image [H, W, 3 or 4] from 0 to 1; alpha is not used. weights: [H, W, 1]; None: equal ones.

    NaN if a side is too short for the network, or all weights are 0.
    """
    model = network(name)
    if min(image.shape[:2]) < _SMALLEST[name] or (weights is not None and not weights.any()):
        return math.nan
    image, reference = image[..., :3].clip(0, 1), reference[..., :3].clip(0, 1)
    if weights is not None:  # pixels of weight 0 show no difference to the network
        image = weights * image + (1 - weights) * reference
    torch: Any = importlib.import_module("torch")
    pair = [
        torch.from_numpy(np.ascontiguousarray((2 * pixels - 1).transpose(2, 0, 1)[None]))
        for pixels in (image, reference)
    ]
    model.spatial = weights is not None
    with torch.no_grad():
        found = model(*pair).numpy()
    if weights is None:
        return float(found.item())
    return float(np.average(found[0, 0], weights=weights[..., 0]))
