// SPDX-License-Identifier: Apache-2.0
// The window's colours and spacing: a calm dark and a light theme with one accent.
#pragma once

namespace ewa::viewer {

/// Sets ImGui's style, unscaled. Call ImGuiStyle::ScaleAllSizes after it.
void set_theme(bool light);

/// The accent as ImU32, of this opacity.
unsigned accent(float opacity = 1);
/// Text on the accent, as ImU32.
unsigned on_accent();
/// The colour behind the scene where it is empty, as ImU32.
unsigned backdrop();

}  // namespace ewa::viewer
