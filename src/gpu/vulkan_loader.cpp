// SPDX-License-Identifier: Apache-2.0
#include "gpu/vulkan_loader.h"

#include <filesystem>
#include <memory>
#include <mutex>

#include "core/plugin.h"
#include "ewa/error.h"
#include "platform/library.h"

namespace ewa::gpu {
namespace {

struct Source {
    std::unique_ptr<platform::Library> library;
    // A driver exports this function alone. It finds the others by an instance.
    PFN_vkGetInstanceProcAddr find = nullptr;
    VkInstance instance = VK_NULL_HANDLE;
};

Source& source() {
    static Source one;
    return one;
}

std::string open_driver(Source& opened) {
    const std::string name = std::string("libvulkan_lvp") + platform::kLibrarySuffix;
    const std::filesystem::path file = core::file_beside(name);
    if (file.empty()) return "this ewa has no driver inside";
    opened.library = std::make_unique<platform::Library>(file);
    opened.find =
        reinterpret_cast<PFN_vkGetInstanceProcAddr>(opened.library->find("vk_icdGetInstanceProcAddr"));
    const auto create =
        opened.find ? reinterpret_cast<PFN_vkCreateInstance>(opened.find(VK_NULL_HANDLE, "vkCreateInstance"))
                    : nullptr;
    if (!create) return file.string() + " cannot be loaded: " + opened.library->error();
    VkApplicationInfo application{};
    application.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO;
    application.apiVersion = VK_API_VERSION_1_3;
    VkInstanceCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
    info.pApplicationInfo = &application;
    // It lives until the process ends: functions are looked up by it.
    if (create(&info, nullptr, &opened.instance) != VK_SUCCESS) return file.string() + " does not start";
    return {};
}

std::string open_loader(Source& opened) {
    opened.library = std::make_unique<platform::Library>(platform::kVulkanLoader);
    if (!*opened.library) return std::string("there is no Vulkan loader (") + platform::kVulkanLoader + ")";
    // Vulkan's C++ functions must not throw, so that a loader which is too old is refused here.
    constexpr const char* kNewest = "vkGetPhysicalDeviceProperties2";
    if (opened.library->find(kNewest)) return {};
    return std::string(platform::kVulkanLoader) + " is older than Vulkan 1.1";
}

std::string open_locked(VulkanSource wanted) {
    if (source().library && bool(source().find) == (wanted == VulkanSource::own)) return {};
    Source opened;
    std::string reason = wanted == VulkanSource::own ? open_driver(opened) : open_loader(opened);
    if (!reason.empty()) return reason;
    source() = std::move(opened);
    forget_functions();
    return {};
}

std::mutex& source_mutex() {
    static std::mutex one;
    return one;
}

}  // namespace

std::string use_vulkan(VulkanSource wanted) {
    const std::lock_guard lock(source_mutex());
    return open_locked(wanted);
}

bool uses_own_driver() {
    const std::lock_guard lock(source_mutex());
    return source().find != nullptr;
}

PFN_vkVoidFunction vulkan_function(const char* name) {
    const std::lock_guard lock(source_mutex());
    if (!source().library) {
        const std::string reason = open_locked(VulkanSource::system);
        if (!reason.empty()) throw RunError(reason);
    }
    const Source& from = source();
    PFN_vkVoidFunction found = nullptr;
    if (from.find) {
        found = from.find(from.instance, name);
        // Those that need no instance are not found by one.
        if (!found) found = from.find(VK_NULL_HANDLE, name);
    } else {
        found = reinterpret_cast<PFN_vkVoidFunction>(from.library->find(name));
    }
    if (!found)
        throw RunError(std::string(from.find ? "the driver inside ewa" : platform::kVulkanLoader) +
                       " has no function " + name);
    return found;
}

}  // namespace ewa::gpu
