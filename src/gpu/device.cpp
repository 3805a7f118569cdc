// SPDX-License-Identifier: Apache-2.0
#include "gpu/device.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string_view>
#include <thread>
#include <utility>

#include "core/packages.h"
#include "core/system_limits.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "gpu/capabilities.h"
#include "gpu/choose.h"
#include "gpu/pipeline.h"
#include "gpu/vulkan_loader.h"
#include "platform/folders.h"
#include "platform/system.h"

namespace ewa {
namespace gpu {
namespace {

constexpr uint32_t kVendorAmd = 0x1002;
constexpr uint64_t kManyTexels = 1 << 27;  // lavapipe's. Its fetches from texel buffers are fast

/// The loader hides drivers for portable subsets of Vulkan (MoltenVK) from who does not ask for them.
vk::UniqueInstance make_instance(const std::vector<const char*>& layers,
                                 std::vector<const char*> extensions) {
    vk::ApplicationInfo application;
    application.setPApplicationName("ewa").setApiVersion(kUsedVersion);
    vk::InstanceCreateInfo create;
    if (has_extension(vk::enumerateInstanceExtensionProperties(),
                      VK_KHR_PORTABILITY_ENUMERATION_EXTENSION_NAME)) {
        extensions.push_back(VK_KHR_PORTABILITY_ENUMERATION_EXTENSION_NAME);
        create.setFlags(vk::InstanceCreateFlagBits::eEnumeratePortabilityKHR);
    }
    create.setPApplicationInfo(&application)
        .setPEnabledLayerNames(layers)
        .setPEnabledExtensionNames(extensions);
    return vk::createInstanceUnique(create);
}

/// Variables of the environment that name drivers for the loader (its LoaderDriverInterface document).
constexpr const char* kDriverVariables[] = {"VK_DRIVER_FILES", "VK_ICD_FILENAMES"};

bool names_drivers() {
    return std::ranges::any_of(kDriverVariables, [](const char* name) { return std::getenv(name); });
}

/// Drivers that the environment names, where else the loader looks, and what to install.
std::string what_would_help() {
    const std::string install = core::how_to_install(core::Thing::driver);
    for (const char* variable : kDriverVariables)
        if (const char* files = std::getenv(variable))
            return std::string(variable) + " names " + core::one_line(files) + " alone; " + install;
    std::string found;
    for (const std::filesystem::path& folder : platform::driver_folders()) {
        std::error_code none;
        for (const auto& entry : std::filesystem::directory_iterator(folder, none))
            found += (found.empty() ? "drivers: " : ", ") + core::one_line(entry.path().string());
    }
    return (found.empty() ? "no driver is installed" : found) + "; " + install;
}

/// With NVIDIA's driver, the loader asks the layer for this function while it creates a device. ewa never does.
bool is_of_the_loader(std::string_view message) {
    return message.find(
               "vkGetDeviceProcAddr(): pName is trying to grab "
               "vkGetPhysicalDeviceVideoEncodeQualityLevelPropertiesKHR which is an instance level "
               "function") != std::string_view::npos;
}

VKAPI_ATTR VkBool32 VKAPI_CALL on_message(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                          VkDebugUtilsMessageTypeFlagsEXT,
                                          const VkDebugUtilsMessengerCallbackDataEXT* data, void* user) {
    static_cast<Device*>(user)->add_validation_message(data->pMessage);
    return VK_FALSE;
}

bool shares_memory(const vk::PhysicalDeviceProperties& properties) {
    return properties.deviceType == vk::PhysicalDeviceType::eCpu ||
           properties.deviceType == vk::PhysicalDeviceType::eIntegratedGpu;
}

/// Whether kernels with texel buffers suit the device. They also store words of 64 bits, and a lane of theirs has at least two
/// pixels of a tile.
bool fetches_fast(const vk::PhysicalDeviceProperties& properties, uint32_t lanes) {
    return properties.deviceType == vk::PhysicalDeviceType::eCpu &&
           properties.limits.maxTexelBufferElements >= kManyTexels && lanes <= 32;
}

/// What the caller's device is. Throws InputError that names what is missing.
DeviceInfo described(const VulkanDevice& borrowed) {
    std::string missing;
    const auto lacks = [&](bool lacking, const std::string& what) {
        if (lacking) missing += (missing.empty() ? "" : "; ") + what;
    };
    lacks(!borrowed.instance, "no instance");
    lacks(!borrowed.physical, "no physical device");
    lacks(!borrowed.device, "no device");
    lacks(!borrowed.queue, "no queue");
    lacks(!borrowed.created_with, "no VkDeviceCreateInfo that the device was created with");
    DeviceInfo info;
    if (missing.empty()) {
        lacks(borrowed.api_version < VK_API_VERSION_1_2, "an instance of a version of Vulkan before 1.2");
        const vk::PhysicalDevice physical(borrowed.physical);
        const Enabled enabled = enabled_by(*borrowed.created_with);
        const auto all = vk::Instance(borrowed.instance).enumeratePhysicalDevices();
        const auto place = std::ranges::find(all, physical);
        lacks(place == all.end(), "the physical device is not of the instance");
        const auto families = physical.getQueueFamilyProperties();
        lacks(borrowed.queue_family >= families.size() ||
                  !(families[borrowed.queue_family].queueFlags & vk::QueueFlagBits::eCompute),
              "queue family " + std::to_string(borrowed.queue_family) + " has no compute");
        info = describe(physical, int(place - all.begin()), borrowed.api_version, &enabled);
        lacks(!info.unusable.empty(), info.name + " lacks " + info.unusable);
    }
    if (!missing.empty())
        throw InputError("a Vulkan device that cannot be borrowed: " + missing +
                         "; ewa::DeviceNeeds has what to enable");
    return info;
}

/// Mesa's compiler for CPUs crashes where it gets no memory.
void check_address_space(const DeviceInfo& info) {
    constexpr uint64_t kLeast = uint64_t(960) << 20;
    const uint64_t limit = platform::memory_limit();
    if (info.type != "cpu" || limit >= kLeast) return;
    throw RunError(info.name + " needs " + std::to_string(kLeast >> 20) +
                   " MiB of address space; this process may use only " + std::to_string(limit >> 20) +
                   " MiB; a higher limit (ulimit -v, ulimit -d) helps");
}

}  // namespace

Device::Device(const DeviceInfo& info, bool validation, bool own_queue, vk::UniqueInstance instance)
    : info_(info), instance_(std::move(instance)) {
    check_address_space(info);
    try {
        if (!instance_) create_instance(validation);
        physical_ = instance_->enumeratePhysicalDevices().at(size_t(info.index));
        create_device(own_queue);
    } catch (const vk::SystemError& error) {
        throw RunError("cannot open Vulkan device " + info.name + ": " + error.what());
    }
}

Device::Device(const VulkanDevice& borrowed)
    : info_(described(borrowed)),
      physical_(borrowed.physical),
      device_(borrowed.device),
      queue_(borrowed.queue),
      submit_(borrowed.submit),
      queue_family_(borrowed.queue_family) {
    check_address_space(info_);
    try {
        Enabled enabled = enabled_by(*borrowed.created_with);
        enabled.subgroup_sizes &= subgroups_of(physical_, borrowed.api_version).controlled;
        enabled.host_memory &= shares_memory(physical_.getProperties());
        use_device(enabled);
    } catch (const vk::SystemError& error) {
        throw RunError("cannot use Vulkan device " + info_.name + ": " + error.what());
    }
}

Device::~Device() {
    if (own_device_) (void)vkDeviceWaitIdle(device_);
    if (messenger_) {
        const auto destroy = reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(
            vkGetInstanceProcAddr(*instance_, "vkDestroyDebugUtilsMessengerEXT"));
        destroy(*instance_, messenger_, nullptr);
    }
}

void Device::create_instance(bool validation) {
    std::vector<const char*> layers, extensions;
    if (validation) {
        layers.push_back("VK_LAYER_KHRONOS_validation");
        extensions.push_back(VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
        // The driver inside ewa knows of no layers.
        const auto available =
            uses_own_driver() ? std::vector<vk::LayerProperties>() : vk::enumerateInstanceLayerProperties();
        if (std::none_of(available.begin(), available.end(), [](const vk::LayerProperties& layer) {
                return std::string(layer.layerName.data()) == "VK_LAYER_KHRONOS_validation";
            }))
            throw InputError("the Khronos validation layer is not installed (" +
                             core::how_to_install(core::Thing::validation) + ")");
    }
    instance_ = make_instance(layers, extensions);
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

void Device::create_device(bool own_queue) {
    const DeviceNeeds needs(physical_, kUsedVersion);
    queue_family_ = *compute_family(physical_.getQueueFamilyProperties(), own_queue);
    const float priority = 1.0f;
    vk::DeviceQueueCreateInfo queue;
    queue.setQueueFamilyIndex(queue_family_).setQueuePriorities(priority);
    vk::DeviceCreateInfo create;
    create.setPNext(&needs.features).setQueueCreateInfos(queue).setPEnabledExtensionNames(needs.extensions);
    own_device_ = physical_.createDeviceUnique(create);
    device_ = *own_device_;
    queue_ = device_.getQueue(queue_family_, 0);
    use_device(enabled_by(create));
}

void Device::use_device(const Enabled& enabled) {
    const auto properties = physical_.getProperties();
    subgroup_size_control_ = enabled.subgroup_sizes;
    limits_.subgroup_size = info_.subgroup_size;
    limits_.cpu = properties.deviceType == vk::PhysicalDeviceType::eCpu;
    if (limits_.cpu) limits_.threads = std::max(1u, std::thread::hardware_concurrency());
    limits_.max_texels = properties.limits.maxTexelBufferElements;
    limits_.texel_buffers = enabled.int64 && fetches_fast(properties, info_.subgroup_size);
    pipeline_cache_ = device_.createPipelineCacheUnique({});
    pipelines_ = std::make_unique<PipelineStore>();

    float_modes_ = float_modes_of(
        physical_.getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceFloatControlsProperties>()
            .get<vk::PhysicalDeviceFloatControlsProperties>());

    limits_.exact_floats = !limits_.cpu;
    limits_.max_groups = *std::min_element(properties.limits.maxComputeWorkGroupCount.begin(),
                                           properties.limits.maxComputeWorkGroupCount.end());
    limits_.max_invocations = std::min(properties.limits.maxComputeWorkGroupInvocations,
                                       properties.limits.maxComputeWorkGroupSize[0]);
    limits_.shared_bytes = properties.limits.maxComputeSharedMemorySize;
    const auto operations =
        physical_.getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceSubgroupProperties>()
            .get<vk::PhysicalDeviceSubgroupProperties>()
            .supportedOperations;
    limits_.scalar_loads = properties.vendorID == kVendorAmd;
    limits_.ballots = bool(operations & vk::SubgroupFeatureFlagBits::eBallot);
    limits_.max_storage_range = properties.limits.maxStorageBufferRange;
    limits_.uniform_alignment = properties.limits.minUniformBufferOffsetAlignment;
    limits_.storage_alignment = properties.limits.minStorageBufferOffsetAlignment;
    limits_.timestamps = physical_.getQueueFamilyProperties()[queue_family_].timestampValidBits > 0;
    limits_.timestamp_nanoseconds = properties.limits.timestampPeriod;
    if (enabled.host_memory)
        limits_.host_page = physical_
                                .getProperties2<vk::PhysicalDeviceProperties2,
                                                vk::PhysicalDeviceExternalMemoryHostPropertiesEXT>()
                                .get<vk::PhysicalDeviceExternalMemoryHostPropertiesEXT>()
                                .minImportedHostPointerAlignment;
    memory_ = std::make_unique<MemoryPool>(physical_, device_, shares_memory(properties));
}

Memory Device::allocate(const vk::MemoryRequirements& requirements, bool host_visible) {
    auto memory = memory_->allocate(requirements, host_visible);
    while (!memory && make_room_ && make_room_()) memory = memory_->allocate(requirements, host_visible);
    if (!memory) throw out_of_memory(requirements.size);
    return std::move(*memory);
}

void Device::submit(const vk::SubmitInfo& info, vk::Fence fence) {
    const std::lock_guard lock(queue_mutex_);
    if (!submit_) return queue_.submit(info, fence);
    const auto result = vk::Result(submit_(info, fence));
    if (result == vk::Result::eErrorDeviceLost) throw vk::DeviceLostError("vkQueueSubmit");
    if (result != vk::Result::eSuccess) throw vk::SystemError(vk::make_error_code(result), "vkQueueSubmit");
}

void Device::limit_memory(uint64_t bytes, std::function<bool()> make_room) {
    memory_->limit_bytes(bytes);
    make_room_ = std::move(make_room);
}

uint64_t Device::staging_bytes() const {
    constexpr uint64_t kMost = MemoryPool::kStagingBytes, kLeast = uint64_t(1) << 16;
    const uint64_t limit = memory_limit();
    // Half of the part that is kept for it: the host sees other small buffers, too.
    return limit == 0 ? kMost : std::clamp(MemoryPool::host_part(limit) / 2, kLeast, kMost);
}

RunError Device::out_of_memory(uint64_t bytes) const {
    // The driver may have less than the limit.
    const uint64_t limit = memory_limit();
    if (limit > 0 && memory_use().held + bytes > limit - MemoryPool::host_part(limit)) {
        // What stays here beside what could not be freed.
        const double held = double(memory_use().held + bytes);
        const double least = held * double(limit) / double(limit - MemoryPool::host_part(limit));
        // GiB, as the option has them.
        const auto shown = [](double value) {
            return core::shown_number(std::ceil(1e4 * value / double(uint64_t(1) << 30)) / 1e4);
        };
        return RunError("--device-memory " + shown(double(limit)) + " is too little: this needs " +
                        shown(least) + " or more (" + std::to_string(uint64_t(std::ceil(least))) +
                        " bytes, not " + std::to_string(limit) +
                        "); --downscale, a smaller --image-cache or fewer splats need less");
    }
    return RunError("out of device memory on " + info_.name + ": " + core::address_limit_text() +
                    std::to_string(bytes >> 20) + " MiB are needed beside the " +
                    std::to_string(allocated_bytes() >> 20) +
                    " MiB already allocated; fewer splats, a lower SH degree or --downscale need less");
}

void Device::add_validation_message(const std::string& message) {
    if (is_of_the_loader(message)) return;
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

DeviceNeeds::DeviceNeeds(VkPhysicalDevice handle, uint32_t api_version) {
    if (!handle) throw InputError("no physical device");
    const vk::PhysicalDevice physical(handle);
    const auto properties = physical.getProperties();
    const auto available = physical.enumerateDeviceExtensionProperties();
    const gpu::Subgroups subgroups = gpu::subgroups_of(physical, api_version);
    const auto want = [&](bool wanted, const char* name) {
        if (wanted && gpu::has_extension(available, name)) extensions.push_back(name);
    };
    want(subgroups.controlled && subgroups.extension, VK_EXT_SUBGROUP_SIZE_CONTROL_EXTENSION_NAME);
    want(gpu::shares_memory(properties), VK_EXT_EXTERNAL_MEMORY_HOST_EXTENSION_NAME);
    // A driver for a subset of Vulkan wants its users to say that they know.
    want(true, "VK_KHR_portability_subset");
    features.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2;
    features.pNext = &vulkan12;
    features.features.shaderInt64 =
        gpu::fetches_fast(properties, subgroups.lanes) && physical.getFeatures().shaderInt64;
    vulkan12.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES;
    vulkan12.scalarBlockLayout = true;
    subgroup_sizes.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_SIZE_CONTROL_FEATURES;
    subgroup_sizes.subgroupSizeControl = subgroup_sizes.computeFullSubgroups = subgroups.controlled;
    if (subgroups.controlled) vulkan12.pNext = &subgroup_sizes;
}

void DeviceNeeds::use(VkPhysicalDeviceVulkan13Features& vulkan13) {
    vulkan13.subgroupSizeControl |= subgroup_sizes.subgroupSizeControl;
    vulkan13.computeFullSubgroups |= subgroup_sizes.computeFullSubgroups;
    vulkan12.pNext = &vulkan13;
}

namespace {

struct Found {
    vk::UniqueInstance instance;
    std::vector<DeviceInfo> devices;
};

Found devices_of_source() {
    Found found{gpu::make_instance({}, {}), {}};
    int index = 0;
    for (const auto& device : found.instance->enumeratePhysicalDevices()) {
        found.devices.push_back(gpu::describe(device, index++));
        if (gpu::uses_own_driver()) found.devices.back().name += " inside ewa";
    }
    return found;
}

/// Returns the reason if there is no device.
std::string find_in_source(gpu::VulkanSource source, Found& found) {
    std::string reason = gpu::use_vulkan(source);
    if (!reason.empty()) return reason;
    try {
        found = devices_of_source();
        return found.devices.empty() ? "no Vulkan device" : "";
    } catch (const vk::SystemError& error) {
        return "no Vulkan driver works (" + vk::to_string(vk::Result(error.code().value())) + ")";
    }
}

/// The system's devices. Where it has none, and the environment names no drivers, those of the driver inside ewa.
Found find_devices() {
    static std::mutex mutex;
    const std::lock_guard lock(mutex);
    Found found;
    std::string reason;
    if (!gpu::uses_own_driver()) {
        reason = find_in_source(gpu::VulkanSource::system, found);
        if (reason.empty()) return found;
        found = {};  // no handle of the loader may outlive the change
    }
    if (!gpu::names_drivers() && find_in_source(gpu::VulkanSource::own, found).empty()) return found;
    throw RunError(reason + "; " + core::address_limit_text() + gpu::what_would_help());
}

}  // namespace

std::vector<DeviceInfo> list_devices() {
    return find_devices().devices;
}

std::shared_ptr<gpu::Device> open_device(const DeviceOptions& options) {
    Found found = find_devices();
    const DeviceInfo chosen = gpu::choose_device(found.devices, options.selector);
    if (options.validation) found.instance.reset();  // the validation layer comes with an instance of its own
    return std::make_shared<gpu::Device>(chosen, options.validation, options.own_queue,
                                         std::move(found.instance));
}

std::shared_ptr<gpu::Device> borrow_device(const VulkanDevice& vulkan) {
    return std::make_shared<gpu::Device>(vulkan);
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
