// SPDX-License-Identifier: Apache-2.0
#include "core/plugin.h"
#include "core/system_limits.h"
#include "ewa/error.h"
#include "image/image_files.h"

namespace ewa::image {
namespace {

constexpr core::Plugin kPlugin{kModuleName, kModuleEntry,
                               "which reads and writes all image formats but PNG and JPEG",
                               core::Thing::openimageio, ", or convert the image to PNG"};

// Some of OpenImageIO's libraries start threads when they are loaded. Where they cannot, the process hangs or
// ends. With its threads it takes 300 MB of address space on two processors.
constexpr uint64_t kAddressSpace = 400u << 20;
constexpr int kThreads = 8;

/// Throws unless the module can be loaded with what the system still gives.
void check_room() {
    if (core::has_room(kAddressSpace, kThreads)) return;
    throw RunError(core::file_name(kPlugin) + " needs " + std::to_string(kAddressSpace >> 20) +
                   " MiB of address space and " + std::to_string(kThreads) +
                   " threads, more than the system gives; " + core::address_limit_text() +
                   "a higher limit (ulimit -a) helps, or an image in PNG");
}

const OpenImageIO& load() {
    const auto* module = static_cast<const OpenImageIO*>(core::load_plugin(kPlugin, check_room));
    if (!module->limit(kMaxDecodedBytes, kMaxChannels))
        core::cannot_load(kPlugin, "its OpenImageIO is older than 2.4 and cannot limit the size of images");
    return *module;
}

}  // namespace

const OpenImageIO& openimageio() {
    static const OpenImageIO& loaded = load();
    return loaded;
}

}  // namespace ewa::image
