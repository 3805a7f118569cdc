// SPDX-License-Identifier: Apache-2.0
#include "io/meshes/mesh_files.h"

#include "core/text.h"
#include "ewa/error.h"
#include "io/gltf/mesh.h"
#include "io/meshes/faces.h"

namespace ewa::io {
namespace {

std::string mesh_extension(const std::filesystem::path& path) {
    return core::lower(path.extension().string());
}

}  // namespace

bool is_mesh(const std::filesystem::path& path) {
    const std::string extension = mesh_extension(path);
    if (extension == ".obj") return std::filesystem::is_regular_file(path);
    return extension == ".ply" ? is_ply_mesh(path) : is_gltf_mesh(path);
}

scene::MeshScene read_mesh(const std::filesystem::path& path) {
    const std::string extension = mesh_extension(path);
    if (extension == ".obj") return read_obj_mesh(path);
    return extension == ".ply" ? read_ply_mesh(path) : read_gltf_mesh_of_splats(path);
}

}  // namespace ewa::io
