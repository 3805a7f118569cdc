// SPDX-License-Identifier: Apache-2.0
#include "pipeline/model.h"

#include <algorithm>
#include <cstring>
#include <vector>

#include "scene/splat_arrays.h"

namespace ewa::pipeline {
namespace {

// Splats that are copied at once: whole blocks, about 60 MiB at SH degree 3.
constexpr size_t kPiece = size_t(1) << 18;
static_assert(kPiece % shared::PARAM_BLOCK == 0);

/// Calls visit(position in a buffer that begins with splat `from`, float of the scene) for every stored value of
/// splats from to `to`. from: a multiple of PARAM_BLOCK.
template <class Scene, class Visit>
void for_each_value(Scene& g, size_t from, size_t to, Visit visit) {
    const uint32_t planes = parameter_planes(g.sh_degree);
    const auto each = [&](size_t i, uint32_t first, size_t count, auto& values) {
        for (size_t c = 0; c < count; ++c)
            visit(parameter_index(planes, first + uint32_t(c), i - from), values[count * i + c]);
    };
    for (size_t i = from; i < to; ++i) {
        each(i, shared::PARAM_MEAN, 3, g.means);
        each(i, shared::PARAM_OPACITY, 1, g.opacity_logits);
        each(i, shared::PARAM_QUATERNION, 4, g.quaternions);
        each(i, shared::PARAM_LOG_SCALE, 3, g.log_scales);
        each(i, shared::PARAM_SH, g.sh_stride(), g.sh);
    }
}

/// Calls visit(first splat, end, bytes of a buffer before the first splat, floats of these splats) for each piece.
template <class Visit>
void for_each_piece(size_t splats, int sh_degree, Visit visit) {
    for (size_t from = 0; from < splats; from += kPiece) {
        const size_t to = std::min(splats, from + kPiece);
        visit(from, to, from == 0 ? 0 : parameter_bytes(uint32_t(from), sh_degree),
              size_t(parameter_bytes(uint32_t(to - from), sh_degree) / 4));
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

gpu::Buffer fresh_statistics(gpu::Device& device, uint32_t splats) {
    gpu::Buffer statistics(device, "statistics", std::max<uint64_t>(8ull * splats, 8));
    zero(statistics);
    return statistics;
}

gpu::Buffer parameter_buffer(gpu::Device& device, const char* name, gpu::Texel texel, uint32_t capacity,
                             int sh_degree) {
    const uint64_t bytes = parameter_bytes(capacity, sh_degree);
    gpu::Buffer buffer(device, name, bytes, texel);
    const std::vector<float> block(size_t(parameter_planes(sh_degree)) * shared::PARAM_BLOCK * 4);
    buffer.upload(std::span<const float>(block), bytes - block.size() * 4);
    return buffer;
}

void replace_generation(
    gpu::Device& device, Model& model, uint32_t splats,
    const std::function<void(const gpu::Buffer& target, const gpu::Buffer& source, bool is_moments)>& write) {
    // The parameters come last: what a splat becomes depends on them.
    for (gpu::Buffer* array : {&model.moments1, &model.moments2, &model.params}) {
        if (!*array) continue;
        gpu::Buffer next =
            parameter_buffer(device, array->name().c_str(), array->texel(), splats, model.sh_degree);
        write(next, *array, array != &model.params);
        *array = std::move(next);
    }
    model.splats = model.capacity = splats;
}

Model upload_model(gpu::Device& device, const Gaussians& gaussians, int moments, bool statistics) {
    if (!scene::is_computable(gaussians))
        return upload_model(device, scene::computable(gaussians), moments, statistics);
    Model model;
    model.splats = model.capacity = model.all = uint32_t(gaussians.size());
    model.sh_degree = gaussians.sh_degree;
    model.origin = gaussians.origin;
    const uint64_t bytes = parameter_bytes(model.capacity, model.sh_degree);
    model.params = parameter_buffer(device, "params", gpu::Texel::rgba32f, model.capacity, model.sh_degree);
    for_each_piece(
        gaussians.size(), model.sh_degree, [&](size_t from, size_t to, uint64_t offset, size_t floats) {
            std::vector<float> values(floats);
            for_each_value(gaussians, from, to, [&](size_t at, float value) { values[at] = value; });
            model.params.upload(std::span<const float>(values), offset);
        });
    if (moments >= 1) model.moments1 = gpu::Buffer(device, "moments1", bytes, gpu::Texel::rgba32ui);
    if (moments >= 2) model.moments2 = gpu::Buffer(device, "moments2", bytes, gpu::Texel::rgba32ui);
    for (gpu::Buffer* buffer : {&model.moments1, &model.moments2})
        if (*buffer) zero(*buffer);
    if (statistics) model.statistics = fresh_statistics(device, model.capacity);
    return model;
}

Gaussians download_model(const Model& model, const gpu::Buffer& buffer) {
    Gaussians gaussians;
    gaussians.sh_degree = model.sh_degree;
    gaussians.origin = model.origin;
    gaussians.resize(model.splats);
    for_each_piece(
        model.splats, model.sh_degree, [&](size_t from, size_t to, uint64_t offset, size_t floats) {
            const auto values = buffer.download<float>(floats, offset);
            for_each_value(gaussians, from, to, [&](size_t at, float& value) { value = values[at]; });
        });
    return gaussians;
}

Gaussians gaussians_of(const Model& model, std::span<const float> values, uint32_t splats) {
    Gaussians gaussians;
    gaussians.sh_degree = model.sh_degree;
    gaussians.origin = model.origin;
    gaussians.resize(splats);
    for_each_value(gaussians, 0, splats, [&](size_t at, float& value) { value = values[at]; });
    return gaussians;
}

}  // namespace ewa::pipeline
