// SPDX-License-Identifier: Apache-2.0
// A splat scene on the device: parameters, and in training Adam's moments. The only thing that a step
// changes.
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

/// Where flat float f of splat i stands in such a buffer, in floats, where `planes` texel planes are stored a
/// splat (shared/layouts.h).
constexpr size_t parameter_index(uint32_t planes, uint32_t f, size_t i) {
    const size_t block = i / shared::PARAM_BLOCK, within = i % shared::PARAM_BLOCK;
    return ((block * planes + f / 4) * shared::PARAM_BLOCK + within) * 4 + f % 4;
}

struct Model {
    uint32_t splats = 0, capacity = 0;
    int sh_degree = 0;       // stored
    glm::dvec3 origin{0.0};  // of the means, see Gaussians; a camera's position is taken relative to it
    uint32_t planes() const { return parameter_planes(sh_degree); }
    gpu::Buffer params;
    gpu::Buffer moments1, moments2;  // only where it is trained, or a gradient is taken (moments1)
    gpu::Buffer statistics;          // vec2 a splat; only where a strategy needs it
};

/// A parameter-sized buffer. Its contents are undefined but for the room behind the last splat, which is
/// zero: nothing reads it, and a checkpoint of the same splats has the same bytes.
gpu::Buffer parameter_buffer(gpu::Device& device, const char* name, uint32_t capacity, int sh_degree);

/// Room for `splats` splats of the same degree with both moments, to be written whole; no statistics.
Model next_generation(gpu::Device& device, const Model& model, uint32_t splats);

/// moments: 0 none, 1 the first only (a gradient), 2 both, zeroed.
Model upload_model(gpu::Device& device, const Gaussians& gaussians, int moments, bool statistics);

/// The parameters, or the buffer of the same layout given (moments1 holds a gradient after a gradient step).
Gaussians download_model(const Model& model, const gpu::Buffer& values);

/// Sets a buffer to zero bytes from the host; the device must be idle.
void zero(gpu::Buffer& buffer);

}  // namespace ewa::pipeline
