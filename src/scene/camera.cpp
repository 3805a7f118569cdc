// SPDX-License-Identifier: Apache-2.0
#include "ewa/camera.h"

#include <algorithm>
#include <cassert>

namespace ewa {

Camera downscale(const Camera& camera, int factor) {
    assert(factor >= 1);
    Camera result = camera;
    result.width = std::max(1, camera.width / factor);
    result.height = std::max(1, camera.height / factor);
    const double x = double(result.width) / camera.width, y = double(result.height) / camera.height;
    result.fx *= x;
    result.cx *= x;
    result.fy *= y;
    result.cy *= y;
    return result;
}

}  // namespace ewa
