// SPDX-License-Identifier: Apache-2.0
// One logical device with one compute queue. It counts the memory of its buffers, and states the limits that
// kernels are sized for. Vulkan-Hpp is used with unique handles; it checks results in every build type.
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>
#include <vulkan/vulkan.hpp>

#include "ewa/device.h"
#include "ewa/error.h"
#include "ewa/gpu_interop.h"
#include "gpu/capabilities.h"
#include "gpu/memory.h"

namespace ewa::gpu {

/// The properties of a device that workgroups and buffers depend on.
struct Limits {
    bool cpu = false;                  // a software device: each thread takes a contiguous part of a dispatch
    uint32_t threads = 1;              // that run the kernels of a software device
    uint32_t subgroup_size = 0;        // lanes, the same for every pipeline of this device
    uint32_t max_groups = 65535;       // workgroups of a dispatch, in each dimension
    uint64_t max_storage_range = 0;    // bytes of a storage binding
    uint64_t max_texels = 0;           // elements of a texel buffer view
    bool exact_floats = false;         // shaders ask for exact infinities, NaN and denormals where they can
    bool texel_buffers = true;         // buffers with a texel format are fetched by views; else from storage
    uint64_t uniform_alignment = 256;  // bytes
    uint64_t storage_alignment = 256;  // bytes
    uint32_t max_invocations = 128;    // of a workgroup along x
    uint32_t shared_bytes = 16384;     // of a workgroup's shared memory
    // Bytes. Buffers can lie in pages of the host, which are this large. 0: they cannot, or it would be slow.
    uint64_t host_page = 0;
    bool ballots = false;       // of subgroups
    bool scalar_loads = false;  // a load from the same address in all lanes costs next to nothing
    bool timestamps = false;
    double timestamp_nanoseconds = 1.0;
};

class PipelineStore;

class Device {
  public:
    /// own_queue: as in DeviceOptions. instance: of which `info` is a device, without validation. Null: it gets one of its own.
    Device(const DeviceInfo& info, bool validation, bool own_queue = true, vk::UniqueInstance instance = {});
    /// Uses a caller's device, which the caller destroys. Throws as borrow_device does.
    explicit Device(const VulkanDevice& borrowed);
    ~Device();
    Device(const Device&) = delete;
    Device& operator=(const Device&) = delete;

    const DeviceInfo& info() const { return info_; }
    const Limits& limits() const { return limits_; }
    vk::Device handle() const { return device_; }
    uint32_t queue_family() const { return queue_family_; }
    vk::PhysicalDevice physical() const { return physical_; }
    bool subgroup_size_control() const { return subgroup_size_control_; }
    vk::PipelineCache pipeline_cache() const { return *pipeline_cache_; }
    PipelineStore& pipelines() { return *pipelines_; }

    /// Submits to the queue. Calls may come from any thread.
    void submit(const vk::SubmitInfo& info, vk::Fence fence);

    /// The properties of 32-bit floats that pipelines request: those of the device. None of a CPU device: lavapipe keeps NaN
    /// anyway, and computes other bytes when asked.
    FloatModes float_modes() const { return limits_.exact_floats ? float_modes_ : FloatModes{}; }

    /// Throws out_of_memory if the driver has no memory left.
    Memory allocate(const vk::MemoryRequirements& requirements, bool host_visible);
    /// The error of a failed allocation. It states the requested bytes and the allocated ones.
    RunError out_of_memory(uint64_t bytes) const;
    /// Replaces the limits for which kernels and buffers are made from now on. For tests.
    void pretend(const Limits& limits) { limits_ = limits; }
    /// As MemoryPool::limit_host_access().
    void limit_host_access(HostAccess most) { memory_->limit_host_access(most); }
    /// Limits the bytes of all memory blocks together, from now on; 0: no limit. make_room: called when an allocation does
    /// not fit, to free memory that is not needed now; returns false if there is none.
    void limit_memory(uint64_t bytes, std::function<bool()> make_room);
    void make_room_with(std::function<bool()> make_room) { make_room_ = std::move(make_room); }
    uint64_t memory_limit() const { return memory_->limit(); }
    /// Bytes of a buffer through which the host copies at one time.
    uint64_t staging_bytes() const;
    MemoryUse memory_use() const { return memory_->use(); }
    uint64_t allocated_bytes() const { return memory_use().used; }
    uint64_t peak_bytes() const { return memory_use().peak; }

    /// Throws RunError with the validation layer's first message since the last call.
    void check_validation();
    /// Stores a message of the validation layer for check_validation(). Ignores messages that are not about ewa's calls.
    void add_validation_message(const std::string& message);

  private:
    void create_instance(bool validation);
    void create_device(bool own_queue);
    /// Reads the properties of device_, which was created with `enabled`.
    void use_device(const Enabled& enabled);

    DeviceInfo info_;
    Limits limits_;
    vk::UniqueInstance instance_;  // null if the device is a caller's
    VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
    vk::PhysicalDevice physical_;
    vk::UniqueDevice own_device_;  // null if the device is a caller's
    vk::Device device_;
    std::unique_ptr<MemoryPool> memory_;
    std::function<bool()> make_room_;
    vk::Queue queue_;
    std::function<VkResult(const VkSubmitInfo&, VkFence)> submit_;  // in place of the queue's
    std::mutex queue_mutex_;
    vk::UniquePipelineCache pipeline_cache_;
    std::unique_ptr<PipelineStore> pipelines_;
    uint32_t queue_family_ = 0;
    bool subgroup_size_control_ = false;
    FloatModes float_modes_;
    std::mutex message_mutex_;
    std::vector<std::string> messages_;
};

/// Calls action. Turns the driver's exceptions into RunError with the device's name.
template <class Action>
void with_driver_errors(const Device& device, Action action) {
    try {
        action();
    } catch (const vk::DeviceLostError&) {
        throw RunError(
            "device " + device.info().name +
            " was lost: its driver has reset it, or it is gone; --resume continues a training run");
    } catch (const vk::SystemError& error) {
        throw RunError("device " + device.info().name + ": " + error.what());
    }
}

}  // namespace ewa::gpu
