// SPDX-License-Identifier: Apache-2.0
// Edits of a whole scene: one row of a table each. ewa convert and Python use the same rows.
#pragma once
#include <cstdint>
#include <glm/mat4x4.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "edit/filters.h"

namespace ewa::edit {

/// An edit as it was typed. One of the functions is set.
struct Edit {
    std::string text;  // such as "--where opacity=0.1.."
    Filter filter = {};
    /// Moves the scene. before: what the steps right before it do, which is not applied yet. Returns the matrix of all of them.
    /// Adds a line on what was found, if there is one.
    std::function<glm::dmat4(const glm::dmat4& before, std::vector<std::string>& remarks)> place = {};
    /// Merges, reduces or sorts splats.
    std::function<void(Gaussians&)> change = {};
};

struct Row {
    const char* name;   // "where" of --where
    const char* value;  // what it takes, for the help. Empty: nothing
    const char* help;
    Edit (*parse)(const std::string& value);  // throws InputError that begins with --name
    const char* brief = "";                   // in the short help; empty: only the whole help has it
};

std::span<const Row> rows();

/// The edit of this name, without dashes. Throws InputError for a value that cannot be read.
Edit parse(std::string_view name, const std::string& value = "");

struct Outcome {
    std::string text;      // of the edit
    bool removes;          // it is a filter; else it merged splats
    size_t before, after;  // splats
};

struct Applied {
    std::vector<Outcome> outcomes;  // of filters, and of other edits that have changed the number of splats
    std::vector<std::string> remarks;  // of steps
    bool moved = false;
    std::vector<uint32_t>
        left;  // indices of the splats that filters have kept; only if no edit merges or sorts splats
};

/// Applies the edits in order. Steps that follow one another move the scene once. cameras: of the run, whose splats have not moved.
/// Throws InputError that names the edit.
Applied apply(Gaussians& gaussians, std::span<const Edit> edits, const Cameras& cameras = {});

}  // namespace ewa::edit
