// SPDX-License-Identifier: Apache-2.0
// The lens that --through of ewa render names.
#pragma once
#include <string>

#include "ewa/camera.h"

namespace ewa::cli {

struct LensArgument {
    Distortion lens;
    double fisheye_degrees = 180;  // along the smaller side of a fisheye's image; above 0, at most 360
};

/// Parses a lens such as fisheye:190. Throws InputError whose text begins with --through.
LensArgument lens_of(const std::string& text);

}  // namespace ewa::cli
