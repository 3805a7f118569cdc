// SPDX-License-Identifier: Apache-2.0
// One logical device with one compute queue, its memory accounting and the properties kernels are shaped by.
#pragma once
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "ewa/device.h"
#include "gpu/vulkan.h"

namespace ewa::gpu {

/// What kernel shapes and sizes are chosen from.
struct Limits {
    bool cpu = false;                  // a software device: threads take contiguous halves of a dispatch
    uint32_t subgroup_size = 0;        // lanes; what every pipeline of this device runs with
    uint32_t max_groups = 65535;       // workgroups a dispatch, per dimension
    uint32_t max_group_size = 0;       // invocations a workgroup
    uint64_t max_storage_range = 0;    // bytes a storage binding may span
    uint64_t max_texels = 0;           // elements a texel buffer view may span
    uint64_t uniform_alignment = 256;  // bytes
    uint64_t max_allocation = 0;       // bytes
    bool timestamps = false;
    double timestamp_nanoseconds = 1.0;
};

class Device {
  public:
    Device(const DeviceInfo& info, bool validation);
    ~Device();
    Device(const Device&) = delete;
    Device& operator=(const Device&) = delete;

    const DeviceInfo& info() const { return info_; }
    const Limits& limits() const { return limits_; }
    vk::Device handle() const { return *device_; }
    vk::Queue queue() const { return queue_; }
    uint32_t queue_family() const { return queue_family_; }
    vk::PhysicalDevice physical() const { return physical_; }
    bool subgroup_size_control() const { return subgroup_size_control_; }
    vk::PipelineCache pipeline_cache() const { return *pipeline_cache_; }

    /// Throws RunError with the bytes asked for and held when the driver is out of memory.
    vk::UniqueDeviceMemory allocate(const vk::MemoryRequirements& requirements, bool host_visible,
                                    bool& mapped_kind);
    void released(uint64_t bytes) { held_bytes_ -= bytes; }
    uint64_t held_bytes() const { return held_bytes_; }
    uint64_t peak_bytes() const { return peak_bytes_; }

    /// Throws RunError with the first message the validation layer has given since the last call.
    void check_validation();
    void add_validation_message(const std::string& message);

  private:
    void create_instance(bool validation);
    void create_device();

    DeviceInfo info_;
    Limits limits_;
    vk::UniqueInstance instance_;
    VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
    vk::PhysicalDevice physical_;
    vk::UniqueDevice device_;
    vk::Queue queue_;
    vk::UniquePipelineCache pipeline_cache_;
    uint32_t queue_family_ = 0;
    bool subgroup_size_control_ = false;
    uint64_t held_bytes_ = 0, peak_bytes_ = 0;
    std::mutex message_mutex_;
    std::vector<std::string> messages_;
};

}  // namespace ewa::gpu
