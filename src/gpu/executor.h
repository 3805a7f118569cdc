// SPDX-License-Identifier: Apache-2.0
// Turns recordings into submissions, and times every command by its name.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "gpu/recording.h"

namespace ewa::gpu {

struct Timing {
    std::string name;
    double milliseconds = 0;
};

class Executor {
  public:
    explicit Executor(Device& device);

    /// Submits and waits until the device is done; everything it wrote is then visible to the host. timed:
    /// keep the time of each command. Throws RunError when the device is lost or the validation layer speaks.
    void run(const Recording& recording, bool timed = false);

    /// Of the last timed run: one entry a name, in order of first appearance, times of equal names added up.
    /// The time of a command reaches from the end of the one before it to its own end.
    const std::vector<Timing>& timings() const { return timings_; }

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
    std::vector<Timing> timings_;
};

}  // namespace ewa::gpu
