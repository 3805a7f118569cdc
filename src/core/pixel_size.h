// SPDX-License-Identifier: Apache-2.0
// The size of an image, as a command line names it.
#pragma once
#include <optional>
#include <string_view>

#include "core/text.h"

namespace ewa::core {

struct PixelSize {
    int width = 0, height = 0;
};

/// "1280x720": two whole numbers of 1 to `largest`. Empty for other text.
inline std::optional<PixelSize> parse_size(std::string_view text, int largest) {
    const size_t cross = text.find('x');
    if (cross == std::string_view::npos) return std::nullopt;
    const PixelSize size{parse_integer<int>(text.substr(0, cross)).value_or(0),
                         parse_integer<int>(text.substr(cross + 1)).value_or(0)};
    if (size.width < 1 || size.height < 1 || size.width > largest || size.height > largest)
        return std::nullopt;
    return size;
}

}  // namespace ewa::core
