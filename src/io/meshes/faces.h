// SPDX-License-Identifier: Apache-2.0
// Makes triangles of the vertices and faces that a file lists.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <vector>

#include "scene/mesh_scene.h"

namespace ewa::io {

/// Whether the header of a PLY declares faces. False for anything else.
bool is_ply_mesh(const std::filesystem::path& path);

class FaceCollector {
  public:
    /// fail: throws InputError with this text and the place in the file.
    FaceCollector(uint64_t file_bytes, std::function<void(const std::string&)> fail)
        : file_bytes_(file_bytes), fail_(std::move(fail)) {}

    void add_position(const glm::dvec3& position) { positions_.push_back(position); }
    size_t positions() const { return positions_.size(); }

    /// Adds a face as a fan of triangles around its first corner. indices: into the positions added so far, from 0; others fail.
    void add_face(std::span<const double> indices);

    /// Returns the triangles, with one plain material. Fails if there are none.
    scene::MeshScene take();

  private:
    void add_triangle(size_t a, size_t b, size_t c);

    uint64_t file_bytes_;
    std::function<void(const std::string&)> fail_;
    std::vector<glm::dvec3> positions_;
    scene::MeshScene scene_;
};

}  // namespace ewa::io
