// SPDX-License-Identifier: Apache-2.0
// The Vulkan device that shows images in a window, and its swapchain. Rendering uses another device object, which
// needs no window (gpu::Device).
#pragma once
#include <optional>

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

    vk::Instance instance() const { return *instance_; }
    vk::SurfaceKHR surface() const { return *surface_; }
    vk::PhysicalDevice physical() const { return physical_; }
    vk::Device handle() const { return *device_; }
    vk::Queue queue() const { return queue_; }
    uint32_t queue_family() const { return queue_family_; }

    HostBuffer host_buffer(vk::DeviceSize bytes, vk::BufferUsageFlags usage) const;
    DeviceImage image(Size size, vk::Format format, vk::ImageUsageFlags usage) const;

  private:
    void choose(const std::string& preferred_name);
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

/// The images that the window cycles through, recreated when the window changes.
class Swapchain {
  public:
    explicit Swapchain(const PresentDevice& device);

    /// Creates the images for this size, px. Returns false if the window has no size. The device no longer uses the old images.
    bool recreate(Size window);

    /// The index of the next image; its `acquired` semaphore will be signalled. Empty if the window has
    /// changed (outdated: call recreate() first) or has no free image now. acquire() and present() throw
    /// vk::SurfaceLostKHRError, vk::DeviceLostError, RunError.
    struct Acquired {
        std::optional<uint32_t> index;
        bool outdated = false;
    };
    Acquired acquire();
    /// Returns false if recreate() must precede the next acquire().
    bool present(uint32_t index);

    bool exists() const { return bool(swapchain_); }
    Size size() const { return size_; }
    vk::Format format() const { return format_.format; }
    bool srgb() const;                           // the surface has only formats that encode to sRGB
    bool readable() const { return readable_; }  // images can be copied to the host
    uint32_t least_images() const { return least_images_; }
    vk::RenderPass overlay_pass() const { return *overlay_pass_; }  // keeps the content of the image

    vk::Image image(uint32_t index) const { return images_[index]; }
    vk::Framebuffer framebuffer(uint32_t index) const { return *framebuffers_[index]; }
    vk::Semaphore acquired() const { return *acquired_; }
    vk::Semaphore drawn(uint32_t index) const { return *drawn_[index]; }

  private:
    void choose_format();
    void create_overlay_pass();
    void create_targets();

    const PresentDevice& device_;
    vk::SurfaceFormatKHR format_;
    bool readable_ = false;
    uint32_t least_images_ = 2;
    vk::UniqueRenderPass overlay_pass_;
    vk::UniqueSwapchainKHR swapchain_;
    Size size_;
    std::vector<vk::Image> images_;
    std::vector<vk::UniqueImageView> views_;
    std::vector<vk::UniqueFramebuffer> framebuffers_;
    vk::UniqueSemaphore acquired_;
    // One per image: presentation may still wait on the previous one.
    std::vector<vk::UniqueSemaphore> drawn_;
};

}  // namespace ewa::viewer
