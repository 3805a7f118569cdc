// SPDX-License-Identifier: Apache-2.0
// The size of an image, as a command line names it.
#pragma once
#include <optional>
#include <string_view>
#include <utility>

#include "core/text.h"

namespace ewa::core {

struct PixelSize {
    int width = 0, height = 0;
};

/// "1280x720": two whole numbers of 1 to `largest`. Or the name of a size of screens: 720p, 1080p, 1440p, 4k, 8k. Empty for other text.
inline std::optional<PixelSize> parse_size(std::string_view text, int largest) {
    constexpr std::pair<std::string_view, int> kHeights[] = {{"720p", 720}, {"1080p", 1080}, {"1440p", 1440},
                                                             {"4k", 2160},  {"8k", 4320},    {"4K", 2160},
                                                             {"8K", 4320}};
    for (const auto& [name, height] : kHeights)
        if (text == name && height / 9 * 16 <= largest) return PixelSize{height / 9 * 16, height};
    const size_t cross = text.find('x');
    if (cross == std::string_view::npos) return std::nullopt;
    const PixelSize size{parse_integer<int>(text.substr(0, cross)).value_or(0),
                         parse_integer<int>(text.substr(cross + 1)).value_or(0)};
    if (size.width < 1 || size.height < 1 || size.width > largest || size.height > largest)
        return std::nullopt;
    return size;
}

}  // namespace ewa::core
