// SPDX-License-Identifier: Apache-2.0
// Turns recordings into submissions, and times every command by its name. The device runs submissions one after
// the other; the host may be a few ahead of it. A recording that is kept is turned into the device's commands once, and submitted any
// number of times.
#pragma once
#include <cstdint>
#include <deque>
#include <span>
#include <string>
#include <vector>

#include "gpu/recording.h"

namespace ewa::gpu {

/// Bytes of a pixel in a target. Throws InputError for a format that no target can have.
uint32_t pixel_bytes(VkFormat format);
/// Throws InputError unless the target holds an image of this size.
void check_target(const DeviceTarget& target, uint32_t width, uint32_t height);

class Executor {
  public:
    /// ahead: submissions that may be unfinished at one time, at least 1.
    explicit Executor(Device& device, uint32_t ahead = 1);
    ~Executor() { finish(); }
    Executor(const Executor&) = delete;

    /// Submits a recording. Its buffers and pipelines must live until wait() has returned for it. timed: also measures
    /// each command. Throws RunError if the device is lost, std::logic_error if too many submissions are unfinished.
    void submit(const Recording& recording, bool timed = false);
    /// Keeps a recording under a number from 0, in place of an earlier one. Its buffers and pipelines must live as long as it is
    /// submitted. timed: each submission measures its commands. Throws std::logic_error if an unfinished submission uses the earlier
    /// one.
    void keep(uint32_t number, const Recording& recording, bool timed = false);
    /// Submits a recording and then the kept one, which no unfinished submission may use. timed: also measures the commands of the
    /// first.
    void submit(const Recording& first, uint32_t kept, bool timed);
    /// Submissions that wait() has not returned for.
    uint32_t unfinished() const { return unfinished_; }
    /// Waits until the oldest unfinished submission is done. Then everything that it wrote is visible to the
    /// host. Throws RunError if the device is lost or the validation layer has a message.
    void wait();
    /// Waits for all submissions, so that their buffers may go. A lost device counts as done.
    void finish() noexcept;
    /// Submits, and waits for this and all before it.
    void run(const Recording& recording, bool timed = false);

    /// A copy of an image from a buffer to a target. The source has rows of `stride` pixels, with one word a pixel, or four
    /// words for VK_FORMAT_R32G32B32A32_SFLOAT.
    struct CopyOut {
        const Buffer* source;
        uint32_t stride, width, height;
        const DeviceTarget* target;
    };
    /// Copies into a caller's images and buffers after all earlier submissions, and waits.
    void copy_out(std::span<const CopyOut> copies, const DeviceSync& sync);

    /// The times of the last timed submission that is done: one entry a name, in the order of recording, with
    /// the sum of all commands of that name. The time of a command begins at the end of the one before it.
    const std::vector<PassTime>& timings() const { return timings_; }

  private:
    /// The device's commands of a recording, and the objects that they need.
    struct Commands {
        vk::UniqueCommandBuffer buffer;
        vk::UniqueDescriptorPool descriptor_pool;
        uint32_t pool_sets = 0, pool_bindings = 0;
        vk::UniqueQueryPool queries;
        uint32_t query_count = 0;
        std::vector<std::string> timed_names;  // of the commands; empty: not timed
    };
    /// A submission until it is done.
    struct Slot {
        Commands own;
        vk::UniqueFence fence;
        const Commands* kept = nullptr;  // which follow; null: none
    };

    Commands new_commands();
    vk::DescriptorSet bind(const Command& command, vk::DescriptorPool pool);
    void record(const Recording& recording, Commands& commands, bool timed,
                vk::CommandBufferUsageFlags usage);
    void record(std::span<const CopyOut> copies, vk::CommandBuffer commands) const;
    Slot& free_slot();
    /// Whether an unfinished submission uses kept commands.
    bool used(const Commands& commands) const;
    /// Submits the slot's commands, with what `info` has besides.
    void submit(Slot& slot, vk::SubmitInfo info = {});
    void add_timings(const Commands& commands);
    void reserve(Commands& commands, const Recording& recording, bool timed);

    Device& device_;
    vk::UniqueCommandPool command_pool_;
    std::vector<Slot> slots_;
    std::deque<Commands> kept_;  // by number
    uint32_t next_ = 0, unfinished_ = 0;
    std::vector<PassTime> timings_;
};

}  // namespace ewa::gpu
