// SPDX-License-Identifier: Apache-2.0
// The lens models of COLMAP.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "ewa/camera.h"

namespace ewa::io {

/// A lens model. A camera's parameters are f or fx fy, then cx cy, then the terms.
struct ColmapLens {
    std::string_view name;
    size_t focal_lengths = 1;
    Lens lens = Lens::brown;
    std::array<double Distortion::*, 12> terms{};  // null after the last

    size_t parameters() const {
        return focal_lengths + 2 + size_t(std::find(terms.begin(), terms.end(), nullptr) - terms.begin());
    }
};

/// All lens models, in the order of COLMAP's model ids.
std::span<const ColmapLens> colmap_lenses();

/// The lens model with this COLMAP model id, or null.
const ColmapLens* colmap_lens(int64_t id);

/// The lens model with this COLMAP name, or null.
const ColmapLens* colmap_lens(std::string_view name);

}  // namespace ewa::io
