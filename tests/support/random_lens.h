// SPDX-License-Identifier: Apache-2.0
// Seeded scenes around cameras with lenses.
#pragma once
#include <string>
#include <vector>

#include "ewa/camera.h"
#include "ewa/gaussians.h"

namespace ewa::test {

struct NamedCamera {
    std::string name;
    Camera camera;
};

/// A camera of each lens that splats are rendered through, of about this size in px: with all of its terms.
std::vector<NamedCamera> random_lenses(uint64_t seed, int width, int height);

/// Cameras that move during the readout: pinholes read from each border, then through `brown` and two fisheyes. They turn by about 10
/// degrees, and their centres move by about 0.3 world units.
std::vector<NamedCamera> rolling_cameras(uint64_t seed, int width, int height);

/// Splats in all directions that the lens shows, and beyond: behind the camera, across the seam and at the poles of a panorama, a
/// few px large in the middle of the image.
Gaussians gaussians_around(uint64_t seed, size_t count, const Camera& camera, int sh_degree);

}  // namespace ewa::test
