// SPDX-License-Identifier: Apache-2.0
// ewa compare of two meshes, or of a mesh and a scan.
#pragma once
#include <filesystem>
#include <optional>

namespace ewa::cli {

struct MeshComparison {
    std::filesystem::path a, b, json;
    std::optional<double> distance;  // threshold of the F-score, world units; empty: a share of B's size
};

/// Prints how far the mesh A is from B, the true surface, which may be a scan, and writes it as JSON. Throws InputError.
void compare_meshes(const MeshComparison& comparison);

}  // namespace ewa::cli
