// SPDX-License-Identifier: Apache-2.0
// Edits of a splat scene. A table has a row for each edit, which ewa convert and Python share.
#pragma once
#include <cstdint>
#include <glm/mat4x4.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "edit/filters.h"

namespace ewa::edit {

class EditedSplats;

/// A parsed edit. Exactly one of `filter`, `place`, `change` and `act` is set.
struct Edit {
    std::string text;  // such as "--where opacity=0.1.."
    Filter filter = {};
    /// Transforms the scene. before: the matrix of the place edits directly before this one, which is not applied yet. Returns the
    /// matrix of all of them, this one included. May add a line for the user to `remarks`.
    std::function<glm::dmat4(const glm::dmat4& before, std::vector<std::string>& remarks)> place = {};
    /// Merges, reduces or sorts splats.
    std::function<void(Gaussians&)> change = {};
    /// Selects splats, or changes the selected ones.
    std::function<void(EditedSplats&)> act = {};
    bool all = false;  // it moves all splats, also those that are not selected, locked or hidden
};

struct Row {
    const char* name;   // "where" of --where
    const char* value;  // the edit's value, for the help; empty: no value
    const char* help;
    Edit (*parse)(const std::string& value);  // throws InputError that begins with --name
    const char* brief = "";  // text of the short help; empty: only the whole help has the edit
};

/// A value of --transform that begins with it moves all splats.
inline constexpr std::string_view kAllSplats = "all:";

std::span<const Row> rows();

/// The edit of this name, without dashes. Throws InputError for a value that cannot be read.
Edit parse(std::string_view name, const std::string& value = "");

/// Whether the edit of this name selects, deletes, locks or hides splats, and changes no others.
bool changes_states(std::string_view name);

/// Performs an edit with `act` or `place`. A place edit moves the selected splats, or all of them (Edit::all). Throws InputError, and has changed nothing then.
void perform_on(EditedSplats& splats, const Edit& edit);

struct Outcome {
    std::string text;      // Edit::text
    bool removes;          // splats; else it merged or copied some
    size_t before, after;  // splats
};

struct Applied {
    std::vector<Outcome> outcomes;      // of filters, and of edits that have changed the number of splats
    std::vector<std::string> remarks;   // of place edits
    std::vector<std::string> warnings;  // of edits that change nothing, as no splat is selected
    bool moved = false;
    std::vector<uint32_t>
        left;  // indices of the first splats that are kept; only if no edit merges or sorts splats
};

/// Applies the edits in order. Consecutive place edits transform the scene once. After --select, edits with `act` and place edits
/// change the selected splats alone (but for Edit::all), each by itself, until a filter or a change ends the selection. cameras: those of the splats' run,
/// in the world before any edit. Throws InputError that names the edit.
Applied apply(Gaussians& gaussians, std::span<const Edit> edits, const Cameras& cameras = {});

}  // namespace ewa::edit
