# SPDX-License-Identifier: Apache-2.0
"""1 - SSIM (Wang et al. 2004) with its gradient, by shifted sums, which are fast on a CPU."""

import torch
from torch import Tensor

RADIUS = 5
C1, C2 = 0.01**2, 0.03**2

_offsets = torch.arange(-RADIUS, RADIUS + 1.0)
_weights = torch.exp(-_offsets.square() / (2 * 1.5**2))
WINDOW = (_weights / _weights.sum()).tolist()


def blur(image: Tensor) -> Tensor:
    """A Gaussian of 11x11 pixels over [H, W, channels], zero outside. It is its own adjoint."""
    for axis in (0, 1):
        size = image.shape[axis]
        out = image * WINDOW[RADIUS]
        for shift in range(1, min(RADIUS, size - 1) + 1):
            weight, rest = WINDOW[RADIUS + shift], size - shift
            out.narrow(axis, 0, rest).add_(image.narrow(axis, shift, rest), alpha=weight)
            out.narrow(axis, shift, rest).add_(image.narrow(axis, 0, rest), alpha=weight)
        image = out
    return image


class _Dissimilarity(torch.autograd.Function):
    @staticmethod
    def forward(ctx, x: Tensor, y: Tensor) -> Tensor:
        mean_x, mean_y = blur(x), blur(y)
        products = mean_x * mean_y
        squares = mean_x.square().add_(mean_y.square())
        numerator_1 = (2 * products).add_(C1)
        numerator_2 = blur(x * y).sub_(products).mul_(2).add_(C2)
        denominator_1 = squares + C1
        denominator_2 = blur(torch.addcmul(x.square(), y, y)).sub_(squares).add_(C2)
        scale = (denominator_1 * denominator_2).reciprocal_()
        similarity = numerator_1 * numerator_2 * scale
        # By the mean of x, of its square, and of the product with y.
        by_square = similarity / denominator_2
        by_product = numerator_1.mul_(scale).mul_(2)
        by_mean = numerator_2.mul_(scale).mul_(2).sub_(by_product).mul_(mean_y)
        by_mean.addcmul_(mean_x, by_square - similarity / denominator_1, value=2)
        ctx.save_for_backward(x, y, by_mean, by_square, by_product)
        return 1 - similarity.mean()

    @staticmethod
    def backward(ctx, gradient: Tensor):
        x, y, by_mean, by_square, by_product = ctx.saved_tensors
        out = blur(by_mean).addcmul_(x, blur(by_square), value=-2).addcmul_(y, blur(by_product))
        return out.mul_(-gradient / x.numel()), None


def dissimilarity(image: Tensor, target: Tensor) -> Tensor:
    """1 - SSIM of [H, W, channels], differentiable by the image."""
    return _Dissimilarity.apply(image, target)
