// SPDX-License-Identifier: Apache-2.0
// A splat scene on the device: parameters, and in training Adam's moments. A training step changes only these, and learned tables.
#pragma once
#include <cstdint>
#include <functional>
#include <span>

#include "ewa/gaussians.h"
#include "gpu/buffer.h"
#include "shared/layouts.h"

namespace ewa::pipeline {

/// Texel planes of the parameters at a stored SH degree.
constexpr uint32_t parameter_planes(int sh_degree) {
    return (shared::PARAM_SH + 3u * uint32_t(sh_coefficients(sh_degree)) + 3u) / 4u;
}

/// Bytes of one parameter-sized buffer: whole blocks of splats.
constexpr uint64_t parameter_bytes(uint32_t capacity, int sh_degree) {
    const uint64_t blocks =
        capacity > 0 ? (uint64_t(capacity) + shared::PARAM_BLOCK - 1) / shared::PARAM_BLOCK : 1;
    return blocks * shared::PARAM_BLOCK * parameter_planes(sh_degree) * 16;
}

/// Index of float f of splat i in a parameter-sized buffer, in floats. planes: texel planes a splat (shared/layouts.h).
constexpr size_t parameter_index(uint32_t planes, uint32_t f, size_t i) {
    const size_t block = i / shared::PARAM_BLOCK, within = i % shared::PARAM_BLOCK;
    return ((block * planes + f / 4) * shared::PARAM_BLOCK + within) * 4 + f % 4;
}

struct Model {
    uint32_t splats = 0, capacity = 0;
    // A model may be a portion of a scene: a range of its splats.
    uint32_t first = 0;      // number of the model's first splat in the scene
    uint32_t all = 0;        // splats of the scene
    int sh_degree = 0;       // stored
    glm::dvec3 origin{0.0};  // of the means, see Gaussians; camera positions are relative to it too
    uint32_t planes() const { return parameter_planes(sh_degree); }
    gpu::Buffer params;
    // Words with the layout of params. Training in float32: one moment in each. Training in 16 bits: both moments in
    // moments1. A gradient: moments1, as float32.
    gpu::Buffer moments1, moments2;
    /// A buffer for the binding of second moments: moments2, or moments1 if it has both moments.
    const gpu::Buffer& second_moments() const { return moments2 ? moments2 : moments1; }
    gpu::Buffer statistics;  // vec2 a splat, if a strategy reads it
};

/// A parameter-sized buffer. Its contents are undefined, except behind the last splat: the rest of that block
/// is zero, so that a checkpoint of the same splats has the same bytes.
gpu::Buffer parameter_buffer(gpu::Device& device, const char* name, gpu::Texel texel, uint32_t capacity,
                             int sh_degree);

/// Replaces the arrays of a model by those of a generation of `splats` splats, one after another: moments1, moments2 if there are
/// any, then params. write(target, source, is_moments): fills `target` from the model's arrays; `source` is the array that `target`
/// replaces. The device must have finished when write returns. The statistics stay.
void replace_generation(
    gpu::Device& device, Model& model, uint32_t splats,
    const std::function<void(const gpu::Buffer& target, const gpu::Buffer& source, bool is_moments)>& write);

/// Uploads a scene. moments: number of buffers of moments, 0 to 2. Moments and statistics are zeroed.
Model upload_model(gpu::Device& device, const Gaussians& gaussians, int moments, bool statistics);

/// Reads `values`, a buffer with the layout of the parameters, back into a scene. After a gradient frame
/// moments1 holds the gradient.
Gaussians download_model(const Model& model, const gpu::Buffer& values);

/// Converts `splats` splats with the layout of the parameters, which are on the host, into a scene.
Gaussians gaussians_of(const Model& model, std::span<const float> values, uint32_t splats);

/// Densification statistics of a new generation: zeros.
gpu::Buffer fresh_statistics(gpu::Device& device, uint32_t splats);

/// Sets a buffer to zero bytes from the host; the device must be idle.
void zero(gpu::Buffer& buffer);

}  // namespace ewa::pipeline
