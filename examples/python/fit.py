#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Fits splats to images in a plain torch loop: fit.py DATASET [--steps N] [--out FILE]

Its learning rates are those of long runs. With a few hundred steps, `ewa train` comes further.

DATASET is a COLMAP model or a transforms.json with points. The last line is the PSNR of the
held-out images.
"""

import argparse
import math
import time

import numpy as np
import torch
from torch import Tensor
from torch.nn import Parameter

import ewa
from ewa.gsplat import DefaultStrategy, export_splats, rasterization
from ssim import dissimilarity

FULL_RUN = 30_000  # steps of the published learning rates and intervals
SH_CONSTANT = 0.28209479177387814


def to_tensor(values) -> Tensor:
    return torch.from_numpy(np.ascontiguousarray(values, np.float32))


def neighbour_distances(points: Tensor) -> Tensor:
    """The mean distance of each point to its three nearest."""
    nearest = [
        torch.cdist(part, points).topk(4, largest=False).values for part in points.split(2048)
    ]
    return torch.cat(nearest)[:, 1:].mean(1).clamp(min=1e-6)


def first_splats(data: ewa.Dataset, bands: int) -> dict[str, Parameter]:
    """One splat a point, in gsplat's names: log scales, opacity logits."""
    points, colors = to_tensor(data.points), to_tensor(data.point_colors) / 255
    count = len(points)
    quats = torch.zeros(count, 4)
    quats[:, 0] = 1
    values = {
        "means": points,
        "scales": neighbour_distances(points).log()[:, None].repeat(1, 3),
        "quats": quats,
        "opacities": torch.full((count,), 0.1).logit(),
        "sh0": ((colors - 0.5) / SH_CONSTANT)[:, None],
        "shN": torch.zeros(count, bands - 1, 3),
    }
    return {name: Parameter(value) for name, value in values.items()}


def scene_extent(viewmats: Tensor) -> float:
    """The radius of the cameras around their centre, with a margin."""
    centers = torch.inverse(viewmats)[:, :3, 3]
    return 1.1 * float((centers - centers.mean(0)).norm(dim=1).max())


class Fit:
    def __init__(self, data: ewa.Dataset, steps: int, sh_degree: int) -> None:
        self.data, self.steps, self.sh_degree = data, steps, sh_degree
        self.viewmats, self.Ks = to_tensor(data.viewmats), to_tensor(data.Ks)
        extent = scene_extent(self.viewmats)
        share = min(1.0, steps / FULL_RUN)
        gain = 2 - share  # a short run learns positions and view-dependent colour faster
        self.params = first_splats(data, (sh_degree + 1) ** 2)
        self.means_rate = 1.6e-4 * gain * extent
        rates = {
            "means": self.means_rate,
            "scales": 5e-3,
            "quats": 1e-3,
            "opacities": 0.025,
            "sh0": 2.5e-3,
            "shN": 1.25e-4 * gain,
        }
        self.optimizers = {
            name: torch.optim.Adam([self.params[name]], lr=rate, eps=1e-15)
            for name, rate in rates.items()
        }
        self.strategy = DefaultStrategy(
            refine_start_iter=max(100, round(500 * share)),
            refine_stop_iter=round(15_000 * share),
            refine_every=max(50, round(100 * share)),
            reset_every=max(1000, round(3000 * share)),
        )
        self.strategy.check_sanity(self.params, self.optimizers)
        self.state = self.strategy.initialize_state(scene_scale=extent)
        self.degree_every = max(50, round(1000 * share))

    def render(self, frame: int, degree: int) -> tuple[Tensor, dict]:
        """The image [H, W, 3] of a frame, and what the strategy reads."""
        p, camera = self.params, self.data.frames[frame]
        image, _, info = rasterization(
            p["means"],
            p["quats"],
            p["scales"].exp(),
            p["opacities"].sigmoid(),
            torch.cat((p["sh0"], p["shN"][:, : (degree + 1) ** 2 - 1]), 1),
            self.viewmats[frame : frame + 1],
            self.Ks[frame : frame + 1],
            camera.width,
            camera.height,
            sh_degree=degree,
            packed=False,
        )
        return image[0], info

    def step(self, step: int, frame: int, photo: Tensor) -> float:
        """One step on one image; returns its loss."""
        degree = min(self.sh_degree, (step - 1) // self.degree_every)
        image, info = self.render(frame, degree)
        loss = 0.8 * (image - photo).abs().mean() + 0.2 * dissimilarity(image, photo)
        hooks = self.params, self.optimizers, self.state, step, info
        self.strategy.step_pre_backward(*hooks)
        loss.backward()
        self.strategy.step_post_backward(*hooks)
        self.optimizers["means"].param_groups[0]["lr"] = self.means_rate * 0.01 ** (
            step / self.steps
        )
        for optimizer in self.optimizers.values():
            optimizer.step()
            optimizer.zero_grad(set_to_none=True)
        return float(loss.detach())

    @torch.no_grad()
    def psnr(self, frames: list[int]) -> float:
        """The mean PSNR of frames, in dB."""
        found = []
        for frame in frames:
            image, _ = self.render(frame, self.sh_degree)
            photo = to_tensor(self.data.images[frame])[..., :3]
            found.append(-10 * math.log10(float((image.clamp(0, 1) - photo).square().mean())))
        return sum(found) / len(found)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("dataset")
    parser.add_argument("--steps", type=int, default=1000)
    parser.add_argument("--sh-degree", type=int, default=3)
    parser.add_argument("--downscale", type=int, default=1)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", help="a .ply for the splats")
    options = parser.parse_args()

    torch.manual_seed(options.seed)
    data = ewa.Dataset(options.dataset, downscale=options.downscale)
    train, held_out = (list(frames) for frames in data.split())
    photos = {frame: to_tensor(data.images[frame])[..., :3] for frame in train}
    fit = Fit(data, options.steps, options.sh_degree)
    start, order = time.perf_counter(), []
    for step in range(1, options.steps + 1):
        if not order:
            order = torch.randperm(len(train)).tolist()
        frame = train[order.pop()]
        loss = fit.step(step, frame, photos[frame])
        if step % 100 == 0 or step == options.steps:
            seconds, splats = time.perf_counter() - start, len(fit.params["means"])
            print(f"step {step}: {seconds:.1f} s, {splats} splats, loss {loss:.4f}", flush=True)
    if options.out:
        values = {name: p.detach() for name, p in fit.params.items()}
        export_splats(**values, save_to=options.out)
    if held_out:
        print(f"PSNR of {len(held_out)} held-out images: {fit.psnr(held_out):.2f} dB")


if __name__ == "__main__":
    main()
