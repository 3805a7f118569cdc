// SPDX-License-Identifier: Apache-2.0
#include "pipeline/camera_block.h"

#include <cmath>

#include "ewa/error.h"
#include "shared/constants.h"

namespace ewa::pipeline {
namespace {

void split(double value, float& high, float& low) {
    high = float(value);
    low = float(value - double(high));
}

void check(const Camera& camera) {
    bool good = camera.width > 0 && camera.height > 0 && camera.fx > 0 && camera.fy > 0 &&
                std::isfinite(camera.fx) && std::isfinite(camera.fy) && std::isfinite(camera.cx) &&
                std::isfinite(camera.cy);
    for (int i = 0; i < 3; ++i) {
        good = good && std::isfinite(camera.translation[i]);
        for (int j = 0; j < 3; ++j) good = good && std::isfinite(camera.rotation[i][j]);
    }
    if (!good)
        throw InputError(
            "a camera with a value that is not finite, or a size or focal length not above zero");
}

}  // namespace

shared::CameraBlock camera_block(const Camera& camera, const passes::KernelConfig& config,
                                 const glm::dvec3& origin) {
    check(camera);
    shared::CameraBlock block{};
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column)
            split(camera.rotation[column][row], block.rotation_hi[3 * row + column],
                  block.rotation_lo[3 * row + column]);
    const glm::dvec3 position = camera.position() - origin;
    for (int i = 0; i < 3; ++i) split(position[i], block.position_hi[i], block.position_lo[i]);
    const double focal[2] = {camera.fx, camera.fy}, center[2] = {camera.cx, camera.cy};
    const int size[2] = {camera.width, camera.height};
    const uint32_t tile[2] = {config.tile_width, config.tile_height};
    for (int i = 0; i < 2; ++i) {
        split(focal[i], block.focal_hi[i], block.focal_lo[i]);
        split(center[i], block.center_hi[i], block.center_lo[i]);
        const double margin = shared::JACOBIAN_MARGIN * size[i] / (2.0 * focal[i]);
        block.tan_min[i] = float(-(center[i] / focal[i] + margin));
        block.tan_max[i] = float((size[i] - center[i]) / focal[i] + margin);
        block.size[i] = uint32_t(size[i]);
        block.tiles[i] = (uint32_t(size[i]) + tile[i] - 1) / tile[i];
    }
    return block;
}

}  // namespace ewa::pipeline
