// SPDX-License-Identifier: Apache-2.0
// The opacity of a density that is shown by 3DGS's kernel.
//
// A density has the alpha 1 - exp(-x G) in its footprint, on average over all directions, and 3DGS's kernel has o G. Both
// have the same sum over the footprint, to second order in x = softplus(logit), if o = x - x^2 / 4 + ..., which
// 1 - exp(-(x + x^2 / 4)) is. So softplus(shown logit) = x + x^2 / 4. It has an inverse, and no opacity reaches 1.
#pragma once

namespace ewa::scene {

/// The logit with which 3DGS's kernel shows about the same. Values that are not finite stay.
float shown_logit(float density_logit);

/// The inverse.
float density_logit(float shown_logit);

}  // namespace ewa::scene
