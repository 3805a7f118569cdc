// SPDX-License-Identifier: Apache-2.0
#include "io/gltf/mesh.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>
#include <map>

#include "ewa/error.h"
#include "io/gltf/document.h"

namespace ewa::io {

namespace {

constexpr int kMostPlacedMeshes = 65536;
constexpr size_t kMostNamed = 32;  // unknown extensions in remarks
constexpr uint64_t kExpansion = 16, kAlways = uint64_t(20) << 20;

bool is_triangles(const tinygltf::Primitive& primitive) {
    return primitive.mode == -1 || primitive.mode == TINYGLTF_MODE_TRIANGLES ||
           primitive.mode == TINYGLTF_MODE_TRIANGLE_STRIP || primitive.mode == TINYGLTF_MODE_TRIANGLE_FAN;
}

using Vectors = std::vector<glm::dvec4>;

/// The accessors' values of a primitive.
struct Source {
    const Vectors *positions = nullptr, *normals = nullptr, *uvs = nullptr, *colors = nullptr;
    std::vector<uint32_t> indices;  // three a triangle
    uint32_t material = 0;
};

class MeshReader {
  public:
    explicit MeshReader(const GltfDocument& document) : document_(document), model_(document.model()) {}

    scene::MeshScene read(const glm::dmat4& world = glm::dmat4(1.0)) {
        check_extensions();
        read_materials(document_, scene_, texture_sets_);
        visit_nodes(document_, world, [&](int index, const glm::dmat4& matrix) {
            const tinygltf::Node& node = model_.nodes[size_t(index)];
            where_ = "node " + std::to_string(index);
            if (node.mesh >= 0) add_mesh(node.mesh, matrix);
            if (node.camera >= 0) add_camera(document_, index, matrix, scene_);
            add_light(document_, index, matrix, scene_);
            if (node.skin >= 0) remark(scene_, "skins are skipped: the pose is the one the file stores");
        });
        if (scene_.triangles.empty()) refuse_empty();
        scene_.sky = read_sky(document_);
        return std::move(scene_);
    }

  private:
    void check_extensions() {
        size_t named = 0;
        for (const std::string& name : model_.extensionsUsed)
            if (!reads_extension(name, GltfContent::meshes) && name != kSplatExtension &&
                ++named <= kMostNamed)
                remark(scene_, name.substr(0, 100) + " is skipped");
        if (document_.animated())
            remark(scene_, "animations are skipped: the pose is the one the file stores");
    }

    [[noreturn]] void refuse_empty() const {
        if (splats_)
            document_.fail("the scene's nodes reach splats (" + kSplatExtension +
                           ") and no \"mesh\" of triangles to render");
        if (scene_.dropped_triangles > 0)
            document_.fail("none of the \"mesh\"es has a triangle whose corners are all finite");
        document_.fail("the scene's nodes reach no \"mesh\" of triangles to render");
    }

    void add_mesh(int index, const glm::dmat4& matrix) {
        const tinygltf::Mesh& mesh = document_.mesh(index, where_);
        for (size_t i = 0; i < mesh.primitives.size(); ++i) {
            const tinygltf::Primitive& primitive = mesh.primitives[i];
            if (++placed_ > kMostPlacedMeshes)
                document_.fail(where_ + ": more than " + std::to_string(kMostPlacedMeshes) +
                               " primitives are placed in the scene");
            if (!is_triangles(primitive)) {
                splats_ = splats_ || primitive.extensions.count(kSplatExtension) > 0;
                remark(scene_, "points, lines and splats are skipped");
                continue;
            }
            where_primitive_ = "mesh " + std::to_string(index) + ", primitive " + std::to_string(i);
            if (!primitive.targets.empty()) remark(scene_, "morph targets are skipped");
            place(source_of(primitive), matrix);
        }
    }

    /// The cached vectors of an attribute's accessor. Null if the primitive lacks the attribute.
    const Vectors* attribute(const tinygltf::Primitive& primitive, const std::string& name,
                             std::initializer_list<int> types, size_t count) {
        const auto* accessor = document_.attribute(primitive, name, types, count, where_primitive_);
        if (!accessor) return nullptr;
        const auto [entry, fresh] = vectors_.try_emplace(accessor, accessor->count);
        if (fresh)
            document_.read(
                *accessor, where_primitive_ + ", attribute " + name,
                [&values = entry->second, accessor](size_t i, const double* v) {
                    values[i] = {v[0], v[1], v[2], accessor->type == TINYGLTF_TYPE_VEC4 ? v[3] : 1.0};
                });
        return &entry->second;
    }

