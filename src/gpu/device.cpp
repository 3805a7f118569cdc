// SPDX-License-Identifier: Apache-2.0
#include "gpu/device.h"

#include <algorithm>
#include <array>

#include "core/text.h"
#include "ewa/error.h"
#include "gpu/pipeline.h"

namespace ewa {
namespace gpu {
namespace {

constexpr uint32_t kApiVersion = VK_API_VERSION_1_2;

vk::ApplicationInfo application_info() {
    vk::ApplicationInfo info;
    info.setPApplicationName("ewa").setApiVersion(kApiVersion);
    return info;
}

std::string version_text(uint32_t version) {
    return std::to_string(VK_API_VERSION_MAJOR(version)) + "." +
           std::to_string(VK_API_VERSION_MINOR(version)) + "." +
           std::to_string(VK_API_VERSION_PATCH(version));
}

std::string type_text(vk::PhysicalDeviceType type) {
    constexpr std::array kNames{"other", "integrated", "discrete", "virtual", "cpu"};  // in Vulkan's order
    return size_t(type) < kNames.size() ? kNames[size_t(type)] : "other";
}

int compute_family(vk::PhysicalDevice device) {
    const auto families = device.getQueueFamilyProperties();
    for (size_t i = 0; i < families.size(); ++i)
        if (families[i].queueFlags & vk::QueueFlagBits::eCompute) return int(i);
    return -1;
}

/// The first feature that kernels need and the device lacks. Empty if it lacks none.
std::string missing_features(vk::PhysicalDevice device) {
    if (device.getProperties().apiVersion < kApiVersion) return "Vulkan 1.2";
    if (compute_family(device) < 0) return "a compute queue";
    const auto features =
        device.getFeatures2<vk::PhysicalDeviceFeatures2, vk::PhysicalDeviceVulkan12Features>()
            .get<vk::PhysicalDeviceVulkan12Features>();
    if (!features.scalarBlockLayout) return "scalarBlockLayout";
    const auto subgroup =
        device.getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceSubgroupProperties>()
            .get<vk::PhysicalDeviceSubgroupProperties>();
    const auto needed = vk::SubgroupFeatureFlagBits::eBasic | vk::SubgroupFeatureFlagBits::eVote |
                        vk::SubgroupFeatureFlagBits::eShuffle;
    if ((subgroup.supportedOperations & needed) != needed ||
        !(subgroup.supportedStages & vk::ShaderStageFlagBits::eCompute))
        return "subgroup shuffles in compute shaders";
    return "";
}

DeviceInfo describe(vk::PhysicalDevice device, int index) {
    const auto chain =
        device.getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceDriverProperties,
                              vk::PhysicalDeviceSubgroupProperties>();
    const auto& properties = chain.get<vk::PhysicalDeviceProperties2>().properties;
    const auto& driver = chain.get<vk::PhysicalDeviceDriverProperties>();
    DeviceInfo info;
    info.index = index;
    info.name = properties.deviceName.data();
    info.type = type_text(properties.deviceType);
    info.driver = std::string(driver.driverName.data()) + " " + driver.driverInfo.data();
    info.api_version = version_text(properties.apiVersion);
    info.subgroup_size = chain.get<vk::PhysicalDeviceSubgroupProperties>().subgroupSize;
    const auto memory = device.getMemoryProperties();
    for (uint32_t i = 0; i < memory.memoryHeapCount; ++i)
        if (memory.memoryHeaps[i].flags & vk::MemoryHeapFlagBits::eDeviceLocal)
            info.memory_bytes = std::max<uint64_t>(info.memory_bytes, memory.memoryHeaps[i].size);
    info.unusable = missing_features(device);
    return info;
}

VKAPI_ATTR VkBool32 VKAPI_CALL on_message(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                          VkDebugUtilsMessageTypeFlagsEXT,
                                          const VkDebugUtilsMessengerCallbackDataEXT* data, void* user) {
    static_cast<Device*>(user)->add_validation_message(data->pMessage);
    return VK_FALSE;
}

}  // namespace

Device::Device(const DeviceInfo& info, bool validation) : info_(info) {
    try {
        create_instance(validation);
        physical_ = instance_->enumeratePhysicalDevices().at(size_t(info.index));
        create_device();
    } catch (const vk::SystemError& error) {
        throw RunError("cannot open Vulkan device " + info.name + ": " + error.what());
    }
}

Device::~Device() {
    if (device_) (void)vkDeviceWaitIdle(*device_);
    if (messenger_) {
        const auto destroy = reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(
            vkGetInstanceProcAddr(*instance_, "vkDestroyDebugUtilsMessengerEXT"));
        destroy(*instance_, messenger_, nullptr);
    }
}

void Device::create_instance(bool validation) {
    const vk::ApplicationInfo application = application_info();
    std::vector<const char*> layers, extensions;
    if (validation) {
        layers.push_back("VK_LAYER_KHRONOS_validation");
        extensions.push_back(VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
        const auto available = vk::enumerateInstanceLayerProperties();
        if (std::none_of(available.begin(), available.end(), [](const vk::LayerProperties& layer) {
                return std::string(layer.layerName.data()) == "VK_LAYER_KHRONOS_validation";
            }))
            throw InputError(
                "the Khronos validation layer is not installed (Debian: vulkan-validationlayers)");
    }
    vk::InstanceCreateInfo create;
    create.setPApplicationInfo(&application)
        .setPEnabledLayerNames(layers)
        .setPEnabledExtensionNames(extensions);
    instance_ = vk::createInstanceUnique(create);
    if (!validation) return;
    VkDebugUtilsMessengerCreateInfoEXT messenger{};
    messenger.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT;
    messenger.messageSeverity =
        VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
    messenger.messageType =
        VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_TYPE_PERFORMANCE_BIT_EXT;
    messenger.pfnUserCallback = on_message;
    messenger.pUserData = this;
    const auto make = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(
        vkGetInstanceProcAddr(*instance_, "vkCreateDebugUtilsMessengerEXT"));
    if (make(*instance_, &messenger, nullptr, &messenger_) != VK_SUCCESS)
        throw RunError("cannot listen to the validation layer");
}

void Device::create_device() {
    const auto chain =
        physical_.getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceSubgroupProperties>();
    const auto& properties = chain.get<vk::PhysicalDeviceProperties2>().properties;
    const auto available = physical_.enumerateDeviceExtensionProperties();
    subgroup_size_control_ = std::any_of(available.begin(), available.end(), [](const auto& extension) {
        return std::string(extension.extensionName.data()) == VK_EXT_SUBGROUP_SIZE_CONTROL_EXTENSION_NAME;
    });
    limits_.subgroup_size = chain.get<vk::PhysicalDeviceSubgroupProperties>().subgroupSize;
    vk::PhysicalDeviceSubgroupSizeControlFeaturesEXT wanted_sizes;
    if (subgroup_size_control_) {
        const auto features =
            physical_
                .getFeatures2<vk::PhysicalDeviceFeatures2, vk::PhysicalDeviceSubgroupSizeControlFeaturesEXT>()
                .get<vk::PhysicalDeviceSubgroupSizeControlFeaturesEXT>();
        const auto sizes = physical_
                               .getProperties2<vk::PhysicalDeviceProperties2,
                                               vk::PhysicalDeviceSubgroupSizeControlPropertiesEXT>()
                               .get<vk::PhysicalDeviceSubgroupSizeControlPropertiesEXT>();
        subgroup_size_control_ = features.subgroupSizeControl && features.computeFullSubgroups &&
                                 bool(sizes.requiredSubgroupSizeStages & vk::ShaderStageFlagBits::eCompute);
        limits_.subgroup_size =
            std::clamp(limits_.subgroup_size, sizes.minSubgroupSize, sizes.maxSubgroupSize);
        wanted_sizes.setSubgroupSizeControl(true).setComputeFullSubgroups(true);
    }
    queue_family_ = uint32_t(compute_family(physical_));
    const float priority = 1.0f;
    vk::DeviceQueueCreateInfo queue;
    queue.setQueueFamilyIndex(queue_family_).setQueuePriorities(priority);
    std::vector<const char*> extensions;
    if (subgroup_size_control_) extensions.push_back(VK_EXT_SUBGROUP_SIZE_CONTROL_EXTENSION_NAME);
    vk::PhysicalDeviceVulkan12Features features;
    features.setScalarBlockLayout(true);
    if (subgroup_size_control_) features.setPNext(&wanted_sizes);
    vk::DeviceCreateInfo create;
    create.setPNext(&features).setQueueCreateInfos(queue).setPEnabledExtensionNames(extensions);
    device_ = physical_.createDeviceUnique(create);
    queue_ = device_->getQueue(queue_family_, 0);
    pipeline_cache_ = device_->createPipelineCacheUnique({});
    pipelines_ = std::make_unique<PipelineStore>();

    limits_.cpu = properties.deviceType == vk::PhysicalDeviceType::eCpu;
    limits_.max_groups = *std::min_element(properties.limits.maxComputeWorkGroupCount.begin(),
                                           properties.limits.maxComputeWorkGroupCount.end());
    limits_.max_storage_range = properties.limits.maxStorageBufferRange;
    limits_.max_texels = properties.limits.maxTexelBufferElements;
    limits_.uniform_alignment = properties.limits.minUniformBufferOffsetAlignment;
    const auto family = physical_.getQueueFamilyProperties()[queue_family_];
    limits_.timestamps = family.timestampValidBits > 0;
    limits_.timestamp_nanoseconds = properties.limits.timestampPeriod;
}

vk::UniqueDeviceMemory Device::allocate(const vk::MemoryRequirements& requirements, bool host_visible,
                                        bool& mapped_kind) {
    const auto memory = physical_.getMemoryProperties();
    using Flag = vk::MemoryPropertyFlagBits;
    const vk::MemoryPropertyFlags host = Flag::eHostVisible | Flag::eHostCoherent;
    // On CPUs and integrated GPUs, one memory type is local to the device and visible to the host. It needs
    // no staging copies.
    std::vector<vk::MemoryPropertyFlags> wishes;
    if (host_visible) {
        wishes = {host | Flag::eHostCached, host};
    } else {
        if (limits_.cpu || info_.type == "integrated")
            wishes.push_back(Flag::eDeviceLocal | host | Flag::eHostCached);
        wishes.push_back(Flag::eDeviceLocal);
        wishes.push_back({});
    }
    for (const auto& wish : wishes) {
        for (uint32_t i = 0; i < memory.memoryTypeCount; ++i) {
            const auto flags = memory.memoryTypes[i].propertyFlags;
            if (!(requirements.memoryTypeBits & (1u << i)) || (flags & wish) != wish) continue;
            vk::MemoryAllocateInfo info;
            info.setAllocationSize(requirements.size).setMemoryTypeIndex(i);
            try {
                auto result = device_->allocateMemoryUnique(info);
                mapped_kind = (flags & host) == host;
                allocated_bytes_ += requirements.size;
                peak_bytes_ = std::max(peak_bytes_, allocated_bytes_);
                return result;
            } catch (const vk::OutOfDeviceMemoryError&) {
            } catch (const vk::OutOfHostMemoryError&) {
            }
        }
    }
    throw RunError("out of device memory on " + info_.name + ": " + std::to_string(requirements.size >> 20) +
                   " MiB are needed beside the " + std::to_string(allocated_bytes_ >> 20) +
                   " MiB already allocated; fewer splats, a lower SH degree or --downscale need less");
}

void Device::add_validation_message(const std::string& message) {
    const std::lock_guard lock(message_mutex_);
    messages_.push_back(message);
}

void Device::check_validation() {
    const std::lock_guard lock(message_mutex_);
    if (messages_.empty()) return;
    std::string first = messages_.front();
    messages_.clear();
    std::replace(first.begin(), first.end(), '\n', ' ');
    throw RunError("validation: " + first);
}

}  // namespace gpu

std::vector<DeviceInfo> list_devices() {
    try {
        const vk::ApplicationInfo application = gpu::application_info();
        vk::InstanceCreateInfo create;
        create.setPApplicationInfo(&application);
        const auto instance = vk::createInstanceUnique(create);
        std::vector<DeviceInfo> infos;
        int index = 0;
        for (const auto& device : instance->enumeratePhysicalDevices())
            infos.push_back(gpu::describe(device, index++));
        if (infos.empty())
            throw RunError("no Vulkan device; a CPU device comes with Mesa (Debian: mesa-vulkan-drivers)");
        return infos;
    } catch (const vk::SystemError& error) {
        throw RunError(std::string("no Vulkan driver (Debian: mesa-vulkan-drivers): ") + error.what());
    }
}

namespace {

bool matches(const DeviceInfo& info, const std::string& selector) {
    const bool number = selector.find_first_not_of("0123456789") == std::string::npos;
    return number ? selector == std::to_string(info.index)
                  : core::lower(info.name).find(core::lower(selector)) != std::string::npos;
}

}  // namespace

std::shared_ptr<gpu::Device> open_device(const DeviceOptions& options) {
    const auto infos = list_devices();
    const std::array<std::string, 5> preference{"discrete", "integrated", "virtual", "cpu", "other"};
    const DeviceInfo* best = nullptr;
    size_t best_rank = preference.size();
    std::string present;
    for (const auto& info : infos) {
        present += (present.empty() ? "" : "; ") + std::to_string(info.index) + " " + info.name +
                   (info.unusable.empty() ? "" : " (lacks " + info.unusable + ")");
        if (!info.unusable.empty() || (!options.selector.empty() && !matches(info, options.selector)))
            continue;
        const size_t rank =
            size_t(std::find(preference.begin(), preference.end(), info.type) - preference.begin());
        if (!best || rank < best_rank) best = &info, best_rank = rank;
    }
    if (!best)
        throw InputError((options.selector.empty()
                              ? "no usable Vulkan device"
                              : "no usable Vulkan device matches '" + options.selector + "'") +
                         "; present: " + present);
    return std::make_shared<gpu::Device>(*best, options.validation);
}

DeviceInfo device_info(const gpu::Device& device) {
    return device.info();
}
uint64_t device_bytes(const gpu::Device& device) {
    return device.allocated_bytes();
}
uint64_t peak_device_bytes(const gpu::Device& device) {
    return device.peak_bytes();
}

}  // namespace ewa
