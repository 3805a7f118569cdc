// SPDX-License-Identifier: Apache-2.0
// Wavefront OBJ: "v x y z" is a vertex and "f a b c" a face of corners such as 7, 7/2, 7//3 or 7/2/3. The first number counts
// vertices from 1, or from the last one backwards if it is negative. A backslash continues a line. A comment of ewa mesh has the turn that
// the reader undoes. Other lines say nothing of the shape.
// tinyobjloader takes a number that it cannot read for 0.
#include "core/file_reader.h"
#include "core/text.h"
#include "io/gltf/mesh.h"
#include "io/meshes/faces.h"
#include "io/meshes/mesh_files.h"

namespace ewa::io {
namespace {

constexpr size_t kMostLine = size_t(1) << 20;

/// A line with those that continue it. False at the end of the file.
bool read_joined_line(core::FileReader& reader, std::string& line) {
    if (!reader.read_line(line, kMostLine)) return false;
    std::string more;
    while (line.ends_with('\\') && reader.read_line(more, kMostLine - line.size())) {
        line.back() = ' ';
        line += more;
    }
    return true;
}

std::string shown_obj_word(std::string_view word) {
    constexpr size_t kShown = 60;
    return '"' + std::string(word.substr(0, kShown)) + '"';
}

glm::dvec3 position_of(const core::FileReader& reader, std::string_view rest) {
    glm::dvec3 position(0);
    for (int axis = 0; axis < 3; ++axis) {
        const std::string_view word = core::next_word(rest);
        const std::optional<double> value = core::parse_number(word);
        if (!value) reader.fail("a vertex needs three numbers, not " + shown_obj_word(word));
        position[axis] = *value;
    }
    return position;
}

/// The turn that the comment names, if it does.
void find_turn(std::string_view comment, glm::dmat3& undone) {
    const size_t at = comment.find(kTurnOfSplats);
    if (at == std::string_view::npos) return;
    std::string_view rest = comment.substr(at + std::string_view(kTurnOfSplats).size());
    glm::dvec4 q(0);
    for (int i = 0; i < 4; ++i) q[i] = core::parse_number(core::next_word(rest)).value_or(0);
    undone = undone_turn(glm::dquat(q.w, q.x, q.y, q.z));
}

/// The index from 0 of a face's corner.
double corner_of(const core::FileReader& reader, std::string_view word, size_t positions) {
    const auto number = core::parse_integer<int64_t>(word.substr(0, word.find('/')));
    if (!number || *number == 0) reader.fail("a face has the corner " + shown_obj_word(word));
    return *number > 0 ? double(*number) - 1 : double(positions) + double(*number);
}

}  // namespace

scene::MeshScene read_obj_mesh(const std::filesystem::path& path) {
    core::FileReader reader(path);
    FaceCollector faces(reader.size(), [&](const std::string& text) { reader.fail(text); });
    std::vector<double> corners;
    glm::dmat3 undone(1);
    for (std::string line; read_joined_line(reader, line);) {
        std::string_view rest = line;
        const std::string_view keyword = core::next_word(rest);
        if (keyword == "v") {
            faces.add_position(undone * position_of(reader, rest));
        } else if (keyword == "#") {
            find_turn(rest, undone);
        } else if (keyword == "f") {
            corners.clear();
            for (std::string_view word = core::next_word(rest); !word.empty(); word = core::next_word(rest))
                corners.push_back(corner_of(reader, word, faces.positions()));
            faces.add_face(corners);
        }
    }
    return faces.take();
}

}  // namespace ewa::io
