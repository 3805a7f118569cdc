// SPDX-License-Identifier: Apache-2.0
#include "gpu/capabilities.h"

#include <algorithm>
#include <array>
#include <bit>
#include <string_view>

#include "ewa/gpu_interop.h"

namespace ewa::gpu {
namespace {

constexpr uint32_t kNeededVersion = VK_API_VERSION_1_2;

std::string version_text(uint32_t version) {
    return std::to_string(VK_API_VERSION_MAJOR(version)) + "." +
           std::to_string(VK_API_VERSION_MINOR(version)) + "." +
           std::to_string(VK_API_VERSION_PATCH(version));
}

std::string type_text(vk::PhysicalDeviceType type) {
    constexpr std::array kNames{"other", "integrated", "discrete", "virtual", "cpu"};  // in Vulkan's order
    return size_t(type) < kNames.size() ? kNames[size_t(type)] : "other";
}

/// What kernels need and the device lacks, or does not have enabled. Empty if it lacks nothing.
std::string missing_features(vk::PhysicalDevice device, const Subgroups& subgroups, const Enabled* enabled) {
    if (device.getProperties().apiVersion < kNeededVersion) return "Vulkan 1.2";
    std::string missing;
    const auto lacks = [&](bool lacking, const std::string& what) {
        if (lacking) missing += (missing.empty() ? "" : ", ") + what;
    };
    lacks(!compute_family(device.getQueueFamilyProperties(), false), "a compute queue");
    const auto features =
        device.getFeatures2<vk::PhysicalDeviceFeatures2, vk::PhysicalDeviceVulkan12Features>()
            .get<vk::PhysicalDeviceVulkan12Features>();
    lacks(!features.scalarBlockLayout, "scalarBlockLayout");
    lacks(features.scalarBlockLayout && enabled && !enabled->scalar_blocks,
          "scalarBlockLayout, which is not enabled");
    const auto subgroup =
        device.getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceSubgroupProperties>()
            .get<vk::PhysicalDeviceSubgroupProperties>();
    const auto needed = vk::SubgroupFeatureFlagBits::eBasic | vk::SubgroupFeatureFlagBits::eVote |
                        vk::SubgroupFeatureFlagBits::eShuffle;
    lacks((subgroup.supportedOperations & needed) != needed ||
              !(subgroup.supportedStages & vk::ShaderStageFlagBits::eCompute),
          "subgroup shuffles in compute shaders");
    lacks(subgroups.lanes > kMostLanes || !std::has_single_bit(subgroups.lanes),
          "subgroups of " + std::to_string(kMostLanes) + " lanes or fewer" +
              (enabled ? ", without subgroupSizeControl and computeFullSubgroups" : ""));
    return missing;
}

OptionalParts optional_parts_of(vk::PhysicalDevice device, const Subgroups& subgroups) {
    using Flag = vk::MemoryPropertyFlagBits;
    OptionalParts parts;
    parts.cpu = device.getProperties().deviceType == vk::PhysicalDeviceType::eCpu;
    parts.subgroups = subgroups;
    parts.ballots =
        bool(device.getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceSubgroupProperties>()
                 .get<vk::PhysicalDeviceSubgroupProperties>()
                 .supportedOperations &
             vk::SubgroupFeatureFlagBits::eBallot);
    parts.floats = float_modes_of(
        device.getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceFloatControlsProperties>()
            .get<vk::PhysicalDeviceFloatControlsProperties>());
    const auto families = device.getQueueFamilyProperties();
    const vk::QueueFamilyProperties& family = families[*compute_family(families, true)];
    parts.timestamps = family.timestampValidBits > 0;
    parts.own_queue = !(family.queueFlags & vk::QueueFlagBits::eGraphics);
    const auto memory = device.getMemoryProperties();
    const auto cached = Flag::eHostVisible | Flag::eHostCoherent | Flag::eHostCached;
    for (uint32_t i = 0; i < memory.memoryTypeCount; ++i)
        parts.cached_memory |= (memory.memoryTypes[i].propertyFlags & cached) == cached;
    return parts;
}

}  // namespace

bool has_extension(std::span<const vk::ExtensionProperties> available, std::string_view name) {
    return std::any_of(available.begin(), available.end(), [&](const vk::ExtensionProperties& one) {
        return std::string_view(one.extensionName.data()) == name;
    });
}

uint32_t subgroup_lanes(uint32_t natural, uint32_t least, uint32_t most) {
    constexpr uint32_t kNarrow = 8, kWide = 32, kBetween = 16;
    if (least <= kNarrow && natural >= kWide) return kBetween;
    return std::clamp(std::min(natural, kMostLanes), least, most);
}

Subgroups subgroups_of(vk::PhysicalDevice device, uint32_t version) {
    const auto natural =
        device.getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceSubgroupProperties>();
    Subgroups result{natural.get<vk::PhysicalDeviceSubgroupProperties>().subgroupSize};
    const uint32_t own = natural.get<vk::PhysicalDeviceProperties2>().properties.apiVersion;
    const bool core = std::min(own, version) >= VK_API_VERSION_1_3;
    result.extension = !core && has_extension(device.enumerateDeviceExtensionProperties(),
                                              VK_EXT_SUBGROUP_SIZE_CONTROL_EXTENSION_NAME);
    if (core || result.extension) {
        const auto features =
            device.getFeatures2<vk::PhysicalDeviceFeatures2, vk::PhysicalDeviceSubgroupSizeControlFeatures>()
                .get<vk::PhysicalDeviceSubgroupSizeControlFeatures>();
        const auto sizes = device
                               .getProperties2<vk::PhysicalDeviceProperties2,
                                               vk::PhysicalDeviceSubgroupSizeControlProperties>()
                               .get<vk::PhysicalDeviceSubgroupSizeControlProperties>();
        result.controlled = features.subgroupSizeControl && features.computeFullSubgroups &&
                            (sizes.requiredSubgroupSizeStages & vk::ShaderStageFlagBits::eCompute);
        if (result.controlled)
            result.lanes = subgroup_lanes(result.lanes, sizes.minSubgroupSize, sizes.maxSubgroupSize);
    }
    return result;
}

Enabled enabled_by(const VkDeviceCreateInfo& info) {
    Enabled enabled;
    const auto sizes = [&](VkBool32 controlled, VkBool32 full) {
        enabled.subgroup_sizes |= controlled && full;
    };
    if (info.pEnabledFeatures) enabled.int64 = info.pEnabledFeatures->shaderInt64;
    for (const auto* next = static_cast<const VkBaseInStructure*>(info.pNext); next; next = next->pNext) {
        if (next->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2)
            enabled.int64 |= reinterpret_cast<const VkPhysicalDeviceFeatures2*>(next)->features.shaderInt64;
        if (next->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES)
            enabled.scalar_blocks |=
                reinterpret_cast<const VkPhysicalDeviceVulkan12Features*>(next)->scalarBlockLayout;
        if (next->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SCALAR_BLOCK_LAYOUT_FEATURES)
            enabled.scalar_blocks |=
                reinterpret_cast<const VkPhysicalDeviceScalarBlockLayoutFeatures*>(next)->scalarBlockLayout;
        if (next->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES) {
            const auto* part = reinterpret_cast<const VkPhysicalDeviceVulkan13Features*>(next);
            sizes(part->subgroupSizeControl, part->computeFullSubgroups);
        }
        if (next->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_SIZE_CONTROL_FEATURES) {
            const auto* part = reinterpret_cast<const VkPhysicalDeviceSubgroupSizeControlFeatures*>(next);
            sizes(part->subgroupSizeControl, part->computeFullSubgroups);
        }
    }
    for (uint32_t i = 0; i < info.enabledExtensionCount; ++i)
        enabled.host_memory |=
            std::string_view(info.ppEnabledExtensionNames[i]) == VK_EXT_EXTERNAL_MEMORY_HOST_EXTENSION_NAME;
    return enabled;
}

std::optional<uint32_t> compute_family(std::span<const vk::QueueFamilyProperties> families, bool own_queue) {
    std::optional<uint32_t> first;
    for (uint32_t i = 0; i < families.size(); ++i) {
        const vk::QueueFlags flags = families[i].queueFlags;
        if (!(flags & vk::QueueFlagBits::eCompute) || families[i].queueCount == 0) continue;
        if (!own_queue || !(flags & vk::QueueFlagBits::eGraphics)) return i;
        if (!first) first = i;
    }
    return first;
}

FloatModes float_modes_of(const vk::PhysicalDeviceFloatControlsProperties& properties) {
    // Without independence, a mode of 32-bit floats needs the same mode of the other sizes.
    const bool alone = properties.denormBehaviorIndependence != vk::ShaderFloatControlsIndependence::eNone;
    return {.special_values = bool(properties.shaderSignedZeroInfNanPreserveFloat32),
            .denormals = alone && properties.shaderDenormPreserveFloat32};
}

std::vector<std::string> lacks_of(const OptionalParts& parts) {
    std::vector<std::string> lacks;
    if (!parts.subgroups.controlled)
        lacks.emplace_back("subgroup size control (kernels run with the lanes that the driver reports)");
    if (!parts.ballots && !parts.cpu) lacks.emplace_back("subgroup ballots (sorting is slower)");
    if (!parts.floats.special_values)
        lacks.emplace_back("exact infinities and NaN (broken splats may not be recognised)");
    if (!parts.floats.denormals)
        lacks.emplace_back("exact denormal numbers (values under 1.2e-38 may count as zero)");
    if (!parts.timestamps) lacks.emplace_back("timestamps (no times of single passes)");
    if (!parts.own_queue && !parts.cpu)
        lacks.emplace_back("a queue for compute alone (training and the desktop wait for each other)");
    if (!parts.cached_memory)
        lacks.emplace_back("memory that the host caches (reading results back is slow)");
    return lacks;
}

DeviceInfo describe(vk::PhysicalDevice device, int index, uint32_t version, const Enabled* enabled) {
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
    Subgroups subgroups = subgroups_of(device, version);
    if (enabled && !enabled->subgroup_sizes && subgroups.controlled)
        subgroups = {chain.get<vk::PhysicalDeviceSubgroupProperties>().subgroupSize};
    info.subgroup_size = subgroups.lanes;
    const auto memory = device.getMemoryProperties();
    for (uint32_t i = 0; i < memory.memoryHeapCount; ++i)
        if (memory.memoryHeaps[i].flags & vk::MemoryHeapFlagBits::eDeviceLocal)
            info.memory_bytes = std::max<uint64_t>(info.memory_bytes, memory.memoryHeaps[i].size);
    info.unusable = missing_features(device, subgroups, enabled);
    if (info.unusable.empty()) info.lacks = lacks_of(optional_parts_of(device, subgroups));
    return info;
}

}  // namespace ewa::gpu
