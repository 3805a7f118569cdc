// SPDX-License-Identifier: Apache-2.0
// ewa compare of two meshes.
#pragma once
#include <filesystem>
#include <optional>

namespace ewa::cli {

struct MeshComparison {
    std::filesystem::path a, b, json;
    std::optional<double> distance;  // world units; empty: a part of B's size
};

/// Prints how far A is from B, the true surface, and writes it as JSON. Throws InputError.
void compare_meshes(const MeshComparison& comparison);

}  // namespace ewa::cli
