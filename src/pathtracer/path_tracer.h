// SPDX-License-Identifier: Apache-2.0
// A packed scene on a device, and renders of it through any lens.
#pragma once
#include <memory>
#include <optional>
#include <vector>

#include "ewa/camera.h"
#include "ewa/device.h"
#include "ewa/image.h"
#include "gpu/executor.h"
#include "gpu/read_back.h"
#include "passes/passes.h"
#include "pathtracer/packing.h"

namespace ewa::pathtracer {

class PathTracer {
  public:
    /// Throws RunError if the scene does not fit the device.
    PathTracer(std::shared_ptr<gpu::Device> device, const pathtracer::PackedScene& scene,
               const scene::Sky& sky);

    /// RGBA per pixel: mean radiance of the visible surfaces times their coverage, and their coverage. There
    /// are `samples` >= 1 paths per pixel. The result is a function of camera, samples and seed. Each channel
    /// of a path is clamped to `brightest`.
    Image radiance(const Camera& camera, int samples, uint64_t seed, double brightest);

    struct Seen {
        /// One channel: camera z of the pixel's centre, or its distance through a lens or a rolling shutter, in world units. 0:
        /// nothing.
        Image depth;
        std::vector<uint32_t> triangles;  // sorted index in PackedScene::order, 0xffffffff: none
    };
    Seen seen(const Camera& camera);

    /// Totals so far. Unfinished rays: ended by the limit on steps. The other total: paths that were not finite and count as black.
    uint64_t unfinished_rays() const { return unfinished_; }
    uint64_t dropped_samples() const { return dropped_; }

  private:
    gpu::Buffer upload(const char* name, const std::vector<uint32_t>& words, gpu::Texel texel);
    struct Mesh {
        gpu::Buffer nodes, triangles, surfaces, materials, textures, texels;
    };
    struct View {
        gpu::Buffer block, rays;
        passes::Constants variant;
    };
    View see(const Camera& camera, double brightest);
    gpu::Buffer view_of(const Camera& camera, double brightest);
    shared::TraceCounts trace_paths(const View& view, uint64_t pixels, int samples, uint64_t seed);
    passes::MeshBuffers mesh() const;

    std::shared_ptr<gpu::Device> device_;
    passes::PassCache cache_;
    passes::Constants variant_;
    gpu::Executor executor_;
    Mesh mesh_;
    gpu::Buffer lights_, sums_;
    gpu::ReadBack<shared::TraceCounts> counts_;
    scene::Sky sky_;
    glm::dvec3 origin_;
    double unit_;
    uint32_t light_count_;
    int samples_at_once_ = 8;  // paths per pixel and dispatch; with fewer, each ray may take more steps
    uint64_t unfinished_ = 0, dropped_ = 0;
};

}  // namespace ewa::pathtracer
