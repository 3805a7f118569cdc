// SPDX-License-Identifier: Apache-2.0
#include "image/decode.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <string_view>

#include "core/folders.h"
#include "core/text.h"
#include "ewa/error.h"

namespace ewa::image {

namespace {

const char* extension_of(const std::vector<unsigned char>& bytes) {
    const auto begins = [&](std::string_view signature) {
        return bytes.size() >= signature.size() &&
               std::memcmp(bytes.data(), signature.data(), signature.size()) == 0;
    };
    return begins("\x89PNG\r\n\x1a\n") ? ".png" : begins("\xff\xd8\xff") ? ".jpg" : nullptr;
}

}  // namespace

Image decode(const std::vector<unsigned char>& bytes, const std::string& what, int largest) {
    const char* extension = extension_of(bytes);
    if (!extension) throw InputError(core::one_line(what + ": is neither PNG nor JPEG"));
    // Through a file, so that it is looked at as closely as a photograph is.
    const core::TemporaryFolder folder("ewa-image-");
    const std::filesystem::path path = folder.path() / (std::string("image") + extension);
    // Not by AtomicFile: nothing of it is kept, and a disk is slow to say that it has everything.
    std::ofstream file(path, std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
    file.close();
    if (const int reason = errno; !file)
        throw RunError(path.string() + ": cannot be written: " + std::strerror(reason));
    try {
        const ImageSize size = read_image_size(path);
        if (size.width > largest || size.height > largest)
            throw InputError(path.string() + ": has " + std::to_string(size.width) + " x " +
                             std::to_string(size.height) + " pixels, more than " + std::to_string(largest) +
                             " in a direction");
        return load_image(path);
    } catch (const InputError& error) {
        std::string text = error.what();
        if (text.starts_with(path.string())) text.erase(0, path.string().size());
        throw InputError(core::one_line(what + text));
    }
}

}  // namespace ewa::image
