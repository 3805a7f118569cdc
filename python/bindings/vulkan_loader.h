// SPDX-License-Identifier: Apache-2.0
// The Vulkan loader, which the module does not link: files are read and written on machines without one. cmake/EwaVulkanLoader.cmake
// writes the functions of Vulkan that libewa calls; each finds its counterpart in the loader with its first call.
#pragma once
#include <vulkan/vulkan_core.h>

namespace ewa::python {

/// Whether a Vulkan loader is installed. Loads it.
bool has_vulkan_loader();

/// The loader's function, or null.
PFN_vkVoidFunction vulkan_function(const char* name);

}  // namespace ewa::python
