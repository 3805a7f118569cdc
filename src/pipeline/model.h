// SPDX-License-Identifier: Apache-2.0
// A splat scene on the device: parameters, and in training Adam's moments. A training
// step changes nothing else.
#pragma once
#include <cstdint>

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

/// Index of flat float f of splat i in such a buffer, in floats. planes: texel
/// planes a splat (shared/layouts.h).
constexpr size_t parameter_index(uint32_t planes, uint32_t f, size_t i) {
    const size_t block = i / shared::PARAM_BLOCK, within = i % shared::PARAM_BLOCK;
    return ((block * planes + f / 4) * shared::PARAM_BLOCK + within) * 4 + f % 4;
}

struct Model {
    uint32_t splats = 0, capacity = 0;
    int sh_degree = 0;       // stored
    glm::dvec3 origin{0.0};  // of the means, see Gaussians; camera positions are relative to it too
    uint32_t planes() const { return parameter_planes(sh_degree); }
    gpu::Buffer params;
    gpu::Buffer moments1, moments2;  // both in training; moments1 for a gradient
    gpu::Buffer statistics;          // vec2 a splat, if a strategy reads it
};

/// A parameter-sized buffer. Its contents are undefined, except behind the last splat: the rest of that block
/// is zero, so that a checkpoint of the same splats has the same bytes.
gpu::Buffer parameter_buffer(gpu::Device& device, const char* name, uint32_t capacity, int sh_degree);

/// Buffers for `splats` splats of the same degree with both moments, undefined; no statistics.
Model next_generation(gpu::Device& device, const Model& model, uint32_t splats);

/// moments: 0 none, 1 the first (a gradient), 2 both. They and the statistics are zeroed.
Model upload_model(gpu::Device& device, const Gaussians& gaussians, int moments, bool statistics);

/// Reads `values`, a buffer with the layout of the parameters, back into a scene. After a gradient frame
/// moments1 holds the gradient.
Gaussians download_model(const Model& model, const gpu::Buffer& values);

/// Sets a buffer to zero bytes from the host; the device must be idle.
void zero(gpu::Buffer& buffer);

}  // namespace ewa::pipeline
