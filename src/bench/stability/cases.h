// SPDX-License-Identifier: Apache-2.0
// Stiff and extreme scenes: the one table that the tests and `ewa bench --stability` go through.
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
    std::string what;  // one line: what is extreme about it
    Gaussians gaussians;
    Camera camera;
    RenderOptions options;
};

/// Every case, in the order of the families. Pure: the same scenes on every machine up to the last bits of
/// exp and log.
std::vector<StabilityCase> stability_cases();

/// A scene of a user's, seen from a distance at which it fills the picture.
StabilityCase stability_case_of(const std::string& name, const Gaussians& gaussians);

/// RGB in [0, 1]: smooth waves and noise, what the loss of a case is taken against.
Image stability_photo(int width, int height);

}  // namespace ewa::bench
