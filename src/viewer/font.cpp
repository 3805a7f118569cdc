// SPDX-License-Identifier: Apache-2.0
#include "viewer/font.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>

#include "core/folders.h"
#include "platform/folders.h"

namespace ewa::viewer {
namespace {

namespace fs = std::filesystem;

constexpr uintmax_t kMostFontBytes = 32u << 20;

/// Below a folder of fonts. Debian's, Arch's, Fedora's and Windows' places.
constexpr std::array kFonts{"truetype/dejavu/DejaVuSans.ttf",
                            "TTF/DejaVuSans.ttf",
                            "dejavu-sans-fonts/DejaVuSans.ttf",
                            "dejavu/DejaVuSans.ttf",
                            "truetype/noto/NotoSans-Regular.ttf",
                            "noto/NotoSans-Regular.ttf",
                            "truetype/liberation/LiberationSans-Regular.ttf",
                            "truetype/liberation2/LiberationSans-Regular.ttf",
                            "liberation/LiberationSans-Regular.ttf",
                            "liberation-sans/LiberationSans-Regular.ttf",
                            "truetype/freefont/FreeSans.ttf",
                            "truetype/ubuntu/Ubuntu-R.ttf",
                            "segoeui.ttf",
                            "arial.ttf"};

}  // namespace

fs::path find_font() {
    for (const fs::path& folder : platform::font_folders())
        for (const char* font : kFonts)
            if (const fs::path file = folder / font; file.is_absolute() && core::is_file(file)) return file;
    return {};
}

std::vector<unsigned char> read_font(const fs::path& file) {
    std::error_code error;
    const uintmax_t size = fs::file_size(file, error);
    if (error || size < 12 || size > kMostFontBytes) return {};
    std::ifstream stream(file, std::ios::binary);
    std::vector<unsigned char> bytes{std::istreambuf_iterator<char>(stream), {}};
    const auto begins = [&](const std::array<unsigned char, 4>& tag) {
        return bytes.size() == size && std::equal(tag.begin(), tag.end(), bytes.begin());
    };
    const bool font = begins({0, 1, 0, 0}) || begins({'t', 'r', 'u', 'e'}) || begins({'O', 'T', 'T', 'O'});
    return font ? bytes : std::vector<unsigned char>();
}

}  // namespace ewa::viewer
