// SPDX-License-Identifier: Apache-2.0
#include "pipeline/methods.h"

#include <algorithm>
#include <array>
#include <bit>

namespace ewa::pipeline {
namespace {

using On = const FramePasses&;
using Mode = gpu::SpecConstant;

/// A binding that a mode does not use needs a buffer.
gpu::BufferPart marks_or_any(On on, const passes::ProjectBuffers& buffers) {
    return on.inputs.marks ? gpu::BufferPart(*on.inputs.marks)
                           : gpu::BufferPart(*buffers.params.buffer, 0, 16);
}

/// Only SLOTS_EMITTED reads the indices.
const gpu::Buffer& indices_or_splats(On on, const passes::BlendBuffers& buffers) {
    return on.frame.slots_emitted() ? on.frame.sorted_indices[1] : *buffers.splats.buffer;
}

constexpr MethodPasses kSplats{
    .project =
        [](On on, auto& buffers, auto& push, Mode mode) {
            on.record(passes::Project{buffers, marks_or_any(on, buffers)}, push,
                      {on.degree(), mode, on.kernel(), on.lenses(), on.wrap(), on.quads()});
        },
    .blend =
        [](On on, auto& buffers, auto& push, Mode mode) {
            on.record_tiles(passes::Blend{buffers, indices_or_splats(on, buffers)}, push,
                            {mode, on.kernel()});
        },
    .blend_backward =
        [](On on, auto& buffers, auto& push, Mode mode) {
            on.record_tiles(passes::BlendBackward{buffers, indices_or_splats(on, buffers)}, push,
                            {mode, on.kernel()});
        },
    .update =
        [](On on, auto& buffers, auto& push, Mode mode) {
            // A binding that a mode does not use needs a buffer.
            on.record(passes::Update{buffers, on.plan.motion ? on.frame.motion_sums : on.frame.partials},
                      push, {on.degree(), mode, on.kernel(), on.lenses(), on.slots()});
        }};

constexpr MethodPasses kSpheres{
    .project =
        [](On on, auto& buffers, auto& push, Mode mode) {
            on.record(passes::ProjectPoints{buffers, marks_or_any(on, buffers)}, push, {on.degree(), mode});
        },
    .blend =
        [](On on, auto& buffers, auto& push, Mode mode) {
            on.record(passes::BlendPoints{buffers}, push, {mode, {shared::SPEC_NEAREST, on.plan.nearest}});
        },
    .blend_backward =
        [](On on, auto& buffers, auto& push, Mode mode) {
            on.record(passes::BlendPointsBackward{buffers}, push,
                      {mode, {shared::SPEC_NEAREST, on.plan.nearest}});
        },
    .update =
        [](On on, auto& buffers, auto& push, Mode mode) {
            on.record(passes::UpdatePoints{buffers}, push, {on.degree(), mode});
        }};

template <class Pass, class Buffers>
Pass along_rays(On on, const Buffers& buffers) {
    return {{buffers, on.frame.rays, on.camera(), on.frame.counts}};
}

/// The slots of passes that add to them are zero before. A driver may limit the iterations of an invocation: each strip of the
/// tiles has its own dispatch.
template <class Backward>
void record_strips(On on, const passes::BlendBackwardBuffers& buffers, const shared::BlendPush& push,
                   const passes::Constants& variant) {
    on.recording.fill(on.frame.slots, 0, 0, on.frame.sizes.slots);
    for (uint32_t strip = 0; strip < passes::strips_of(on.cache.config()); ++strip)
        on.record(along_rays<Backward>(on, buffers),
                  {.blend = push, .samples = on.inputs.samples, .strip = strip}, variant);
}

/// Intervals of a ray that a march evaluates together; most: a power of two.
Mode march_group(On on, uint32_t most) {
    return {shared::SPEC_MODE, std::min(std::bit_ceil(on.inputs.samples), most)};
}

/// mode: 0 or PROJECT_RAYS_*.
template <uint32_t mode>
void project_rays(On on, const passes::ProjectBuffers& buffers, const shared::ProjectPush& push, Mode) {
    on.record(passes::ProjectRays{buffers, on.frame.rays}, push,
              {on.degree(), on.kernel(), {shared::SPEC_MODE, mode}, on.lenses(), on.wrap()});
}

void update_rays(On on, const passes::UpdateBuffers& buffers, const shared::UpdateBlock& push, Mode mode) {
    on.record(passes::UpdateRays{buffers}, push, {on.degree(), mode, on.kernel(), on.lenses()});
}

constexpr MethodPasses kRays{
    .project = project_rays<0>,
    .blend =
        [](On on, auto& buffers, auto& push, Mode mode) {
            on.record(along_rays<passes::BlendRays>(on, buffers),
                      {.blend = push, .samples = on.inputs.samples, .strip = 0},
                      {on.kernel(), mode, on.lenses()});
        },
    .blend_backward =
        [](On on, auto& buffers, auto& push, Mode) {
            record_strips<passes::BlendRaysBackward>(on, buffers, push, {on.kernel(), on.lenses()});
        },
    .update = update_rays};

constexpr MethodPasses kMarch{
    .project = project_rays<shared::PROJECT_RAYS_DEEP>,
    .blend =
        [](On on, auto& buffers, auto& push, Mode) {
            on.record(along_rays<passes::MarchRays>(on, buffers),
                      {.blend = push, .samples = on.inputs.samples, .strip = 0},
                      {on.kernel(), march_group(on, on.cache.config().texel_buffers ? 16 : 8), on.lenses()});
        },
    .blend_backward =
        [](On on, auto& buffers, auto& push, Mode) {
            record_strips<passes::MarchRaysBackward>(on, buffers, push,
                                                     {on.kernel(), march_group(on, 8), on.lenses()});
        },
    .update = update_rays};

constexpr MethodPasses kFastRays{
    .project = project_rays<shared::PROJECT_RAYS_BY_MEAN>,
    .blend =
        [](On on, auto& buffers, auto& push, Mode mode) {
            on.record(along_rays<passes::BlendFastRays>(on, buffers), push, {on.kernel(), mode, on.lenses()});
        },
    .blend_backward =
        [](On on, auto& buffers, auto& push, Mode) {
            on.recording.fill(on.frame.slots, 0, 0, on.frame.sizes.slots);
            on.record(along_rays<passes::BlendFastRaysBackward>(on, buffers), push,
                      {on.kernel(), on.lenses()});
        },
    .update = update_rays};

/// In the order of scene::MethodKind.
constexpr std::array kPassesOfMethods{kSplats, kRays, kMarch, kFastRays, kSpheres};

}  // namespace

const MethodPasses& passes_of(const scene::Method& method) {
    return kPassesOfMethods[size_t(method.kind)];
}

}  // namespace ewa::pipeline
