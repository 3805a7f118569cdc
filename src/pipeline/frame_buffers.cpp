// SPDX-License-Identifier: Apache-2.0
#include "pipeline/frame_buffers.h"

#include <cstring>

#include "pipeline/model.h"

namespace ewa::pipeline {
namespace {

using gpu::Texel;

void grow(gpu::Device& device, gpu::Buffer& buffer, const char* name, uint64_t bytes,
          Texel texel = Texel::none) {
    if (bytes == 0 || (buffer && buffer.bytes() >= bytes)) return;
    buffer = gpu::Buffer();  // free the old one first: its contents are not needed
    buffer = gpu::Buffer(device, name, bytes, texel);
}

}  // namespace

void FrameBuffers::reserve(gpu::Device& device, const passes::KernelConfig& config,
                           const FrameRequest& request) {
    const Sizes old = sizes;
    sizes = sizes_for(config, request);
    instance_capacity = request.instances;
    if (!counts) counts = gpu::Buffer(device, "counts", sizeof(shared::Counts), Texel::none, false, true);

    grow(device, records, "records", sizes.records, Texel::rgba32f);
    for (auto& buffer : depth_keys) grow(device, buffer, "depth keys", sizes.splat_words, Texel::rgba32ui);
    for (auto& buffer : order) grow(device, buffer, "order", sizes.splat_words, Texel::rgba32ui);
    grow(device, tile_counts, "tile counts", sizes.splat_words);
    grow(device, prefix, "prefix", sizes.splat_words);
    grow(device, scan_totals, "scan totals", sizes.scan_totals);
    grow(device, counters, "counters", sizes.counters);
    grow(device, counter_prefix, "counter prefix", sizes.counters);
    grow(device, digit_totals, "digit totals", sizes.digit_totals);
    for (auto& buffer : instance_keys)
        grow(device, buffer, "instance keys", sizes.instance_words, Texel::rgba32ui);
    for (auto& buffer : instance_splats)
        grow(device, buffer, "instance splats", sizes.instance_words, Texel::rgba32ui);
    grow(device, tile_starts, "tile starts", sizes.tile_starts);
    // Without gradients no pass reads where a splat's instances begin, but the binding needs a buffer.
    grow(device, first_instances, "first instances", request.gradients ? sizes.splat_words : 16);

    grow(device, planes, "planes", sizes.planes, Texel::rgba32f);
    if (request.gradients) {
        grow(device, target, "target", sizes.target, Texel::rgba32f);
        grow(device, exposed, "exposed", sizes.exposed, Texel::rgba32f);
        grow(device, masked, "masked", sizes.masked, Texel::rgba32f);
        grow(device, moments, "moments", sizes.moments, Texel::rgba32f);
        grow(device, derivatives, "derivatives", sizes.derivatives, Texel::rgba32f);
        grow(device, blurred, "blurred", sizes.derivatives, Texel::rgba32f);
        grow(device, image_gradient, "image gradient", sizes.image_gradient, Texel::rgba32f);
        grow(device, partials, "partials", sizes.partial_sums);
        grow(device, exposure_sums, "exposure sums", sizes.exposure_sums);
        grow(device, reduced, "reduced", sizes.reduced);
        for (auto& buffer : sorted_indices)
            grow(device, buffer, "sorted indices", sizes.instance_words, Texel::rgba32ui);
        grow(device, slots, "slots", sizes.slots, Texel::rgba32f);
    }
    // The loss reads the columns between an image's width and its stride as black. No pass writes them.
    if (old.plane_floats != sizes.plane_floats || old.stride != sizes.stride ||
        old.image_planes != sizes.image_planes) {
        zero(planes);
        if (target) zero(target);
        if (exposed) zero(exposed);
        if (masked) zero(masked);
    }
}

shared::Counts FrameBuffers::read_counts() const {
    shared::Counts result;
    std::memcpy(&result, counts.mapped(), sizeof(result));
    return result;
}

}  // namespace ewa::pipeline
