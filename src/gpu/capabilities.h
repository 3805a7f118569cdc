// SPDX-License-Identifier: Apache-2.0
// The features of a physical device: those that kernels need, and those that ewa uses if present.
#pragma once
#include <compare>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>
#include <vulkan/vulkan.hpp>

#include "ewa/device.h"

namespace ewa::gpu {

inline constexpr uint32_t kUsedVersion = VK_API_VERSION_1_3;  // of what a device has

bool has_extension(std::span<const vk::ExtensionProperties> available, std::string_view name);

constexpr uint32_t kMostLanes = 64;  // of a subgroup: a tile's pixels
/// The size that pipelines with subgroup operations ask for: a device's own, within its limits, and at most kMostLanes
/// where they allow it. A device that can run 8 lanes as well as 32 (Intel) gets 16: a lane then has twice the registers.
uint32_t subgroup_lanes(uint32_t natural, uint32_t least, uint32_t most);

struct Subgroups {
    uint32_t lanes = 0;
    bool controlled = false;  // a pipeline can ask for this size
    bool extension = false;   // it needs an extension, because the device's version of Vulkan lacks it
};
/// version: of the instance.
Subgroups subgroups_of(vk::PhysicalDevice device, uint32_t version = kUsedVersion);

/// The features that a device was created with, among those that ewa uses.
struct Enabled {
    bool scalar_blocks = false;
    bool subgroup_sizes = false;
    bool int64 = false;
    bool host_memory = false;  // VK_EXT_external_memory_host
};
Enabled enabled_by(const VkDeviceCreateInfo& info);

/// The first queue family with compute. own_queue: one without graphics if there is one. Its work and the
/// desktop's do not wait for each other.
std::optional<uint32_t> compute_family(std::span<const vk::QueueFamilyProperties> families, bool own_queue);

/// Properties of 32-bit floats that kernels can request.
struct FloatModes {
    bool special_values = false;  // signed zeros, infinities and NaN are kept: comparisons with NaN fail
    bool denormals = false;       // numbers below 1.2e-38 are kept
    auto operator<=>(const FloatModes&) const = default;
};
FloatModes float_modes_of(const vk::PhysicalDeviceFloatControlsProperties& properties);

/// Optional features of a usable device.
struct OptionalParts {
    bool cpu = false;
    Subgroups subgroups;
    bool ballots = false;  // of subgroups
    FloatModes floats;
    bool timestamps = false;
    bool own_queue = false;      // a compute queue without graphics
    bool cached_memory = false;  // that the host can map
};
/// The missing features, each with its consequence. Ballots and a queue of its own have no
/// consequence on a CPU device.
std::vector<std::string> lacks_of(const OptionalParts& parts);

/// enabled: of a device that is open; null: all that there is can be enabled.
DeviceInfo describe(vk::PhysicalDevice device, int index, uint32_t version = kUsedVersion,
                    const Enabled* enabled = nullptr);

}  // namespace ewa::gpu
