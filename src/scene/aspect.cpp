// SPDX-License-Identifier: Apache-2.0
#include "scene/aspect.h"

#include <algorithm>
#include <cstdint>

namespace ewa::scene {

bool same_shape(int old_width, int old_height, int width, int height) {
    if (int64_t(width) * old_height == int64_t(height) * old_width) return true;
    const double x = double(width) / old_width, y = double(height) / old_height;
    if (x > 0.9 && x < 1.1) return false;
    const double low = std::max((width - 1.0) / old_width, (height - 1.0) / old_height);
    const double high = std::min((width + 1.0) / old_width, (height + 1.0) / old_height);
    return low < high && x > 0 && y > 0;
}

}  // namespace ewa::scene
