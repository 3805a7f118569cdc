// SPDX-License-Identifier: Apache-2.0
// A packed scene on a device, and pictures of it through pinholes.
#pragma once
#include <memory>
#include <optional>
#include <vector>

#include "ewa/camera.h"
#include "ewa/device.h"
#include "ewa/image.h"
#include "gpu/executor.h"
#include "mesh/packing.h"
#include "passes/trace.h"

namespace ewa::photograph {

class Photographer {
  public:
    /// Throws RunError where the scene does not fit the device.
    Photographer(std::shared_ptr<gpu::Device> device, const mesh::PackedScene& scene, const mesh::Sky& sky);

    /// RGBA: mean radiance of the surfaces each pixel sees (times its coverage) and the share of it that they
    /// cover. samples
    /// >= 1 paths a pixel, a function of camera, samples and seed alone. A path brighter than `brightest` in
    /// a channel counts as that bright.
    Image radiance(const Camera& camera, int samples, uint64_t seed, double brightest);

    struct Seen {
        Image depth;  // one channel: camera z of the pixel's centre in world units, 0: nothing
        std::vector<uint32_t> triangles;  // place in PackedScene::order, 0xffffffff: none
    };
    Seen seen(const Camera& camera);

    /// So far: rays that the limit on steps ended, and paths that were not finite and count as black.
    uint64_t unfinished_rays() const { return unfinished_; }
    uint64_t dropped_samples() const { return dropped_; }

  private:
    gpu::Buffer upload(const char* name, const std::vector<uint32_t>& words, gpu::Texel texel);
    gpu::Buffer view_of(const Camera& camera, double brightest);
    shared::TraceCounts trace_paths(const gpu::Buffer& view, uint64_t pixels, int samples, uint64_t seed);
    passes::MeshBuffers mesh() const;

    std::shared_ptr<gpu::Device> device_;
    passes::PassCache cache_;
    passes::Constants variant_;
    gpu::Executor executor_;
    gpu::Buffer nodes_, triangles_, surfaces_, materials_, textures_, texels_, lights_, counts_, sums_;
    mesh::Sky sky_;
    glm::dvec3 origin_;
    double unit_;
    uint32_t light_count_;
    int samples_at_once_ = 8;  // paths a pixel and dispatch; fewer give each ray more steps
    uint64_t unfinished_ = 0, dropped_ = 0;
};

/// The pictures that the scene's textures are of; those that cannot be decoded are an InputError that names
/// them. PNG and JPEG, as glTF has them, of at most 8192 x 8192 pixels.
std::vector<Image> decode_images(const mesh::Scene& scene);

}  // namespace ewa::photograph