    Source source_of(const tinygltf::Primitive& primitive) {
        Source source;
        source.positions = attribute(primitive, "POSITION", {TINYGLTF_TYPE_VEC3}, 0);
        if (!source.positions) document_.fail(where_primitive_ + ", attribute POSITION: is missing");
        const size_t count = source.positions->size();
        const int material = primitive.material;
        if (material >= int(model_.materials.size()))
            document_.fail(where_primitive_ + ": \"material\" " + std::to_string(material) +
                           ": there is none of this number");
        source.material = uint32_t(material < 0 ? model_.materials.size() : size_t(material));
        source.normals = attribute(primitive, "NORMAL", {TINYGLTF_TYPE_VEC3}, count);
        source.uvs = attribute(primitive, "TEXCOORD_" + std::to_string(texture_sets_[source.material]),
                               {TINYGLTF_TYPE_VEC2}, count);
        source.colors = attribute(primitive, "COLOR_0", {TINYGLTF_TYPE_VEC3, TINYGLTF_TYPE_VEC4}, count);
        source.indices = triangles_of(primitive.mode, corners(primitive, count));
        return source;
    }

    /// The vertices in drawing order.
    std::vector<uint32_t> corners(const tinygltf::Primitive& primitive, size_t count) const {
        std::vector<uint32_t> list;
        if (primitive.indices < 0) {
            require_room(count);
            list.resize(count);
            for (size_t i = 0; i < count; ++i) list[i] = uint32_t(i);
            return list;
        }
        const std::string what = where_primitive_ + ", indices";
        const tinygltf::Accessor& accessor = document_.accessor(primitive.indices, what, true);
        if (accessor.type != TINYGLTF_TYPE_SCALAR || accessor.normalized ||
            (accessor.componentType != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE &&
             accessor.componentType != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT &&
             accessor.componentType != TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT))
            document_.fail(what + ": accessor " + std::to_string(primitive.indices) +
                           ": \"componentType\" is wrong for indices");
        require_room(accessor.count);
        list.resize(accessor.count);
        document_.read(accessor, what, [&](size_t i, const double* v) {
            if (!(v[0] < double(count)))
                document_.fail(what + ": index " + std::to_string(i) + " is \"" +
                               std::to_string(uint64_t(v[0])) + "\", but there are " + std::to_string(count) +
                               " positions");
            list[i] = uint32_t(v[0]);
        });
        return list;
    }

    static std::vector<uint32_t> triangles_of(int mode, std::vector<uint32_t> corners) {
        if (mode != TINYGLTF_MODE_TRIANGLE_STRIP && mode != TINYGLTF_MODE_TRIANGLE_FAN) {
            corners.resize(corners.size() / 3 * 3);
            return corners;
        }
        const bool strip = mode == TINYGLTF_MODE_TRIANGLE_STRIP;
        std::vector<uint32_t> list;
        for (size_t i = 2; i < corners.size(); ++i) {
            const size_t odd = strip ? i % 2 : 0, first = strip ? i - 2 : 0;
            list.insert(list.end(), {corners[first], corners[i - 1 + odd], corners[i - odd]});
        }
        return list;
    }

    /// Both throw before the scene exceeds its limits.
    void require_room(size_t corners) const {
        if (corners > 3 * scene::kMostTriangles + 3)
            document_.fail(where_primitive_ + ": claims " + std::to_string(corners) +
                           " corners, more than \"" + std::to_string(scene::kMostTriangles) +
                           "\" triangles have");
    }
    void require_triangles(size_t more) const {
        const uint64_t all = scene_.triangles.size() + scene_.dropped_triangles + more;
        if (all > scene::kMostTriangles)
            document_.fail(where_ + ": the scene claims more than " + std::to_string(scene::kMostTriangles) +
                           " triangles");
        if (all * sizeof(scene::Triangle) > kExpansion * document_.bytes() + kAlways)
            document_.fail(where_ + ": the scene claims " + std::to_string(all) +
                           " triangles, which take more than " + std::to_string(kExpansion) +
                           " times the file and 20 MiB; its instances are too many");
    }

