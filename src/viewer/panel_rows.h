// SPDX-License-Identifier: Apache-2.0
// What rows of the panel are made of.
#pragma once
#include <string>

namespace ewa::viewer {

/// Draws a label. The next item gets the rest of the line.
void label_field(const char* label);
/// Draws the heading of a section that folds. open: whether it is open at first. open_now: opens it. Returns whether it is open.
bool draw_section(const char* name, bool open, bool open_now = false);
/// The number of lines of text that wraps at the border of the window; not more than `most`.
int text_lines(const std::string& text, int most);
/// Draws text that wraps, in a box of `least` to `most` lines. It scrolls if it has more.
void draw_text_box(const char* name, const std::string& text, int least, int most);

}  // namespace ewa::viewer
