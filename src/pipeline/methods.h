// SPDX-License-Identifier: Apache-2.0
// The passes of each method of scene/methods.h, which FramePasses records between those that all methods have in common.
#pragma once
#include "passes/passes.h"
#include "pipeline/frame_passes.h"

namespace ewa::pipeline {

/// Records the pass that a method has for one stage of a frame. mode: SPEC_MODE, which the pass of splats uses.
template <class Buffers, class Push>
using MethodPass = void (*)(const FramePasses& on, const Buffers& buffers, const Push& push,
                            gpu::SpecConstant mode);

struct MethodPasses {
    MethodPass<passes::ProjectBuffers, shared::ProjectPush> project;
    MethodPass<passes::BlendBuffers, shared::BlendPush> blend;
    MethodPass<passes::BlendBackwardBuffers, shared::BlendPush> blend_backward;
    MethodPass<passes::UpdateBuffers, shared::UpdateBlock> update;
};

const MethodPasses& passes_of(const scene::Method& method);

}  // namespace ewa::pipeline
