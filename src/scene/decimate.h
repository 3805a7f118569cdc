// SPDX-License-Identifier: Apache-2.0
// The merging of splats behind decimate_splats (ewa/splat_edit.h), with the errors of the merges.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "ewa/gaussians.h"

namespace ewa::scene {

/// Reorders the splats by morton_order in place, without memory for a copy. Merging millions of splats then is 1.5 times as fast as
/// in random order, since neighbours are near each other in memory.
void put_neighbors_together(Gaussians& gaussians);

/// The squared opacity of splat i, summed over the images of three orthographic views along the axes, in squared world units. The
/// splat must be drawable, and its opacity that of 3DGS's kernel.
double squared_light(const Gaussians& gaussians, size_t i);

/// decimate_splats of splats that are drawable and have opacities of 3DGS's kernel. Those that are left keep their order. The error
/// of a merge is the squared difference of the merged splat to both splats in these views: of their colours, and in part of their
/// opacities. errors: gets, for each splat that is left, the sum of the errors of the merges in it, in the units of squared_light.
/// A call adds to the errors of earlier calls. Pass an empty vector to the first call.
void decimate_traced(Gaussians& gaussians, size_t target, std::vector<float>& errors);

}  // namespace ewa::scene
