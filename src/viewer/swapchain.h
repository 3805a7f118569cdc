// SPDX-License-Identifier: Apache-2.0
// The pictures that the window cycles through, made anew whenever the window changes.
#pragma once
#include <optional>

#include "viewer/present_device.h"

namespace ewa::viewer {

class Swapchain {
  public:
    explicit Swapchain(const PresentDevice& device);

    /// False when the window has no size now. Afterwards nothing of the old images is in use.
    bool recreate(Size window);

    /// The index of the image to draw next, whose `acquired` semaphore will be signalled. Nothing when the
    /// window has changed and recreate() must come first, or when it has no image to spare just now. Throws
    /// vk::SurfaceLostKHRError, vk::DeviceLostError, RunError; so does present().
    struct Acquired {
        std::optional<uint32_t> index;
        bool outdated = false;
    };
    Acquired acquire();
    /// False when recreate() must come before the next acquire().
    bool present(uint32_t index);

    bool exists() const { return bool(swapchain_); }
    Size size() const { return size_; }
    vk::Format format() const { return format_.format; }
    bool srgb() const;                           // the only format of the surface encodes what is drawn
    bool readable() const { return readable_; }  // its images can be copied to the host
    uint32_t least_images() const { return least_images_; }
    uint32_t image_count() const { return uint32_t(images_.size()); }
    vk::RenderPass overlay_pass() const { return *overlay_pass_; }  // draws over what the image holds

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
    std::vector<vk::UniqueSemaphore> drawn_;  // one an image: presenting may still wait on the one before
};

}  // namespace ewa::viewer
