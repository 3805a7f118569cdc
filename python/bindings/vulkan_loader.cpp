// SPDX-License-Identifier: Apache-2.0
#include "vulkan_loader.h"

#include <dlfcn.h>

namespace ewa::python {
namespace {

void* loader() {
    static void* const library = dlopen("libvulkan.so.1", RTLD_NOW | RTLD_LOCAL);
    return library;
}

}  // namespace

bool has_vulkan_loader() {
    return loader() != nullptr;
}

PFN_vkVoidFunction vulkan_function(const char* name) {
    return loader() ? reinterpret_cast<PFN_vkVoidFunction>(dlsym(loader(), name)) : nullptr;
}

}  // namespace ewa::python
