// SPDX-License-Identifier: Apache-2.0
#include "viewer/swapchain.h"

#include <algorithm>
#include <array>

#include "ewa/error.h"

namespace ewa::viewer {
namespace {

using Usage = vk::ImageUsageFlagBits;

// ns. A hidden window may get no image as long as it is hidden, and must still handle events.
constexpr uint64_t kPatience = 100'000'000;

[[noreturn]] void fail(VkResult result) {
    const std::string what = "the window cannot show images any more: " + vk::to_string(vk::Result(result));
    if (result == VK_ERROR_DEVICE_LOST) throw vk::DeviceLostError(what);
    if (result == VK_ERROR_SURFACE_LOST_KHR) throw vk::SurfaceLostKHRError(what);
    throw RunError(what);
}

vk::CompositeAlphaFlagBitsKHR composite_of(const vk::SurfaceCapabilitiesKHR& surface) {
    using Alpha = vk::CompositeAlphaFlagBitsKHR;
    for (const Alpha alpha : {Alpha::eOpaque, Alpha::eInherit, Alpha::ePreMultiplied})
        if (surface.supportedCompositeAlpha & alpha) return alpha;
    return Alpha::ePostMultiplied;
}

Size extent_of(const vk::SurfaceCapabilitiesKHR& surface, Size window) {
    constexpr uint32_t kUpToUs = 0xffffffff;
    if (surface.currentExtent.width != kUpToUs)
        return {int(surface.currentExtent.width), int(surface.currentExtent.height)};
    if (window.width == 0 || window.height == 0) return {};
    const auto& low = surface.minImageExtent;
    const auto& high = surface.maxImageExtent;
    return {int(std::clamp(uint32_t(window.width), low.width, high.width)),
            int(std::clamp(uint32_t(window.height), low.height, high.height))};
}

}  // namespace

Swapchain::Swapchain(const PresentDevice& device) : device_(device) {
    const auto surface = device_.physical().getSurfaceCapabilitiesKHR(device_.surface());
    if (!(surface.supportedUsageFlags & Usage::eTransferDst))
        throw RunError("this display does not support copying images to it");
    readable_ = bool(surface.supportedUsageFlags & Usage::eTransferSrc);
    least_images_ = std::max(2u, surface.minImageCount);
    choose_format();
    create_overlay_pass();
    acquired_ = device_.handle().createSemaphoreUnique({});
}

bool Swapchain::srgb() const {
    return format() == vk::Format::eB8G8R8A8Srgb || format() == vk::Format::eR8G8B8A8Srgb;
}

/// Images hold the values of an 8-bit file, which UNORM shows unchanged. An sRGB format is the last choice.
void Swapchain::choose_format() {
    const auto formats = device_.physical().getSurfaceFormatsKHR(device_.surface());
    for (const vk::Format wanted : {vk::Format::eB8G8R8A8Unorm, vk::Format::eR8G8B8A8Unorm,
                                    vk::Format::eB8G8R8A8Srgb, vk::Format::eR8G8B8A8Srgb})
        for (const vk::SurfaceFormatKHR& format : formats)
            if (format.format == wanted && format.colorSpace == vk::ColorSpaceKHR::eSrgbNonlinear) {
                format_ = format;
                return;
            }
    throw RunError("this display has no format with 8 bits per channel");
}

void Swapchain::create_overlay_pass() {
    vk::AttachmentDescription color;
    color.setFormat(format())
        .setLoadOp(vk::AttachmentLoadOp::eLoad)
        .setStoreOp(vk::AttachmentStoreOp::eStore)
        .setStencilLoadOp(vk::AttachmentLoadOp::eDontCare)
        .setStencilStoreOp(vk::AttachmentStoreOp::eDontCare)
        .setInitialLayout(vk::ImageLayout::eColorAttachmentOptimal)
        .setFinalLayout(vk::ImageLayout::ePresentSrcKHR);
    const vk::AttachmentReference reference(0, vk::ImageLayout::eColorAttachmentOptimal);
    vk::SubpassDescription subpass;
    subpass.setPipelineBindPoint(vk::PipelineBindPoint::eGraphics).setColorAttachments(reference);
    vk::RenderPassCreateInfo create;
    create.setAttachments(color).setSubpasses(subpass);
    overlay_pass_ = device_.handle().createRenderPassUnique(create);
}

bool Swapchain::recreate(Size window) {
    device_.handle().waitIdle();
    const auto surface = device_.physical().getSurfaceCapabilitiesKHR(device_.surface());
    const Size size = extent_of(surface, window);
    if (size.width == 0 || size.height == 0) return false;

    vk::SwapchainCreateInfoKHR create;
    create.setSurface(device_.surface())
        .setMinImageCount(surface.maxImageCount ? std::min(least_images_ + 1, surface.maxImageCount)
                                                : least_images_ + 1)
        .setImageFormat(format_.format)
        .setImageColorSpace(format_.colorSpace)
        .setImageExtent({uint32_t(size.width), uint32_t(size.height)})
        .setImageArrayLayers(1)
        .setImageUsage(Usage::eColorAttachment | Usage::eTransferDst)
        .setPreTransform(surface.currentTransform)
        .setCompositeAlpha(composite_of(surface))
        .setPresentMode(vk::PresentModeKHR::eFifo)
        .setClipped(true)
        .setOldSwapchain(*swapchain_);
    if (readable_) create.imageUsage |= Usage::eTransferSrc;
    auto fresh = device_.handle().createSwapchainKHRUnique(create);
    framebuffers_.clear();
    views_.clear();
    swapchain_ = std::move(fresh);
    size_ = size;
    create_targets();
    return true;
}

void Swapchain::create_targets() {
    images_ = device_.handle().getSwapchainImagesKHR(*swapchain_);
    drawn_.clear();
    for (const vk::Image image : images_) {
        vk::ImageViewCreateInfo view;
        view.setImage(image)
            .setViewType(vk::ImageViewType::e2D)
            .setFormat(format())
            .setSubresourceRange({vk::ImageAspectFlagBits::eColor, 0, 1, 0, 1});
        views_.push_back(device_.handle().createImageViewUnique(view));
        vk::FramebufferCreateInfo create;
        create.setRenderPass(*overlay_pass_)
            .setAttachments(*views_.back())
            .setWidth(uint32_t(size_.width))
            .setHeight(uint32_t(size_.height))
            .setLayers(1);
        framebuffers_.push_back(device_.handle().createFramebufferUnique(create));
        drawn_.push_back(device_.handle().createSemaphoreUnique({}));
    }
}

Swapchain::Acquired Swapchain::acquire() {
    // The C function: Vulkan-Hpp would throw when the window has changed, which is no error here.
    uint32_t index = 0;
    const VkResult result =
        vkAcquireNextImageKHR(device_.handle(), *swapchain_, kPatience, *acquired_, VK_NULL_HANDLE, &index);
    if (result == VK_SUCCESS || result == VK_SUBOPTIMAL_KHR) return {index, false};
    if (result == VK_TIMEOUT || result == VK_NOT_READY) return {std::nullopt, false};
    if (result == VK_ERROR_OUT_OF_DATE_KHR) return {std::nullopt, true};
    fail(result);
}

bool Swapchain::present(uint32_t index) {
    const VkSemaphore wait = *drawn_[index];
    const VkSwapchainKHR swapchain = *swapchain_;
    VkPresentInfoKHR present{};
    present.sType = VK_STRUCTURE_TYPE_PRESENT_INFO_KHR;
    present.waitSemaphoreCount = 1;
    present.pWaitSemaphores = &wait;
    present.swapchainCount = 1;
    present.pSwapchains = &swapchain;
    present.pImageIndices = &index;
    const VkResult result = vkQueuePresentKHR(device_.queue(), &present);
    if (result == VK_SUCCESS) return true;
    if (result == VK_SUBOPTIMAL_KHR || result == VK_ERROR_OUT_OF_DATE_KHR) return false;
    fail(result);
}

}  // namespace ewa::viewer
