# SPDX-License-Identifier: Apache-2.0
"""Relocation of splats after Kheradmand et al., "3D Gaussian Splatting as MCMC", 2024, eq. 9."""

import torch
from torch import Tensor

from ._arguments import shape


@torch.no_grad()
def compute_relocation(
    opacities: Tensor, scales: Tensor, ratios: Tensor, binoms: Tensor, min_opacity: float = 0.0
) -> tuple[Tensor, Tensor]:
    """Opacities [N] and scales [N, 3] with which `ratios[i]` splats stand for splat i.

    `ratios` [N] are held between 1 and n_max. `binoms` [n_max, n_max] are binomial coefficients:
    row n, column k. New opacities are at least `min_opacity`, and below 1.
    """
    count, most = opacities.shape[0], binoms.shape[0]
    shape("opacities", opacities, (count,))
    shape("scales", scales, (count, 3))
    shape("ratios", ratios, (count,))
    ratios = ratios.clamp(min=1, max=most).long()
    old = opacities.double()
    new = 1.0 - (1.0 - old) ** (1.0 / ratios)
    new = new.clamp(min_opacity, 1.0 - torch.finfo(torch.float32).eps)
    # The double sum of eq. 9 has (-1)^k new^(k+1) / sqrt(k+1) in all rows from k to ratio - 1:
    # the coefficients of a power add up to a column's sum.
    powers = torch.arange(1, most + 1, dtype=torch.float64)
    signs = 1.0 - 2.0 * ((powers - 1) % 2)
    factors = binoms.double().cumsum(0)[ratios - 1] * signs / powers.sqrt()
    spread = (factors * new[:, None] ** powers).sum(1)
    scaled = scales.double() * (old / spread)[:, None]
    return new.to(opacities.dtype), scaled.to(scales.dtype)
