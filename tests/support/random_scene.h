// SPDX-License-Identifier: Apache-2.0
// Seeded scenes, cameras and pictures for tests. A pure function of the seed on every platform: no std
// distribution.
#pragma once
#include <cstdint>
#include <string>

#include "ewa/camera.h"
#include "ewa/gaussians.h"
#include "ewa/image.h"

namespace ewa::test {

/// SplitMix64 (Steele et al. 2014) with uniform and normal numbers.
class Random {
  public:
    explicit Random(uint64_t seed) : state_(seed) {}
    uint64_t bits();
    double uniform(double low = 0, double high = 1);  // [low, high)
    double normal();
    int integer(int low, int high);  // [low, high]

  private:
    uint64_t state_;
};

enum class SplatKind {
    ordinary,              // a few px to a fifth of the picture, most of them in it
    needles,               // scales 1 : 1000
    sub_pixel,             // far under a pixel
    off_screen_and_close,  // beyond the borders, and as close as twice the near plane
    opacity_extremes,      // 1e-4 to 0.99999
    mixed,                 // splat i is of kind i % 5
};

/// Odd sizes, fx != fy, off-centre (cx, cy), any rotation, a few units from the origin. width, height
/// 0: 17..49 px.
Camera random_camera(uint64_t seed, int width = 0, int height = 0);

/// Splats in front of the camera; quaternions of any norm from 0.2 to 5; colours on both sides of the clamp
/// at zero.
Gaussians random_gaussians(uint64_t seed, size_t count, SplatKind kind, const Camera& camera, int sh_degree);

/// RGB in [0, 1]: smooth waves and noise.
Image random_target(uint64_t seed, int width, int height);

/// The RGB image with an alpha: 0 in each third column, random elsewhere.
Image cut_out(const Image& image, uint64_t seed);

/// Depths of 1 to 10, one channel, and 0 in each fifth pixel.
Image random_depths(uint64_t seed, int width, int height);

/// For SCOPED_TRACE.
std::string seed_text(uint64_t seed);
const char* name_of(SplatKind kind);

}  // namespace ewa::test
