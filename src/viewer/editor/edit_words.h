// SPDX-License-Identifier: Apache-2.0
// The words of the edits that the panel asks for, from what its controls show. Independent of the window.
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "edit/history.h"
#include "viewer/editor/edit_settings.h"
#include "viewer/editor/edit_snapshot.h"

namespace ewa::viewer {

/// The title of a step of this --select, such as "Add by sphere".
std::string selection_title(std::string_view shape);

/// What has been done, undone or redone between two snapshots of a scene, such as "Undone: Delete, 7,163 splats, 12 ms". Empty:
/// nothing that is known.
std::string edit_news(const EditSnapshot& before, const EditSnapshot& now);

/// The text in lines of at most so many letters, which end behind spaces, commas and semicolons. A longer word has a line alone.
std::string broken_lines(std::string_view text, size_t most);

/// "1,234 splats (0.12 %)": so many of all.
std::string part_text(size_t count, size_t of);

/// Whether `keys`, as in "Ctrl+D or Ctrl+Shift+A", has this key, a number of GLFW, with these modifiers. Shift is free with = and -.
bool has_key(std::string_view keys, int key, bool shift, bool control);

/// The value of --adjust. Members without effect are skipped; empty if none has one.
std::string adjustment_text(const edit::Adjustment& adjustment);

/// Edits that make splats with the adjustment `from` those with the adjustment `to`: none, one or two. All factors must be above
/// zero. An opacity that `from` has limited to 1 stays lower.
std::vector<edit::Words> adjustment_edits(const edit::Adjustment& from, const edit::Adjustment& to);

/// Turns about x, then y, then z, and a scale, all about a point, which then moves.
struct Placement {
    glm::dvec3 position{0};  // where the point goes to, world
    glm::dvec3 degrees{0};
    double scale = 1;
    bool operator==(const Placement&) const = default;
};
/// The value of --transform; empty: nothing moves. about: the point, world.
std::string placement_text(const glm::dvec3& about, const Placement& placement);

/// Sets the box or the sphere from "box=x,y,z,X,Y,Z" or "sphere=x,y,z,R". Returns whether the text is one of these.
bool paste_shape(const std::string& text, EditSettings& settings);

}  // namespace ewa::viewer
