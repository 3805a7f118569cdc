// SPDX-License-Identifier: Apache-2.0
#include "operators/context.h"

#include "operators/blend_frame.h"
#include "operators/splat_buffers.h"

namespace ewa {

namespace operators {

Context::Context(std::shared_ptr<gpu::Device> d)
    : device(std::move(d)),
      cache(*device),
      executor(*device),
      projection(std::make_unique<ProjectionBuffers>()),
      harmonics(std::make_unique<HarmonicsBuffers>()) {}
Context::~Context() = default;

}  // namespace operators

Operators::Operators(std::shared_ptr<gpu::Device> device)
    : context_(std::make_shared<operators::Context>(std::move(device))) {}
Operators::~Operators() = default;

}  // namespace ewa
