// SPDX-License-Identifier: Apache-2.0
// One logical device with one compute queue. It counts the memory of its buffers, and states the limits that
// kernels are sized for. Vulkan-Hpp is used with unique handles; it checks results in every build type.
#pragma once
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>
#include <vulkan/vulkan.hpp>

#include "ewa/device.h"

namespace ewa::gpu {

/// The properties of a device that workgroups and buffers depend on.
struct Limits {
    bool cpu = false;                  // a software device: each thread takes a contiguous part of a dispatch
    uint32_t subgroup_size = 0;        // lanes, the same for every pipeline of this device
    uint32_t max_groups = 65535;       // workgroups of a dispatch, in each dimension
    uint64_t max_storage_range = 0;    // bytes of a storage binding
    uint64_t max_texels = 0;           // elements of a texel buffer view
    bool texel_buffers = true;         // buffers with a texel format are fetched by views; else from storage
    uint64_t uniform_alignment = 256;  // bytes
    uint32_t max_invocations = 128;    // of a workgroup along x
    uint32_t shared_bytes = 16384;     // of a workgroup's shared memory
    bool ballots = false;              // of subgroups
    bool scalar_loads = false;         // a load from the same address in all lanes costs next to nothing
    bool timestamps = false;
    double timestamp_nanoseconds = 1.0;
};

class PipelineStore;

/// Memory that the host does not cache can be written fast, but is read a hundred times slower.
enum class HostAccess { none, write, read_write };

constexpr uint32_t kMostLanes = 64;  // of a subgroup: a tile's pixels
/// The size that pipelines with subgroup operations ask for: a device's own, within its limits, and at most kMostLanes
/// where they allow it. A device that can run 8 lanes as well as 32 (Intel) gets 16: a lane then has twice the registers.
uint32_t subgroup_lanes(uint32_t natural, uint32_t least, uint32_t most);

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
    PipelineStore& pipelines() { return *pipelines_; }

    /// mapped: what the host can do with the memory once it is mapped. Throws RunError if the driver is out of
    /// memory; it states the bytes that are wanted and those that are allocated.
    vk::UniqueDeviceMemory allocate(const vk::MemoryRequirements& requirements, bool host_visible,
                                    HostAccess& mapped);
    /// Kernels and buffers that are made from now on suit a device of these limits. For tests.
    void pretend(const Limits& limits) { limits_ = limits; }
    /// Device memory is mapped for no more than this from now on, as on other devices. For tests.
    void limit_host_access(HostAccess most) { most_access_ = most; }
    void released(uint64_t bytes) { allocated_bytes_ -= bytes; }
    uint64_t allocated_bytes() const { return allocated_bytes_; }
    uint64_t peak_bytes() const { return peak_bytes_; }

    /// Throws RunError with the validation layer's first message since the last call.
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
    std::unique_ptr<PipelineStore> pipelines_;
    uint32_t queue_family_ = 0;
    bool subgroup_size_control_ = false;
    HostAccess most_access_ = HostAccess::read_write;
    uint64_t allocated_bytes_ = 0, peak_bytes_ = 0;
    std::mutex message_mutex_;
    std::vector<std::string> messages_;
};

}  // namespace ewa::gpu
