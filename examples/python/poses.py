#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Refines camera poses against splats by the gradient of the view matrices: poses.py SPLATS DATASET

SPLATS is a file that ewa reads, in the frame of the dataset's cameras. --noise first moves each
camera at random. The errors before and after show what the refinement restores.
"""

import argparse

import numpy as np
import torch
from torch import Tensor

import ewa
from ewa.gsplat import rasterization


def to_tensor(values) -> Tensor:
    return torch.from_numpy(np.ascontiguousarray(values, np.float32))


def motion(twist: Tensor) -> Tensor:
    """Rotation and translation vectors [n, 6] as rigid motions [n, 4, 4]."""
    x, y, z, *move = twist.unbind(1)
    o = torch.zeros_like(x)
    rows = ((o, -z, y, move[0]), (z, o, -x, move[1]), (-y, x, o, move[2]), (o, o, o, o))
    return torch.matrix_exp(torch.stack([torch.stack(row, 1) for row in rows], 1))


def errors(viewmats: Tensor, truth: Tensor) -> str:
    """The mean angle and distance between two sets of cameras."""
    relative = viewmats @ truth.inverse()
    cosine = (relative[:, :3, :3].diagonal(dim1=1, dim2=2).sum(1) - 1) / 2
    angle = torch.rad2deg(torch.arccos(cosine.clamp(-1, 1))).mean()
    centers = viewmats.inverse()[:, :3, 3] - truth.inverse()[:, :3, 3]
    return f"{angle:.3f} degrees, {centers.norm(dim=1).mean():.4f} world units"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("splats")
    parser.add_argument("dataset")
    parser.add_argument("--steps", type=int, default=60, help="of each frame")
    parser.add_argument("--frames", type=int, default=4, help="the first frames of the dataset")
    parser.add_argument("--downscale", type=int, default=1)
    parser.add_argument("--noise", type=float, default=0.02, help="radians and world units")
    parser.add_argument("--rate", type=float, default=3e-3)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()

    torch.manual_seed(options.seed)
    data = ewa.Dataset(options.dataset, downscale=options.downscale)
    splats = ewa.load(options.splats)
    degree = round(splats.sh.shape[1] ** 0.5) - 1
    shapes = (
        to_tensor(splats.means + splats.origin),
        to_tensor(splats.quats),
        to_tensor(splats.log_scales).exp(),
        to_tensor(splats.opacity_logits).sigmoid(),
        to_tensor(splats.sh),
    )
    frames = range(min(options.frames, len(data)))
    photos = [to_tensor(data.images[i])[..., :3] for i in frames]
    truth, Ks = to_tensor(data.viewmats)[: len(frames)], to_tensor(data.Ks)
    start = motion(options.noise * torch.randn(len(frames), 6)) @ truth
    twist = torch.zeros(len(frames), 6, requires_grad=True)
    optimizer = torch.optim.Adam([twist], lr=options.rate)
    print(f"before: {errors(start, truth)}")
    for step in range(1, options.steps + 1):
        optimizer.param_groups[0]["lr"] = options.rate * 0.1 ** (step / options.steps)
        total = 0.0
        for i, photo in zip(frames, photos):
            viewmat = motion(twist[i : i + 1]) @ start[i : i + 1]
            height, width = photo.shape[:2]
            image = rasterization(*shapes, viewmat, Ks[i : i + 1], width, height, sh_degree=degree)[
                0
            ]
            loss = (image[0] - photo).abs().mean()
            loss.backward()
            total += float(loss.detach())
        optimizer.step()
        optimizer.zero_grad(set_to_none=True)
        if step % 20 == 0 or step == options.steps:
            print(f"step {step}: mean difference {total / len(frames):.4f}", flush=True)
    print(f"after: {errors(motion(twist.detach()) @ start, truth)}")


if __name__ == "__main__":
    main()
