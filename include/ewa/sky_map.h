// SPDX-License-Identifier: Apache-2.0
// The sky: light from infinitely far behind the splats, which depends on the direction of a pixel's ray only.
#pragma once
#include <filesystem>
#include <vector>

namespace ewa {

inline constexpr int kMostSkyTexels = 1024;  // a side

/// A map of size x size texels over an octahedron in world axes. shaders/lib/sky.glsl has the formulas. The colour of a pixel is
/// that of its splats over the sky's colour.
struct SkyMap {
    int size = 0;               // 1 to kMostSkyTexels
    std::vector<float> texels;  // [size, size, 3], RGB

    bool operator==(const SkyMap&) const = default;
};

/// Throws InputError unless the size is in its range and there are texels for it. Functions that take a SkyMap call this check.
void check(const SkyMap& sky);

/// Reads sky.json of a run's folder. Throws InputError if the file cannot be read, or values are missing or not finite.
SkyMap load_sky(const std::filesystem::path& path);
/// Writes sky.json. Throws RunError (disk), InputError (size).
void save_sky(const std::filesystem::path& path, const SkyMap& sky);

}  // namespace ewa
