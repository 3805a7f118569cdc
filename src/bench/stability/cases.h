// SPDX-License-Identifier: Apache-2.0
// Stiff and extreme scenes, for the tests and `ewa bench --stability`.
#pragma once
#include <string>
#include <vector>

#include "ewa/camera.h"
#include "ewa/gaussians.h"
#include "ewa/image.h"
#include "ewa/render_options.h"

namespace ewa::bench {

struct StabilityCase {
    std::string name;  // family_value
    std::string what;  // one line: what is extreme
    Gaussians gaussians;
    Camera camera;
    RenderOptions options;
};

/// All cases in the order of their families. Equal on all machines up to the last bits of exp and log.
std::vector<StabilityCase> stability_cases();

/// A user's scene, seen from a distance at which it fills the image.
StabilityCase stability_case_of(const std::string& name, const Gaussians& gaussians);

/// The target image of the loss, RGB in [0, 1]: smooth waves and noise.
Image stability_photo(int width, int height);

}  // namespace ewa::bench
