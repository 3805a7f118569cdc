// SPDX-License-Identifier: Apache-2.0
// The buffers of one blended image. They live as long as its record, and are then used again.
#pragma once
#include "operators/context.h"
#include "pipeline/frame_buffers.h"

namespace ewa::operators {

struct BlendFrame {
    pipeline::FrameBuffers frame;
};

}  // namespace ewa::operators
