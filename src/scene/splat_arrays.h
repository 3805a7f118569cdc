// SPDX-License-Identifier: Apache-2.0
// The arrays of a splat scene, for what treats them alike.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <type_traits>
#include <vector>

#include "ewa/gaussians.h"

namespace ewa::scene {

/// floats: const or not.
template <class Floats>
struct SplatArray {
    Floats* values;
    size_t each;  // values of a splat
};

/// The five arrays of the scene. gaussians: Gaussians, const or not, which must outlive them.
template <class Scene>
auto arrays_of(Scene& gaussians) {
    using Floats = std::remove_reference_t<decltype((gaussians.means))>;
    return std::array<SplatArray<Floats>, 5>{{{&gaussians.means, 3},
                                              {&gaussians.quaternions, 4},
                                              {&gaussians.log_scales, 3},
                                              {&gaussians.opacity_logits, 1},
                                              {&gaussians.sh, gaussians.sh_stride()}}};
}

/// Copies `count` splats of one scene, from splat i on, to another of the same SH degree, from splat k on. Both have room.
inline void copy_splats(const Gaussians& from, size_t i, size_t count, Gaussians& to, size_t k) {
    const auto sources = arrays_of(from);
    const auto targets = arrays_of(to);
    for (size_t a = 0; a < sources.size(); ++a) {
        const size_t each = sources[a].each;
        std::copy_n(sources[a].values->data() + each * i, each * count, targets[a].values->data() + each * k);
    }
}

}  // namespace ewa::scene
