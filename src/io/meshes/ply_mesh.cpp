// SPDX-License-Identifier: Apache-2.0
#include "ewa/error.h"
#include "io/meshes/faces.h"
#include "io/meshes/mesh_files.h"
#include "io/splats/ply_table.h"

namespace ewa::io {
namespace {

/// The list of a face's corners; programs use either name.
std::optional<size_t> corners_of(const PlyElement& face) {
    for (const char* name : {"vertex_indices", "vertex_index"})
        if (const auto found = face.find(name); found && face.properties[*found].list_count) return found;
    return std::nullopt;
}

}  // namespace

bool is_ply_mesh(const std::filesystem::path& path) try {
    const PlyTable table(path);
    for (const PlyElement& element : table.elements())
        if (element.name == "face") return element.count > 0 && corners_of(element).has_value();
    return false;
} catch (const InputError&) {
    return false;
}

scene::MeshScene read_ply_mesh(const std::filesystem::path& path) {
    PlyTable table(path);
    const PlyElement& vertex = table.go_to("vertex");
    std::vector<size_t> columns;
    for (const char* axis : {"x", "y", "z"}) {
        const auto found = vertex.find_number(axis);
        if (!found) table.fail("the element \"vertex\" has no property \"" + std::string(axis) + '"');
        columns.push_back(*found);
    }
    FaceCollector faces(table.file_bytes(), [&](const std::string& text) { table.fail(text); });
    table.read(columns, [&](size_t, const double* v) { faces.add_position({v[0], v[1], v[2]}); });
    const auto corners = corners_of(table.go_to("face"));
    if (!corners) table.fail("the element \"face\" has no list \"vertex_indices\"");
    table.read_lists(*corners, [&](std::span<const double> indices) { faces.add_face(indices); });
    return faces.take();
}

}  // namespace ewa::io
