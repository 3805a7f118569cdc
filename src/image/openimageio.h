// SPDX-License-Identifier: Apache-2.0
// OpenImageIO, for every format but PNG and JPEG. It stands behind a module that is loaded with the first
// such image: it brings some two hundred libraries, whose start takes longer than most commands, and a
// machine without it still has PNG and JPEG.
#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "image/codecs.h"

namespace ewa::image {

/// What the module exports under the name kModuleEntry. The functions may run on several threads at once.
/// They throw std::runtime_error with OpenImageIO's reason, without the file's name, and std::bad_alloc.
struct OpenImageIO {
    const char* version;  // EWA_VERSION; the loader reads it before it calls a function

    /// Makes OpenImageIO refuse larger images. False where it has no such limits.
    bool (*limit)(uint64_t decoded_bytes, uint64_t channels);
    /// Reads a file whose probe has passed, by OpenImageIO's reader of this name. Calls `check` before it
    /// takes memory for the pixels.
    StoredImage (*read)(const std::string& path, const std::string& reader, bool pixels,
                        const std::function<void(const ImageHeader&)>& check);
    /// The bytes of an EXR file of 32-bit floats.
    std::vector<unsigned char> (*encode_exr)(const Image& image);
};
constexpr const char* kModuleFile = "libewa_openimageio.so";
constexpr const char* kModuleEntry = "ewa_openimageio_module";

/// Loads the module at the first call, from its folder beside the program or libewa, and sets ewa's limits.
/// Throws RunError where there is no module, or it does not fit.
const OpenImageIO& openimageio();

}  // namespace ewa::image
