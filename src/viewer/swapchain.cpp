// SPDX-License-Identifier: Apache-2.0
#include "viewer/swapchain.h"

#include <algorithm>
#include <array>

#include "ewa/error.h"

namespace ewa::viewer {
namespace {

using Usage = vk::ImageUsageFlagBits;

/// A queue family that supports graphics and presents to the surface, or -1.
int showing_family(vk::PhysicalDevice device, vk::SurfaceKHR surface) {
    const auto extensions = device.enumerateDeviceExtensionProperties();
    const bool swapchains = std::any_of(extensions.begin(), extensions.end(), [](const auto& extension) {
        return std::string(extension.extensionName.data()) == VK_KHR_SWAPCHAIN_EXTENSION_NAME;
    });
    if (!swapchains) return -1;
    const auto families = device.getQueueFamilyProperties();
    for (uint32_t i = 0; i < families.size(); ++i)
        if ((families[i].queueFlags & vk::QueueFlagBits::eGraphics) &&
            device.getSurfaceSupportKHR(i, surface))
            return int(i);
    return -1;
}

int rank(const vk::PhysicalDeviceProperties& properties, const std::string& preferred_name) {
    using Type = vk::PhysicalDeviceType;
    constexpr std::array order{Type::eDiscreteGpu, Type::eIntegratedGpu, Type::eVirtualGpu, Type::eCpu};
    if (properties.deviceName.data() == preferred_name) return -1;
    return int(std::find(order.begin(), order.end(), properties.deviceType) - order.begin());
}

// ns. A hidden window may get no image as long as it is hidden, and must still handle events.
constexpr uint64_t kPatience = 100'000'000;

[[noreturn]] void fail(vk::Result result) {
    const std::string what = "the window cannot show images any more: " + vk::to_string(result);
    if (result == vk::Result::eErrorDeviceLost) throw vk::DeviceLostError(what);
    if (result == vk::Result::eErrorSurfaceLostKHR) throw vk::SurfaceLostKHRError(what);
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

PresentDevice::PresentDevice(const WindowSystem& system, const Window& window,
                             const std::string& preferred_name) {
    vk::ApplicationInfo application;
    application.setPApplicationName("ewa-view").setApiVersion(VK_API_VERSION_1_1);
    const std::vector<const char*> instance_extensions = system.vulkan_extensions();
    vk::InstanceCreateInfo instance;
    instance.setPApplicationInfo(&application).setPEnabledExtensionNames(instance_extensions);
    instance_ = vk::createInstanceUnique(instance);
    surface_ = window.surface(*instance_);
    choose(preferred_name);

    const float priority = 1.0f;
    vk::DeviceQueueCreateInfo queue;
    queue.setQueueFamilyIndex(queue_family_).setQueuePriorities(priority);
    const std::array extensions{VK_KHR_SWAPCHAIN_EXTENSION_NAME};
    vk::DeviceCreateInfo create;
    create.setQueueCreateInfos(queue).setPEnabledExtensionNames(extensions);
    device_ = physical_.createDeviceUnique(create);
    queue_ = device_->getQueue(queue_family_, 0);
}

PresentDevice::~PresentDevice() {
    if (device_) (void)vkDeviceWaitIdle(*device_);
}

void PresentDevice::choose(const std::string& preferred_name) {
    int best = 0;
    for (const vk::PhysicalDevice& device : instance_->enumeratePhysicalDevices()) {
        const int family = showing_family(device, *surface_);
        const int place = rank(device.getProperties(), preferred_name);
        if (family < 0 || (physical_ && place >= best)) continue;
        physical_ = device;
        queue_family_ = uint32_t(family);
        best = place;
    }
    if (!physical_) throw RunError("no Vulkan device of this machine can show images in this window");
}

vk::UniqueDeviceMemory PresentDevice::allocate(const vk::MemoryRequirements& needs,
                                               vk::MemoryPropertyFlags wanted) const {
    const auto memory = physical_.getMemoryProperties();
    for (uint32_t i = 0; i < memory.memoryTypeCount; ++i)
        if ((needs.memoryTypeBits & (1u << i)) && (memory.memoryTypes[i].propertyFlags & wanted) == wanted)
            return device_->allocateMemoryUnique(vk::MemoryAllocateInfo(needs.size, i));
    throw RunError("the device has no suitable memory for the images of the window");
}

HostBuffer PresentDevice::host_buffer(vk::DeviceSize bytes, vk::BufferUsageFlags usage) const {
    using Flag = vk::MemoryPropertyFlagBits;
    HostBuffer result;
    result.bytes = bytes;
    result.buffer = device_->createBufferUnique(vk::BufferCreateInfo({}, bytes, usage));
    result.memory = allocate(device_->getBufferMemoryRequirements(*result.buffer),
                             Flag::eHostVisible | Flag::eHostCoherent);
    device_->bindBufferMemory(*result.buffer, *result.memory, 0);
    result.mapped = device_->mapMemory(*result.memory, 0, VK_WHOLE_SIZE);
    return result;
}

DeviceImage PresentDevice::image(Size size, vk::Format format, vk::ImageUsageFlags usage) const {
    vk::ImageCreateInfo create;
    create.setImageType(vk::ImageType::e2D)
        .setFormat(format)
        .setExtent({uint32_t(size.width), uint32_t(size.height), 1})
        .setMipLevels(1)
        .setArrayLayers(1)
        .setUsage(usage);
    DeviceImage result;
    result.size = size;
    result.image = device_->createImageUnique(create);
    result.memory = allocate(device_->getImageMemoryRequirements(*result.image), {});
    device_->bindImageMemory(*result.image, *result.memory, 0);
    return result;
}

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
    // Only the overloads with pointers do not throw when the window has changed, which is no error here.
    uint32_t index = 0;
    const vk::Result result =
        device_.handle().acquireNextImageKHR(*swapchain_, kPatience, *acquired_, nullptr, &index);
    if (result == vk::Result::eSuccess || result == vk::Result::eSuboptimalKHR) return {index, false};
    if (result == vk::Result::eTimeout || result == vk::Result::eNotReady) return {std::nullopt, false};
    if (result == vk::Result::eErrorOutOfDateKHR) return {std::nullopt, true};
    fail(result);
}

bool Swapchain::present(uint32_t index) {
    const vk::PresentInfoKHR present(*drawn_[index], *swapchain_, index);
    const vk::Result result = device_.queue().presentKHR(&present);
    if (result == vk::Result::eSuccess) return true;
    if (result == vk::Result::eSuboptimalKHR || result == vk::Result::eErrorOutOfDateKHR) return false;
    fail(result);
}

}  // namespace ewa::viewer
