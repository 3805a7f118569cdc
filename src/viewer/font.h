// SPDX-License-Identifier: Apache-2.0
// The font of the panel: one of the vector fonts that most systems have.
#pragma once
#include <filesystem>
#include <vector>

namespace ewa::viewer {

/// The file of the first usual sans-serif font below the fonts folders of XDG_DATA_HOME and XDG_DATA_DIRS. Empty if
/// no such font exists. The window then uses Dear ImGui's bitmap font.
std::filesystem::path find_font();

/// The bytes of a TrueType or OpenType font. Empty if the file cannot be read, or is no such font.
std::vector<unsigned char> read_font(const std::filesystem::path& file);

}  // namespace ewa::viewer
