// SPDX-License-Identifier: Apache-2.0
// Turns recordings into submissions, and times every command by its name.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "gpu/recording.h"

namespace ewa::gpu {

class Executor {
  public:
    explicit Executor(Device& device);

    /// Submits, and waits until the device is done. Then everything that it wrote is visible to the host.
    /// timed: also measures each command. Throws RunError if the device is lost or the validation layer has a
    /// message.
    void run(const Recording& recording, bool timed = false);

    /// The times of the last timed run: one entry a name, in the order of recording, with the sum of all
    /// commands of that name. The time of a command begins at the end of the one before it.
    const std::vector<PassTime>& timings() const { return timings_; }

  private:
    vk::DescriptorSet bind(const Command& command, vk::DescriptorPool pool);
    void record(const Recording& recording, vk::CommandBuffer commands, bool timed);
    void read_timings(const Recording& recording);
    void reserve(const Recording& recording, bool timed);

    Device& device_;
    vk::UniqueCommandPool command_pool_;
    vk::UniqueCommandBuffer commands_;
    vk::UniqueFence fence_;
    vk::UniqueDescriptorPool descriptor_pool_;
    uint32_t pool_sets_ = 0, pool_bindings_ = 0;
    vk::UniqueQueryPool queries_;
    uint32_t query_count_ = 0;
    std::vector<PassTime> timings_;
};

}  // namespace ewa::gpu
