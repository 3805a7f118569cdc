// SPDX-License-Identifier: Apache-2.0
// The control of the run under synchronisation validation (scripts/check sync): where that is on, it does see
// a barrier that is missing, and where it is off nothing does.
#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>

#include "ewa/error.h"
#include "gpu/guarded.h"

namespace ewa::test {
namespace {

/// Writes one buffer twice in a row. barrier: with what has to stand between.
void write_twice(gpu::Device& device, bool barrier) {
    const gpu::Buffer buffer(device, "written twice", 1024);
    vk::CommandPoolCreateInfo create;
    create.setQueueFamilyIndex(device.queue_family());
    const auto pool = device.handle().createCommandPoolUnique(create);
    const auto commands =
        device.handle().allocateCommandBuffersUnique({*pool, vk::CommandBufferLevel::ePrimary, 1});
    commands[0]->begin(vk::CommandBufferBeginInfo{});
    commands[0]->fillBuffer(buffer.handle(), 0, 1024, 1);
    if (barrier) {
        const vk::MemoryBarrier written(vk::AccessFlagBits::eTransferWrite,
                                        vk::AccessFlagBits::eTransferWrite);
        commands[0]->pipelineBarrier(vk::PipelineStageFlagBits::eTransfer,
                                     vk::PipelineStageFlagBits::eTransfer, {}, written, {}, {});
    }
    commands[0]->fillBuffer(buffer.handle(), 0, 1024, 2);
    commands[0]->end();
}

TEST(Synchronisation, ValidationSeesAMissingBarrierWhereItIsOn) {
    const char* enabled = std::getenv("VK_LAYER_ENABLES");
    const bool on = enabled && std::strstr(enabled, "SYNCHRONIZATION_VALIDATION");
    gpu::Device watched(device()->info(), with_validation());
    write_twice(watched, true);
    EXPECT_NO_THROW(watched.check_validation());
    write_twice(watched, false);
    if (on)
        EXPECT_THROW(watched.check_validation(), RunError);
    else
        EXPECT_NO_THROW(watched.check_validation());
}

}  // namespace
}  // namespace ewa::test
