// SPDX-License-Identifier: Apache-2.0
// A picture of a splat file: still SPLATS OUT.png
//
// Looks along +z at the middle of the splats, from as far away as they reach.
#include <ewa/device.h>
#include <ewa/error.h>
#include <ewa/renderer.h>
#include <ewa/splat_files.h>
#include <algorithm>
#include <cstdio>
#include <glm/vec3.hpp>

namespace {

ewa::Camera camera_before(const ewa::Gaussians& gaussians) {
    glm::dvec3 low(1e300), high(-1e300);
    for (size_t i = 0; i < gaussians.size(); ++i) {
        if (!drawable(gaussians, i)) continue;
        for (int k = 0; k < 3; ++k) {
            low[k] = std::min(low[k], double(gaussians.means[3 * i + size_t(k)]));
            high[k] = std::max(high[k], double(gaussians.means[3 * i + size_t(k)]));
        }
    }
    const glm::dvec3 size = high - low;
    const double reach = std::max({size.x, size.y, size.z, 1e-3});
    ewa::Camera camera;
    camera.width = 320;
    camera.height = 240;
    camera.fx = camera.fy = 300;
    camera.cx = 160;
    camera.cy = 120;
    camera.translation = -((low + high) * 0.5 - glm::dvec3(0, 0, 1.5 * reach));
    return camera;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 3) {
        std::fprintf(stderr, "still SPLATS OUT.png\n");
        return 2;
    }
    try {
        const ewa::Gaussians gaussians = ewa::load_splats(argv[1]);
        ewa::Renderer renderer(ewa::open_device({}), gaussians, {});
        ewa::save_image(argv[2], renderer.render(camera_before(gaussians)).color);
        std::printf("%zu splats\n", gaussians.size());
        return 0;
    } catch (const ewa::InputError& error) {
        std::fprintf(stderr, "still: %s\n", error.what());
        return 2;
    } catch (const ewa::RunError& error) {
        std::fprintf(stderr, "still: %s\n", error.what());
        return 1;
    }
}
