// SPDX-License-Identifier: Apache-2.0
// The module with OpenVDB and meshoptimizer.
#include <meshoptimizer.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/VolumeToMesh.h>

#include "mesh/meshing.h"
#include "platform/exported.h"

namespace ewa::mesh {
namespace {

using Corners = std::array<uint32_t, 3>;

class VdbVolume : public Volume {
  public:
    VdbVolume() : grid_(openvdb::FloatGrid::create(1.0f)) {}

    void add(std::span<const glm::ivec3> places) override {
        openvdb::FloatTree& tree = grid_->tree();
        for (const glm::ivec3& place : places) {
            const glm::ivec3 at = place * kBlockSide;
            auto* leaf = tree.touchLeaf(openvdb::Coord(at.x, at.y, at.z));
            leaf->fill(0.0f);
            leaf->setValuesOn();
        }
    }

    std::vector<Block> blocks() override {
        std::vector<Block> all;
        all.reserve(grid_->tree().leafCount());
        for (auto leaf = grid_->tree().beginLeaf(); leaf; ++leaf) {
            const openvdb::Coord& at = leaf->origin();
            all.push_back({{at.x(), at.y(), at.z()}, leaf->buffer().data()});
        }
        return all;
    }

    IndexedTriangles surface() override {
        std::vector<openvdb::Vec3s> points;
        std::vector<openvdb::Vec3I> triangles;
        std::vector<openvdb::Vec4I> quads;
        openvdb::tools::volumeToMesh(*grid_, points, triangles, quads, 0.0, 0.0);
        IndexedTriangles out;
        out.positions.reserve(points.size());
        for (const openvdb::Vec3s& p : points) out.positions.emplace_back(p.x(), p.y(), p.z());
        for (const openvdb::Vec3I& t : triangles) out.triangles.push_back({t[0], t[1], t[2]});
        out.triangles.reserve(out.triangles.size() + 2 * quads.size());
        for (const openvdb::Vec4I& q : quads) {
            // Along the shorter diagonal, the two triangles fold less.
            const bool first =
                (points[q[2]] - points[q[0]]).lengthSqr() <= (points[q[3]] - points[q[1]]).lengthSqr();
            const std::array<uint32_t, 4> c =
                first ? std::array{q[0], q[1], q[2], q[3]} : std::array{q[1], q[2], q[3], q[0]};
            out.triangles.push_back({c[0], c[1], c[2]});
            out.triangles.push_back({c[0], c[2], c[3]});
        }
        return out;
    }

  private:
    openvdb::FloatGrid::Ptr grid_;
};

// openvdb::initialize() is for files, which are not read or written here.
std::unique_ptr<Volume> make_volume() {
    return std::make_unique<VdbVolume>();
}

std::vector<Corners> simplify(std::span<const glm::vec3> positions, std::span<const Corners> triangles,
                              size_t most) {
    static_assert(sizeof(Corners) == 3 * sizeof(unsigned) && sizeof(glm::vec3) == 3 * sizeof(float));
    std::vector<Corners> out(triangles.size());
    constexpr float kAnyError = 1;  // of the mesh's extent: the number of triangles decides
    const size_t indices = meshopt_simplify(&out.data()->front(), &triangles.data()->front(),
                                            3 * triangles.size(), &positions.data()->x, positions.size(),
                                            sizeof(glm::vec3), 3 * most, kAnyError, 0, nullptr);
    out.resize(indices / 3);
    return out;
}

}  // namespace
}  // namespace ewa::mesh

extern "C" EWA_EXPORTED const ewa::mesh::Meshing ewa_meshing_layout_1;
const ewa::mesh::Meshing ewa_meshing_layout_1 = {EWA_VERSION, ewa::mesh::make_volume, ewa::mesh::simplify};
