// SPDX-License-Identifier: Apache-2.0
// Conversion between opacities of densities and of 3DGS's kernel.
//
// On average over all directions, a density has the alpha 1 - exp(-x G) in its footprint, with x = softplus(logit). 3DGS's kernel
// has o G. Their sums over the footprint agree to second order in x if o = x - x^2 / 4 + .... The function 1 - exp(-(x + x^2 / 4))
// has that expansion. So softplus(shown logit) = x + x^2 / 4. This has an inverse, and no opacity reaches 1.
#pragma once

namespace ewa::scene {

/// The logit with which 3DGS's kernel has about the same image. Values that are not finite stay.
float shown_logit(float density_logit);

/// The inverse of shown_logit.
float density_logit(float shown_logit);

}  // namespace ewa::scene
