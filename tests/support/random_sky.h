// SPDX-License-Identifier: Apache-2.0
// A sky of random texels.
#pragma once
#include "ewa/sky_map.h"
#include "support/random_scene.h"

namespace ewa::test {

inline SkyMap random_sky(uint64_t seed, int size) {
    Random random(seed ^ 0x5c7ull);
    SkyMap sky{size, std::vector<float>(size_t(3) * size_t(size) * size_t(size))};
    for (float& value : sky.texels) value = float(random.uniform(0, 1));
    return sky;
}

}  // namespace ewa::test
