# SPDX-License-Identifier: Apache-2.0
"""Splats to the bytes of a file."""

import os
import tempfile

import torch
from torch import Tensor

import ewa

from ._arguments import check, shape, tensor

_ENDINGS = {"ply": ".ply", "splat": ".splat", "ply_compressed": ".compressed.ply"}


@torch.no_grad()
def export_splats(
    means: Tensor,
    scales: Tensor,
    quats: Tensor,
    opacities: Tensor,
    sh0: Tensor,
    shN: Tensor,
    format: str = "ply",
    save_to: str | os.PathLike[str] | None = None,
) -> bytes:
    """The bytes of a file: ply, splat or ply_compressed, written to `save_to` as well if given.

    Values are as trained: log scales, opacity logits. sh0 [N, 3] or [N, 1, 3], shN [N, K, 3].
    Splats with a value that is not finite are left out.
    """
    check(format in _ENDINGS, f"format {format!r} is none of {', '.join(_ENDINGS)}")
    means, scales, quats = tensor("means", means), tensor("scales", scales), tensor("quats", quats)
    count = means.shape[0]
    shape("means", means, (count, 3))
    shape("scales", scales, (count, 3))
    shape("quats", quats, (count, 4))
    opacities = tensor("opacities", opacities).reshape(count)
    sh = torch.cat(
        (tensor("sh0", sh0).reshape(count, 1, 3), tensor("shN", shN).reshape(count, -1, 3)), 1
    )
    columns = (means, scales, quats, opacities[:, None], sh.flatten(1))
    finite = torch.cat(columns, 1).isfinite().all(1)
    splats = ewa.Splats(
        means=means[finite].numpy(),
        quats=quats[finite].numpy(),
        log_scales=scales[finite].numpy(),
        opacity_logits=opacities[finite].numpy(),
        sh=sh[finite].numpy(),
    )
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "splats" + _ENDINGS[format])
        ewa.save(path, splats)
        with open(path, "rb") as file:
            data = file.read()
    if save_to is not None:
        with open(save_to, "wb") as file:
            file.write(data)
    return data
