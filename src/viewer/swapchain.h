// SPDX-License-Identifier: Apache-2.0
// The swapchain: images that the window cycles through, recreated when the window changes.
#pragma once
#include <optional>

#include "viewer/present_device.h"

namespace ewa::viewer {

class Swapchain {
  public:
    explicit Swapchain(const PresentDevice& device);

    /// Returns false if the window has no size. No old image is in use afterwards.
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
    uint32_t image_count() const { return uint32_t(images_.size()); }
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
    std::vector<vk::UniqueSemaphore>
        drawn_;  // one per image: presentation may still wait on the previous one
};

}  // namespace ewa::viewer
