// SPDX-License-Identifier: Apache-2.0
// libewa on the Vulkan device of another program, and renders that stay on it. Only this header needs Vulkan's headers, which the
// program must provide. Handles come from the system's loader (libvulkan.so.1), which libewa loads at run time; a program may link
// it or load it. examples/interop is an example.
#pragma once
#include <vulkan/vulkan_core.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <variant>
#include <vector>

#include "ewa/camera.h"
#include "ewa/device.h"
#include "ewa/render_options.h"

namespace ewa {

class Renderer;

/// The extensions and features of a device that libewa uses. VkDeviceCreateInfo::pNext points to `features`, and pEnabledFeatures is null. Its extensions are
/// `extensions`. A program adds its own needs to the members and to the end of the chain, and its
/// VkPhysicalDeviceVulkan13Features by use(). libewa cannot do without
/// VkPhysicalDeviceVulkan12Features::scalarBlockLayout. Without the other features and the extensions it is slower.
struct DeviceNeeds {
    /// api_version: VkApplicationInfo::apiVersion of the instance, 1.2 or later.
    explicit DeviceNeeds(VkPhysicalDevice physical, uint32_t api_version = VK_API_VERSION_1_3);
    DeviceNeeds(const DeviceNeeds&) = delete;

    std::vector<const char*> extensions;                           // to enable
    VkPhysicalDeviceFeatures2 features{};                          // the chain's first structure
    VkPhysicalDeviceVulkan12Features vulkan12{};                   // its second
    VkPhysicalDeviceSubgroupSizeControlFeatures subgroup_sizes{};  // its third, where the device has this

    /// Puts the program's structure into the chain in place of subgroup_sizes, and enables the features of subgroup_sizes in it.
    /// Vulkan allows only one of these two in a chain. The structure's pNext stays. Instance and device must be of Vulkan 1.3.
    void use(VkPhysicalDeviceVulkan13Features& vulkan13);
};

/// A program's own device. All handles must outlive what borrow_device returns.
struct VulkanDevice {
    VkInstance instance = VK_NULL_HANDLE;
    VkPhysicalDevice physical = VK_NULL_HANDLE;
    VkDevice device = VK_NULL_HANDLE;
    VkQueue queue = VK_NULL_HANDLE;             // for compute; all work of libewa goes there
    uint32_t queue_family = 0;                  // the queue's
    uint32_t api_version = VK_API_VERSION_1_3;  // VkApplicationInfo::apiVersion of the instance
    /// The structure that the device was created with, or an equal one: Vulkan does not tell which features and extensions are
    /// enabled. Only borrow_device reads it.
    const VkDeviceCreateInfo* created_with = nullptr;
    /// Submits to the queue in place of vkQueueSubmit, for a program whose threads share the queue: Vulkan allows one of them
    /// at a time. Null: no other thread may use the queue while a function of libewa runs.
    std::function<VkResult(const VkSubmitInfo&, VkFence)> submit{};
};

/// Wraps the program's device for renderers, trainers and operators. These allocate their own memory on it. They wait for their own
/// submissions only, never for the whole queue or device. Throws InputError, in one line that names each thing that is missing:
/// handles, a version of Vulkan, features of the device, and features that are not enabled.
std::shared_ptr<gpu::Device> borrow_device(const VulkanDevice& vulkan);

/// A part of a caller's image on the renderer's device. The image has one sample and VK_IMAGE_USAGE_TRANSFER_DST_BIT.
struct DeviceImage {
    VkImage image = VK_NULL_HANDLE;
    VkExtent2D size{};   // px, of the mip level
    VkOffset2D place{};  // px; where the render's top left corner goes
    uint32_t mip_level = 0, array_layer = 0;
    /// VK_IMAGE_LAYOUT_UNDEFINED: the earlier contents of the level and layer are lost.
    VkImageLayout layout_before = VK_IMAGE_LAYOUT_UNDEFINED;
    VkImageLayout layout_after = VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL;
    /// For an image of VK_SHARING_MODE_EXCLUSIVE that another queue family uses next: that family, whose queue then acquires
    /// the image with the same layouts, TRANSFER_DST_OPTIMAL and layout_after.
    uint32_t family_after = VK_QUEUE_FAMILY_IGNORED;
};

/// A part of a caller's buffer on the renderer's device, with VK_BUFFER_USAGE_TRANSFER_DST_BIT.
struct DeviceBuffer {
    VkBuffer buffer = VK_NULL_HANDLE;
    VkDeviceSize size = 0;   // bytes, of the buffer
    VkDeviceSize begin = 0;  // bytes; where the render's first row begins, a multiple of 4
    /// Bytes from the start of a row to that of the next, a multiple of 4. 0: rows have no gap between them.
    VkDeviceSize row_bytes = 0;
};

/// Where a render is written, and which of its planes: the format decides. Rows go from top to bottom.
/// - VK_FORMAT_R32G32B32A32_SFLOAT: Rendering::color and Rendering::alpha, the same values. The background is blended in. Over
///   a black one, the colour is multiplied by alpha.
/// - VK_FORMAT_R8G8B8A8_UNORM and VK_FORMAT_R8G8B8A8_SRGB: the same as bytes, rounded and clamped as save_image does it. The
///   bytes do not depend on which of both it is. Splats have the colours of 8-bit files: UNORM shows them as they are, and a
///   sampler of SRGB makes them linear.
/// - VK_FORMAT_R32_SFLOAT, for Drawing::depth: Rendering::depth, world units along the view's z.
struct DeviceTarget {
    VkFormat format = VK_FORMAT_UNDEFINED;
    std::variant<DeviceImage, DeviceBuffer> to;
};

/// Semaphores of a render, each null for none. Values are those of timeline semaphores; 0: a binary one.
struct DeviceSync {
    /// The targets are written after its signal, which must have been submitted before.
    VkSemaphore wait = VK_NULL_HANDLE;
    uint64_t wait_value = 0;
    VkSemaphore signal = VK_NULL_HANDLE;  // after the targets are written
    uint64_t signal_value = 0;
};

/// Renderer::render into targets on the renderer's device. Nothing is copied to the host. options.drawing is color, ellipsoids,
/// depth or count. The images among the targets are different mip levels or layers.
///
/// Returns when the targets are written and have their layouts. Commands that are submitted to the same queue later see the
/// values without a barrier. Another queue sees them by `signal`, or with a barrier of its own after the return. Commands that
/// were submitted to the same queue earlier come first; work of another queue on the targets must have ended, or signal `wait`.
///
/// Throws what render throws. Throws InputError, before anything is written, for a target that is null, too small or of
/// another format.
void render_to(Renderer& renderer, const Camera& camera, const DrawOptions& options,
               std::span<const DeviceTarget> targets, const DeviceSync& sync = {});

}  // namespace ewa
