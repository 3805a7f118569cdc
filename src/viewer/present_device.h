// SPDX-License-Identifier: Apache-2.0
// The Vulkan device that shows images in a window. The device that renders is opened without a window.
#pragma once
#include "viewer/window.h"

namespace ewa::viewer {

/// A buffer that the host writes or reads.
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
    /// Prefers the device of this name, then a discrete, integrated, virtual and CPU device. Throws RunError
    /// if none can show images in the window.
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

    // Declared in the order of creation: each is destroyed before its parent.
    vk::UniqueInstance instance_;
    vk::UniqueSurfaceKHR surface_;
    vk::PhysicalDevice physical_;
    vk::UniqueDevice device_;
    vk::Queue queue_;
    uint32_t queue_family_ = 0;
};

}  // namespace ewa::viewer
