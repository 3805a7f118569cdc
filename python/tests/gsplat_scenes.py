# SPDX-License-Identifier: Apache-2.0
"""Scenes for the tests of ewa.gsplat, and a plain torch renderer to compare with."""

import importlib

import pytest
import torch

WIDTH, HEIGHT = 64, 48


class Reference:
    """gsplat's torch code. Where gsplat is missing, each test that uses it counts as skipped."""

    def __getattr__(self, name):
        if name.startswith("__") or "pytest" in name:
            raise AttributeError(name)  # pytest looks for marks in each global of a test's module
        pytest.importorskip("gsplat", reason="gsplat, to compare with, is not installed")
        return getattr(importlib.import_module("gsplat.cuda._torch_impl"), name)


reference = Reference()


class Scene:
    """Random splats in front of cameras; every tensor is a leaf that needs a gradient."""

    def __init__(self, splats=60, cameras=1, batch=(), channels=3, seed=1):
        make = torch.Generator().manual_seed(seed)

        def normal(*size):
            return torch.randn(*batch, *size, generator=make)

        def uniform(*size):
            return torch.rand(*batch, *size, generator=make)

        self.means = normal(splats, 3) + torch.tensor([0.0, 0.0, 4.0])
        self.quats = normal(splats, 4)
        self.scales = 0.05 + 0.3 * uniform(splats, 3)
        self.opacities = 0.1 + 0.9 * uniform(splats)
        self.colors = uniform(splats, channels)
        self.viewmats = cameras_around(cameras).expand(*batch, cameras, 4, 4).clone()
        self.Ks = torch.tensor([[55.0, 0, WIDTH / 2 + 1], [0, 50.0, HEIGHT / 2], [0, 0, 1]])
        self.Ks = self.Ks.expand(*batch, cameras, 3, 3).clone()
        for name in self.trained:
            getattr(self, name).requires_grad_()

    trained = ("means", "quats", "scales", "opacities", "colors", "viewmats")

    def tensors(self):
        return [getattr(self, name) for name in self.trained]

    def arguments(self, **changes):
        """The arguments of rasterization."""
        names = ("means", "quats", "scales", "opacities", "colors", "viewmats", "Ks")
        given = {name: getattr(self, name) for name in names}
        given.update(width=WIDTH, height=HEIGHT)
        given.update(changes)
        return given


def cameras_around(count):
    """World-to-camera matrices, turned and moved a little."""
    matrices = []
    for i in range(count):
        angle = torch.tensor(0.1 * i - 0.05)
        turned = torch.eye(4)
        turned[0, 0] = turned[2, 2] = torch.cos(angle)
        turned[0, 2], turned[2, 0] = torch.sin(angle), -torch.sin(angle)
        turned[:3, 3] = torch.tensor([0.1 * i, -0.1, 0.2])
        matrices.append(turned)
    return torch.stack(matrices)


def blend(means2d, conics, depths, opacities, features, radii, background=None):
    """One image [H, W, D] and its alphas [H, W, 1], every pixel against every splat.

    means2d are [M, 2], or [H * W, M, 2] to give each pixel its own.
    """
    order = torch.argsort(depths.detach(), stable=True)
    order = order[(radii[order] > 0).all(-1)]
    y, x = torch.meshgrid(torch.arange(HEIGHT) + 0.5, torch.arange(WIDTH) + 0.5, indexing="ij")
    dx = x.reshape(-1, 1) - means2d[..., order, 0]
    dy = y.reshape(-1, 1) - means2d[..., order, 1]
    a, b, c = conics[order].unbind(-1)
    exponent = 0.5 * (a * dx * dx + c * dy * dy) + b * dx * dy
    alpha = (opacities[order] * torch.exp(-exponent)).clamp(max=0.99)
    alpha = alpha * ((exponent >= 0) & (alpha >= 1 / 255))
    after = torch.cumprod(1 - alpha, 1)
    alpha = alpha * (after > 1e-4)
    before = torch.cumprod(torch.cat((torch.ones(len(alpha), 1), 1 - alpha), 1), 1)[:, :-1]
    weight = alpha * before
    covered = weight.sum(1, keepdim=True)
    image = weight @ features[order]
    if background is not None:
        image = image + (1 - covered) * background
    return image.reshape(HEIGHT, WIDTH, -1), covered.reshape(HEIGHT, WIDTH, 1)


def assert_close(actual, expected, name="", tolerance=2e-3):
    """Differences are small in sum, and outliers stay below what one dropped splat explains."""
    assert actual.shape == expected.shape, (name, actual.shape, expected.shape)
    assert torch.isfinite(actual).all(), name
    error = (actual - expected).norm() / expected.norm().clamp(min=1e-6)
    assert error < tolerance, f"{name}: relative error {error:.2e}"


def gradients(outputs, inputs, seed=5):
    """Gradients of a random weighting of the outputs."""
    make = torch.Generator().manual_seed(seed)
    loss = sum((o * torch.randn(o.shape, generator=make)).sum() for o in outputs)
    return torch.autograd.grad(loss, inputs, retain_graph=True, allow_unused=True)
