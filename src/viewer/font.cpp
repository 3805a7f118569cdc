// SPDX-License-Identifier: Apache-2.0
#include "viewer/font.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>

#include "core/folders.h"

namespace ewa::viewer {
namespace {

namespace fs = std::filesystem;

constexpr uintmax_t kMostFontBytes = 32u << 20;

/// Below a folder of fonts. Debian's, Arch's and Fedora's places.
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
                            "truetype/ubuntu/Ubuntu-R.ttf"};

std::string variable(const char* name, const std::string& otherwise) {
    const char* value = std::getenv(name);
    return value && *value ? value : otherwise;
}

}  // namespace

fs::path find_font() {
    std::istringstream folders(variable("XDG_DATA_HOME", variable("HOME", "") + "/.local/share") + ":" +
                               variable("XDG_DATA_DIRS", "/usr/local/share:/usr/share"));
    for (std::string folder; std::getline(folders, folder, ':');)
        for (const char* font : kFonts)
            if (const fs::path file = fs::path(folder) / "fonts" / font;
                file.is_absolute() && core::is_file(file))
                return file;
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
