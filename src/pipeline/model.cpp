// SPDX-License-Identifier: Apache-2.0
#include "pipeline/model.h"

#include <algorithm>
#include <cstring>
#include <vector>

namespace ewa::pipeline {
namespace {

/// Calls visit(position in the buffer, float of the scene) for every stored value.
template <class Scene, class Visit>
void for_each_value(Scene& g, Visit visit) {
    const uint32_t planes = parameter_planes(g.sh_degree);
    const auto each = [&](size_t i, uint32_t first, size_t count, auto& values) {
        for (size_t c = 0; c < count; ++c)
            visit(parameter_index(planes, first + uint32_t(c), i), values[count * i + c]);
    };
    for (size_t i = 0; i < g.size(); ++i) {
        each(i, shared::PARAM_MEAN, 3, g.means);
        each(i, shared::PARAM_OPACITY, 1, g.opacity_logits);
        each(i, shared::PARAM_QUATERNION, 4, g.quaternions);
        each(i, shared::PARAM_LOG_SCALE, 3, g.log_scales);
        each(i, shared::PARAM_SH, g.sh_stride(), g.sh);
    }
}

}  // namespace

void zero(gpu::Buffer& buffer) {
    if (buffer.mapped()) {
        std::memset(buffer.mapped(), 0, buffer.bytes());
        return;
    }
    const std::vector<std::byte> zeros(std::min<uint64_t>(buffer.bytes(), 1u << 24));
    for (uint64_t at = 0; at < buffer.bytes(); at += zeros.size())
        buffer.upload(std::span(zeros).first(std::min<uint64_t>(zeros.size(), buffer.bytes() - at)), at);
}

gpu::Buffer parameter_buffer(gpu::Device& device, const char* name, uint32_t capacity, int sh_degree) {
    const uint64_t bytes = parameter_bytes(capacity, sh_degree);
    gpu::Buffer buffer(device, name, bytes, gpu::Texel::rgba32f);
    const std::vector<float> block(size_t(parameter_planes(sh_degree)) * shared::PARAM_BLOCK * 4);
    buffer.upload(std::span<const float>(block), bytes - block.size() * 4);
    return buffer;
}

Model next_generation(gpu::Device& device, const Model& model, uint32_t splats) {
    Model next;
    next.splats = next.capacity = splats;
    next.sh_degree = model.sh_degree;
    next.origin = model.origin;
    next.params = parameter_buffer(device, "params", splats, model.sh_degree);
    next.moments1 = parameter_buffer(device, "moments1", splats, model.sh_degree);
    next.moments2 = parameter_buffer(device, "moments2", splats, model.sh_degree);
    return next;
}

Model upload_model(gpu::Device& device, const Gaussians& gaussians, int moments, bool statistics) {
    Model model;
    model.splats = model.capacity = uint32_t(gaussians.size());
    model.sh_degree = gaussians.sh_degree;
    model.origin = gaussians.origin;
    const uint64_t bytes = parameter_bytes(model.capacity, model.sh_degree);
    model.params = gpu::Buffer(device, "params", bytes, gpu::Texel::rgba32f);
    std::vector<float> values(bytes / 4);
    for_each_value(gaussians, [&](size_t at, float value) { values[at] = value; });
    model.params.upload(std::span<const float>(values));
    if (moments >= 1) model.moments1 = gpu::Buffer(device, "moments1", bytes, gpu::Texel::rgba32f);
    if (moments >= 2) model.moments2 = gpu::Buffer(device, "moments2", bytes, gpu::Texel::rgba32f);
    if (statistics)
        model.statistics = gpu::Buffer(device, "statistics", std::max<uint64_t>(8ull * model.capacity, 8));
    for (gpu::Buffer* buffer : {&model.moments1, &model.moments2, &model.statistics})
        if (*buffer) zero(*buffer);
    return model;
}

Gaussians download_model(const Model& model, const gpu::Buffer& buffer) {
    Gaussians gaussians;
    gaussians.sh_degree = model.sh_degree;
    gaussians.origin = model.origin;
    gaussians.resize(model.splats);
    const auto values = buffer.download<float>(parameter_bytes(model.capacity, model.sh_degree) / 4);
    for_each_value(gaussians, [&](size_t at, float& value) { value = values[at]; });
    return gaussians;
}

}  // namespace ewa::pipeline
