// SPDX-License-Identifier: Apache-2.0
// Controls of ImGui as the panel of edits has them: labels at the left or above, and full widths.
#pragma once
#include <glm/vec3.hpp>
#include <initializer_list>
#include <span>

#include "viewer/editor/texts.h"

namespace ewa::viewer {

namespace say = texts::edit_panel;

namespace ui {

using Text = texts::Item;

/// Shows the hint while the pointer is over the last item. The keys follow its first line, which is the brighter one.
void show_hint(const char* hint, const char* keys = "");
/// A section's header. Returns whether it is open. open_now: opens it.
bool section(const Text& text, bool open_at_first, bool open_now = false);
/// A label. The next item fills the rest of its line.
void label_left(const Text& text);
/// A label. The next item fills the line below.
void label_above(const Text& text);

enum class ButtonLook { plain, chosen, danger };
struct Button {
    Text text;
    bool enabled = true;
    ButtonLook look = ButtonLook::plain;
};
/// Buttons side by side over the rest of the line, of equal widths where their texts fit. Returns which one is clicked, or -1. gap: in ImGui's coordinates; below 0: the usual
/// one.
int button_line(std::span<const Button> buttons, float gap = -1);
int button_line(std::initializer_list<Button> buttons);
/// One of several, as buttons without gaps. Returns whether `chosen` has changed.
bool segments(std::span<const Text> names, int& chosen);

bool checkbox(const Text& text, bool& value);
/// A slider with its label at the left. The range bounds typed values too.
bool slider(const Text& text, float& value, float low, float high, const char* format,
            bool logarithmic = false);
/// Three numbers below their label.
bool numbers(const Text& text, glm::dvec3& values);
/// A number with its label at the left.
bool number(const Text& text, double& value);
/// Whether the last item is left by Enter.
bool entered();

}  // namespace ui

}  // namespace ewa::viewer
