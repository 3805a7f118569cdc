// SPDX-License-Identifier: Apache-2.0
#include "mesh/mesh_files.h"

#include <spdlog/fmt/fmt.h>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <string>

#include "core/atomic_file.h"
#include "core/text.h"
#include "ewa/error.h"
#include "io/gltf/mesh.h"
#include "io/gltf/mesh_writer.h"

namespace ewa::mesh {
namespace {

using scene::TriangleMesh;

/// Collects what is written in pieces.
class Text {
  public:
    explicit Text(core::AtomicFile& file) : file_(file) {}
    template <class... Values>
    void add(fmt::format_string<Values...> format, Values&&... values) {
        fmt::format_to(std::back_inserter(text_), format, std::forward<Values>(values)...);
        if (text_.size() > kPiece) flush();
    }
    template <class Value>
    void add_bytes(const Value& value) {
        text_.append(reinterpret_cast<const char*>(&value), sizeof(value));
        if (text_.size() > kPiece) flush();
    }
    void flush() {
        file_.write(text_);
        text_.clear();
    }

  private:
    static constexpr size_t kPiece = 1 << 20;
    core::AtomicFile& file_;
    std::string text_;
};

std::string extension_of(const std::filesystem::path& path) {
    return core::lower(path.extension().string());
}

void write_ply(Text& out, const TriangleMesh& mesh) {
    constexpr double kFar = 1000;  // from here on, float32 rounds to more than 0.00003
    const bool far = glm::length(mesh.origin) > kFar;
    const char* type = far ? "double" : "float";
    out.add("ply\nformat binary_little_endian 1.0\ncomment ewa " EWA_VERSION "\nelement vertex {}\n",
            mesh.positions.size());
    out.add("property {0} x\nproperty {0} y\nproperty {0} z\n", type);
    out.add("property float nx\nproperty float ny\nproperty float nz\n");
    if (!mesh.colors.empty()) out.add("property uchar red\nproperty uchar green\nproperty uchar blue\n");
    out.add("element face {}\nproperty list uchar int vertex_indices\nend_header\n", mesh.triangles.size());
    for (size_t i = 0; i < mesh.positions.size(); ++i) {
        const glm::dvec3 world = mesh.origin + glm::dvec3(mesh.positions[i]);
        if (far)
            out.add_bytes(world);
        else
            out.add_bytes(glm::vec3(world));
        out.add_bytes(mesh.normals[i]);
        if (!mesh.colors.empty()) out.add_bytes(mesh.colors[i]);
    }
    for (const auto& t : mesh.triangles) {
        out.add_bytes(uint8_t(3));
        out.add_bytes(t);
    }
}

void write_obj(Text& out, const TriangleMesh& mesh, const glm::dquat& turn) {
    out.add("# ewa " EWA_VERSION ", {} {} {} {} {}\n", io::kTurnOfSplats, turn.x, turn.y, turn.z, turn.w);
    const glm::dmat3 turned = glm::mat3_cast(turn);
    for (size_t i = 0; i < mesh.positions.size(); ++i) {
        const glm::dvec3 p = turned * (mesh.origin + glm::dvec3(mesh.positions[i]));
        out.add("v {:.9g} {:.9g} {:.9g}", p.x, p.y, p.z);
        if (!mesh.colors.empty())
            for (const uint8_t c : mesh.colors[i]) out.add(" {:.4g}", c / 255.0);
        out.add("\n");
    }
    for (const glm::vec3& normal : mesh.normals) {
        const glm::dvec3 n = turned * glm::dvec3(normal);
        out.add("vn {:.4f} {:.4f} {:.4f}\n", n.x, n.y, n.z);
    }
    for (const auto& t : mesh.triangles)
        out.add("f {0}//{0} {1}//{1} {2}//{2}\n", t[0] + 1, t[1] + 1, t[2] + 1);
}

/// Turns an axis to y by the shortest way; -y about z, as in a .glb of splats.
glm::dquat turn_to_y(const glm::dvec3& up) {
    if (up.y < 0) return {0, 0, 0, 1};
    if (up.y > 0) return {1, 0, 0, 0};
    return glm::angleAxis(glm::half_pi<double>(), glm::cross(up, glm::dvec3(0, 1, 0)));
}

}  // namespace

void check_mesh_name(const std::filesystem::path& path) {
    const std::string extension = extension_of(path);
    if (extension != ".ply" && extension != ".obj" && extension != ".glb")
        throw InputError("-o " + core::one_line(path.string()) + ": a mesh is a .ply, .obj or .glb");
}

void save_mesh(const std::filesystem::path& path, const TriangleMesh& mesh, const glm::dvec3& up) {
    check_mesh_name(path);
    const std::string extension = extension_of(path);
    if (extension == ".glb") return io::write_glb_mesh(path, mesh, turn_to_y(up));
    core::AtomicFile file(path);
    Text out(file);
    if (extension == ".ply")
        write_ply(out, mesh);
    else
        write_obj(out, mesh, turn_to_y(up));
    out.flush();
    file.commit();
}

}  // namespace ewa::mesh
