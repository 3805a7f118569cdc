// SPDX-License-Identifier: Apache-2.0
// Settings that the window stores from one session to the next, in a file of the user.
#pragma once
#include <filesystem>
#include <optional>

#include "viewer/layout.h"

namespace ewa::viewer {

inline constexpr float kLeastText = 0.5f, kMostText = 3;  // limits of text_scale

struct KeptSettings {
    std::optional<Size> window;  // of the last session, logical px: of a screen with a content scale of 1
    float text_scale = 1;        // times the size that the monitor asks for
    float gain = 4;              // factor of the difference image
    float film_seconds = 2;      // from one key of a film to the next
    bool light = false;          // the light theme
    bool operator==(const KeptSettings&) const = default;
};

/// $XDG_CONFIG_HOME/ewa/view.json, else ~/.config/ewa/view.json. Empty if the environment names neither.
std::filesystem::path settings_file();

/// Never throws: an absent or damaged file gives the default settings. A value out of its range gets its default.
KeptSettings read_settings(const std::filesystem::path& file);
/// Never throws, because the window works without the file. Members of the file that this version does not know are lost.
void write_settings(const std::filesystem::path& file, const KeptSettings& settings);

}  // namespace ewa::viewer
