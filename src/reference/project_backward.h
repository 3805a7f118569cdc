// SPDX-License-Identifier: Apache-2.0
// The way back through projection: from a splat's footprint and colour to its stored values.
//
// With G = dL/dSigma as a symmetric matrix (formulas of the forward direction in projection.h):
//   dL/dM  = 2 G M, plus the kernel factor's share through det0 and det:
//            ddet0/drow0 = 2 row1 x n, ddet0/drow1 = 2 n x row0 with n = row0 x row1; dtrace/dM = 2 M
//   dL/dJ  = dL/dM (W R S)^T;  dL/d(R S) = (J W)^T dL/dM
//   dL/dlog s_k = s_k sum_i R_ik dL/d(R S)_ik
//   dL/dq  = (I - q^ q^T) dL/dq^ / |q|, q^ = q / |q|
// The mean moves mean2d, J (not through a slope that is clamped) and the direction of the colour.
// A channel of the colour that max(0, .) holds at zero passes nothing back.
#pragma once
#include "reference/blend_backward.h"
#include "reference/projection.h"
#include "reference/values.h"

namespace ewa::reference {

/// dL/d(stored value); all zero for a splat that is not visible. Coefficients above the degree in use stay
/// zero.
Splat project_backward(const Splat& splat, const Camera& camera, const RenderOptions& options,
                       const ScreenGradient& gradient);

}  // namespace ewa::reference
