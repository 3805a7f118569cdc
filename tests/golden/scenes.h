// SPDX-License-Identifier: Apache-2.0
// Small scenes that each show one thing.
#pragma once
#include <ostream>
#include <string>
#include <vector>

#include "ewa/camera.h"
#include "ewa/gaussians.h"
#include "ewa/render_options.h"
#include "golden/golden.h"

namespace ewa::test {

enum class Shown { color, depth, alpha, median_depth, normal };

struct GoldenScene {
    std::string name;
    Gaussians gaussians;
    Camera camera;
    RenderOptions options;
    Shown shown = Shown::color;
    double scale = 1;  // the picture is the values times this, so that they stay in [0, 1]
    Tolerance tolerance;
};

inline void PrintTo(const GoldenScene& scene, std::ostream* out) {
    *out << scene.name;
}

/// References are the float64 CPU reference's pictures of these.
std::vector<GoldenScene> golden_scenes();

/// Splats of sub-pixel size, for what anti-aliasing is for.
GoldenScene sub_pixel_scene(Footprint kernel);

}  // namespace ewa::test
