// SPDX-License-Identifier: Apache-2.0
// What a picture depends on besides the splats and the camera.
#pragma once
#include <array>

namespace ewa {

/// How opacity depends on the footprint; values are KERNEL_* of shaders/shared/constants.h.
enum class Kernel { peak = 0, antialias = 1, unit_mass = 2 };

struct RenderOptions {
    std::array<float, 3> background{0, 0, 0};
    Kernel kernel = Kernel::peak;
    int sh_degree = 3;  // degrees above this, or above what the scene has, are left out
};

}  // namespace ewa
