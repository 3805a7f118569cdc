// SPDX-License-Identifier: Apache-2.0
#include "viewer/present_device.h"

#include <algorithm>
#include <array>

#include "ewa/error.h"

namespace ewa::viewer {
namespace {

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

}  // namespace

PresentDevice::PresentDevice(const WindowSystem& system, const Window& window,
                             const std::string& preferred_name) {
    create_instance(system);
    surface_ = window.surface(*instance_);
    choose(preferred_name);
    create_device();
}

PresentDevice::~PresentDevice() {
    if (device_) (void)vkDeviceWaitIdle(*device_);
}

void PresentDevice::create_instance(const WindowSystem& system) {
    vk::ApplicationInfo application;
    application.setPApplicationName("ewa-view").setApiVersion(VK_API_VERSION_1_1);
    const std::vector<const char*> extensions = system.vulkan_extensions();
    vk::InstanceCreateInfo create;
    create.setPApplicationInfo(&application).setPEnabledExtensionNames(extensions);
    instance_ = vk::createInstanceUnique(create);
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

void PresentDevice::create_device() {
    const float priority = 1.0f;
    vk::DeviceQueueCreateInfo queue;
    queue.setQueueFamilyIndex(queue_family_).setQueuePriorities(priority);
    const std::array extensions{VK_KHR_SWAPCHAIN_EXTENSION_NAME};
    vk::DeviceCreateInfo create;
    create.setQueueCreateInfos(queue).setPEnabledExtensionNames(extensions);
    device_ = physical_.createDeviceUnique(create);
    queue_ = device_->getQueue(queue_family_, 0);
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

}  // namespace ewa::viewer
