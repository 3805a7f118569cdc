// SPDX-License-Identifier: Apache-2.0
#include "io/gltf/mesh_writer.h"

#include <algorithm>
#include <array>
#include <glm/common.hpp>
#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/atomic_file.h"
#include "ewa/error.h"
#include "io/gltf/document.h"
#include "io/gltf/glb_file.h"
#include "io/gltf/mesh.h"
#include "scene/color.h"

namespace ewa::io {
namespace {

using MeshJson = nlohmann::ordered_json;
using LinearColor = std::array<uint16_t, 4>;  // alpha last: elements begin at multiples of 4 bytes

std::vector<LinearColor> linear_colors(const scene::TriangleMesh& mesh) {
    constexpr double kWhite = 65535;
    std::vector<LinearColor> colors;
    for (const auto& color : mesh.colors) {
        LinearColor& linear = colors.emplace_back();
        for (size_t c = 0; c < 3; ++c)
            linear[c] = uint16_t(scene::linear_of_srgb(color[c] / 255.0) * kWhite + 0.5);
        linear[3] = uint16_t(kWhite);
    }
    return colors;
}

/// The parts of the buffer, one after another.
struct BufferLayout {
    MeshJson views = MeshJson::array(), accessors = MeshJson::array();
    uint64_t bytes = 0;

    /// Returns the accessor's index.
    size_t add(uint64_t count, uint64_t element_bytes, int component, const char* type, int target) {
        views.push_back({{"buffer", 0},
                         {"byteOffset", bytes},
                         {"byteLength", count * element_bytes},
                         {"target", target}});
        accessors.push_back({{"bufferView", views.size() - 1},
                             {"componentType", component},
                             {"count", count},
                             {"type", type}});
        bytes += count * element_bytes;
        return accessors.size() - 1;
    }
};

MeshJson structure_of(const scene::TriangleMesh& mesh, const glm::dquat& turn, BufferLayout& layout) {
    const size_t vertices = mesh.positions.size();
    MeshJson attributes = MeshJson::object();
    attributes["POSITION"] =
        layout.add(vertices, 12, TINYGLTF_COMPONENT_TYPE_FLOAT, "VEC3", TINYGLTF_TARGET_ARRAY_BUFFER);
    glm::vec3 low(std::numeric_limits<float>::infinity()), high(-low);
    for (const glm::vec3& p : mesh.positions) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    layout.accessors[0]["min"] = {low.x, low.y, low.z};
    layout.accessors[0]["max"] = {high.x, high.y, high.z};
    if (!mesh.normals.empty())
        attributes["NORMAL"] =
            layout.add(vertices, 12, TINYGLTF_COMPONENT_TYPE_FLOAT, "VEC3", TINYGLTF_TARGET_ARRAY_BUFFER);
    if (!mesh.colors.empty()) {
        attributes["COLOR_0"] = layout.add(vertices, 8, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT, "VEC4",
                                           TINYGLTF_TARGET_ARRAY_BUFFER);
        layout.accessors.back()["normalized"] = true;
    }
    const size_t indices = layout.add(3 * mesh.triangles.size(), 4, TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT,
                                      "SCALAR", TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER);
    const MeshJson primitive = {{"attributes", attributes}, {"indices", indices}, {"material", 0}};
    const MeshJson material = {{"pbrMetallicRoughness", {{"metallicFactor", 0.0}, {"roughnessFactor", 1.0}}},
                               {"doubleSided", true},
                               {"extensions", {{"KHR_materials_unlit", MeshJson::object()}}}};
    const glm::dvec3 origin = turn * mesh.origin;
    const MeshJson rotation = {turn.x, turn.y, turn.z, turn.w};
    return {
        {"asset",
         {{"version", "2.0"}, {"generator", "ewa " EWA_VERSION}, {"extras", {{kTurnOfSplats, rotation}}}}},
        {"extensionsUsed", {"KHR_materials_unlit"}},
        {"scene", 0},
        {"scenes", {{{"nodes", {0}}}}},
        {"nodes", {{{"mesh", 0}, {"rotation", rotation}, {"translation", {origin.x, origin.y, origin.z}}}}},
        {"meshes", {{{"primitives", {primitive}}}}},
        {"materials", {material}},
        {"accessors", layout.accessors},
        {"bufferViews", layout.views},
        {"buffers", {{{"byteLength", layout.bytes}}}}};
}

template <class Element>
void write_array(core::AtomicFile& file, const std::vector<Element>& values) {
    if (!values.empty()) file.write(values.data(), values.size() * sizeof(Element));
}

}  // namespace

void write_glb_mesh(const std::filesystem::path& path, const scene::TriangleMesh& mesh,
                    const glm::dquat& turn) {
    BufferLayout layout;
    const std::string text = structure_of(mesh, turn, layout).dump();
    write_glb(path, text, layout.bytes, "write a .ply, or fewer triangles", [&](core::AtomicFile& file) {
        write_array(file, mesh.positions);
        write_array(file, mesh.normals);
        write_array(file, linear_colors(mesh));
        write_array(file, mesh.triangles);
    });
}

}  // namespace ewa::io
