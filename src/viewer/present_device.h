// SPDX-License-Identifier: Apache-2.0
// The Vulkan device that shows pictures in a window. Not the one that computes them: that one knows of no
// window.
#pragma once
#include "viewer/window.h"

namespace ewa::viewer {

/// A buffer the host writes or reads.
struct HostBuffer {
    vk::UniqueBuffer buffer;
    vk::UniqueDeviceMemory memory;
    void* mapped = nullptr;
    vk::DeviceSize bytes = 0;
};

struct DeviceImage {
    vk::UniqueImage image;
    vk::UniqueDeviceMemory memory;
    Size size;
};

class PresentDevice {
  public:
    /// Prefers the device of this name, else a discrete, integrated, virtual, then CPU device. Throws
    /// RunError where none can show pictures in the window.
    PresentDevice(const WindowSystem& system, const Window& window, const std::string& preferred_name);
    ~PresentDevice();
    PresentDevice(const PresentDevice&) = delete;
    PresentDevice& operator=(const PresentDevice&) = delete;

    vk::Instance instance() const { return *instance_; }
    vk::SurfaceKHR surface() const { return *surface_; }
    vk::PhysicalDevice physical() const { return physical_; }
    vk::Device handle() const { return *device_; }
    vk::Queue queue() const { return queue_; }
    uint32_t queue_family() const { return queue_family_; }

    HostBuffer host_buffer(vk::DeviceSize bytes, vk::BufferUsageFlags usage) const;
    DeviceImage image(Size size, vk::Format format, vk::ImageUsageFlags usage) const;

  private:
    void create_instance(const WindowSystem& system);
    void choose(const std::string& preferred_name);
    void create_device();
    vk::UniqueDeviceMemory allocate(const vk::MemoryRequirements& needs,
                                    vk::MemoryPropertyFlags wanted) const;

    // In this order: each is destroyed before what it came from.
    vk::UniqueInstance instance_;
    vk::UniqueSurfaceKHR surface_;
    vk::PhysicalDevice physical_;
    vk::UniqueDevice device_;
    vk::Queue queue_;
    uint32_t queue_family_ = 0;
};

}  // namespace ewa::viewer
