// SPDX-License-Identifier: Apache-2.0
// The CPU reference's results in the device's layouts: inputs for a pass that runs alone.
#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "gpu/test_device.h"
#include "passes/kernel_config.h"
#include "pipeline/frame_inputs.h"
#include "pipeline/model.h"
#include "reference/render.h"
#include "shared/layouts.h"
#include "support/random_scene.h"

namespace ewa::test {

struct Scene {
    Camera camera;
    Gaussians gaussians;
    RenderOptions options;
};

inline Scene random_scene(uint64_t seed, size_t splats, SplatKind kind, int width, int height,
                          int sh_degree = 0, Footprint kernel = Footprint::peak) {
    Scene scene;
    scene.camera = random_camera(seed, width, height);
    scene.gaussians = random_gaussians(seed + 1, splats, kind, scene.camera, sh_degree);
    scene.options.kernel = kernel;
    scene.options.background = {0.2f, 0.5f, 0.8f};
    return scene;
}

/// The CPU reference with the device's tiles, so that lists can be compared tile by tile.
inline reference::ReferenceOptions reference_tiles(const passes::KernelConfig& shape) {
    reference::ReferenceOptions cpu;
    cpu.tile_width = int(shape.tile_width);
    cpu.tile_height = int(shape.tile_height);
    return cpu;
}

/// The third and fourth float of the record: see RECORD_TEXELS.
struct Whitening {
    double ux, k, vy;
};
inline Whitening whitening(const reference::Projected& p) {
    return {std::sqrt(p.c / (2 * p.det)), p.b / p.c, std::sqrt(1 / (2 * p.c))};
}

/// Records of projected splats; zero for those that are not visible.
inline std::vector<float> pack_records(std::span<const reference::Projected> projected) {
    std::vector<float> out;
    for (const reference::Projected& p : projected) {
        std::array<float, 12> r{};
        if (p.visible) {
            const auto [ux, k, vy] = whitening(p);
            const float x = float(p.mean2d.x), y = float(p.mean2d.y);
            r = {x,
                 y,
                 float(p.mean2d.x - double(x)),
                 float(p.mean2d.y - double(y)),
                 float(ux),
                 float(k),
                 float(vy),
                 float(p.opacity),
                 float(p.color.x),
                 float(p.color.y),
                 float(p.color.z),
                 float(p.z)};
        }
        out.insert(out.end(), r.begin(), r.end());
    }
    if (out.empty()) out.resize(12);
    return out;
}

/// A picture in planes with the device's stride; what lies past the width is zero.
inline std::vector<float> pack_planes(const reference::Raster& raster, uint32_t planes, uint32_t stride) {
    std::vector<float> out(size_t(planes) * stride * size_t(raster.height));
    for (int c = 0; c < raster.channels; ++c)
        for (int y = 0; y < raster.height; ++y)
            for (int x = 0; x < raster.width; ++x)
                out[(size_t(c) * size_t(raster.height) + size_t(y)) * stride + size_t(x)] =
                    float(raster.at(x, y)[c]);
    return out;
}

/// A slot's floats of an instance's moments. The device's u and v are the CPU reference's over sqrt(2): its
/// power is -(u^2 + v^2), the CPU reference's -(u^2 + v^2) / 2.
inline std::array<double, 11> slot_of(const reference::Moments& m, const reference::Projected& splat) {
    const double r = std::sqrt(0.5);
    const double ux = r * reference::whitener(splat).ux;
    return {m.s0,
            r * m.su,
            r * m.sv,
            m.suu / 2,
            m.suv / 2,
            m.svv / 2,
            m.color.x,
            m.color.y,
            m.color.z,
            m.absolute.x / (2 * ux),
            m.absolute.y / 2};
}

inline gpu::Buffer camera_buffer(const Camera& camera, const passes::KernelConfig& shape) {
    return pipeline::upload_camera(*device(), camera, shape);
}

}  // namespace ewa::test
