// SPDX-License-Identifier: Apache-2.0
// Where Vulkan's functions come from. Programs link no loader: they read and write files on machines without one. CMake writes the
// functions that ewa calls (cmake/EwaVulkanLoader.cmake). Each looks for its counterpart when it is first called.
#pragma once
#include <vulkan/vulkan_core.h>

#include <string>

namespace ewa::gpu {

enum class VulkanSource {
    system,  // the loader that is installed
    own      // Mesa's driver for CPUs, which downloads of ewa carry in their folder of plugins
};

/// All functions come from this source from now on. No handle of the other may live, and no other thread may use Vulkan. Returns
/// the reason if it cannot.
std::string use_vulkan(VulkanSource source);

/// Whether functions come from the driver inside ewa.
bool uses_own_driver();

/// Returns the function, of the system's loader if use_vulkan() was not called. Throws RunError if there is none.
PFN_vkVoidFunction vulkan_function(const char* name);

/// For vulkan_loader.cpp: makes each function look for its counterpart again.
void forget_functions();

}  // namespace ewa::gpu