    void place(const Source& source, const glm::dmat4& matrix) {
        const size_t count = source.indices.size() / 3;
        require_triangles(count);
        const glm::dmat3 linear(matrix);
        const bool mirrored = glm::determinant(linear) < 0;
        // The cofactors transform normals, and exist even if the matrix has no inverse.
        const glm::dmat3 cofactors(glm::cross(linear[1], linear[2]), glm::cross(linear[2], linear[0]),
                                   glm::cross(linear[0], linear[1]));
        for (size_t i = 0; i < count; ++i) {
            scene::Triangle t;
            t.material = source.material;
            bool finite = true;
            for (size_t k = 0; k < 3; ++k) {
                const size_t corner = mirrored ? 2 - k : k;
                const uint32_t vertex = source.indices[3 * i + k];
                t.corners[corner] =
                    glm::dvec3(matrix * glm::dvec4(glm::dvec3((*source.positions)[vertex]), 1.0));
                for (int axis = 0; axis < 3; ++axis)
                    finite = finite && std::isfinite(float(t.corners[corner][axis]));
                if (source.normals)
                    t.normals[corner] = scene::pack_normal(cofactors * glm::dvec3((*source.normals)[vertex]) *
                                                           (mirrored ? -1.0 : 1.0));
                if (source.uvs)
                    for (int axis = 0; axis < 2; ++axis)
                        if (const float v = float((*source.uvs)[vertex][axis]); std::isfinite(v))
                            t.uvs[corner][axis] = v;
                if (source.colors) t.colors[corner] = packed_color((*source.colors)[vertex]);
            }
            if (finite)
                scene_.triangles.push_back(t);
            else
                ++scene_.dropped_triangles;
        }
    }

    static uint32_t packed_color(const glm::dvec4& color) {
        uint32_t bits = 0;
        for (int i = 0; i < 4; ++i)
            bits |= uint32_t(std::lround(color[i] > 0 ? std::min(color[i], 1.0) * 255 : 0.0)) << (8 * i);
        return bits;
    }

    const GltfDocument& document_;
    const tinygltf::Model& model_;
    scene::MeshScene scene_;
    std::vector<int> texture_sets_;
    std::map<const tinygltf::Accessor*, Vectors> vectors_;
    std::string where_, where_primitive_;
    int placed_ = 0;
    bool splats_ = false;
};

}  // namespace

scene::MeshScene read_gltf_mesh(const std::filesystem::path& path) {
    const GltfDocument document(path, GltfContent::meshes);
    return MeshReader(document).read();
}

scene::MeshScene read_gltf_mesh_of_splats(const std::filesystem::path& path) {
    const GltfDocument document(path, GltfContent::meshes);
    const tinygltf::Value& extras = document.model().asset.extras;
    glm::dquat turn(1, 0, 0, 0);
    if (extras.IsObject() && extras.Get(kTurnOfSplats).ArrayLen() == 4) {
        const tinygltf::Value& q = extras.Get(kTurnOfSplats);
        turn = {q.Get(3).GetNumberAsDouble(), q.Get(0).GetNumberAsDouble(), q.Get(1).GetNumberAsDouble(),
                q.Get(2).GetNumberAsDouble()};
    }
    return MeshReader(document).read(glm::dmat4(undone_turn(turn)));
}

glm::dmat3 undone_turn(const glm::dquat& turn) {
    if (!(std::abs(glm::length(turn) - 1) < 1e-6)) return glm::dmat3(1);
    return glm::mat3_cast(glm::conjugate(glm::normalize(turn)));
}

bool is_gltf_mesh(const std::filesystem::path& path) try {
    const GltfDocument document(path, GltfContent::meshes);
    bool triangles = false, splats = false;
    for (const tinygltf::Mesh& mesh : document.model().meshes)
        for (const tinygltf::Primitive& primitive : mesh.primitives) {
            triangles = triangles || is_triangles(primitive);
            splats = splats || primitive.extensions.count(kSplatExtension) > 0;
        }
    return triangles && !splats;
} catch (const InputError&) {
    return false;
}

bool has_gltf_splats(const std::filesystem::path& path) try {
    const GltfDocument document(path, GltfContent::splats);
    return std::ranges::any_of(document.model().meshes, [](const tinygltf::Mesh& mesh) {
        return std::ranges::any_of(mesh.primitives, [](const tinygltf::Primitive& primitive) {
            return primitive.extensions.count(kSplatExtension) > 0;
        });
    });
} catch (const InputError&) {
    return false;
}

}  // namespace ewa::io
