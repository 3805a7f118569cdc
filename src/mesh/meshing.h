// SPDX-License-Identifier: Apache-2.0
// The functions of libewa_meshing.so for this module: a sparse volume and its surface by OpenVDB, fewer triangles by meshoptimizer.
// They are in a module of their own, because loading them with their dependencies takes longer than a short command runs.
#pragma once
#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <span>
#include <vector>

namespace ewa::mesh {

inline constexpr int kBlockSide = 8;  // voxels
inline constexpr size_t kBlockVoxels = 512;
inline constexpr int kMostBlocks = 1 << 20;  // from the middle to either side, along an axis

/// A cube of voxels. The value at corner + (x, y, z) is values[(x * kBlockSide + y) * kBlockSide + z].
struct Block {
    glm::ivec3 corner{0};  // voxels
    float* values = nullptr;
};

struct IndexedTriangles {
    std::vector<glm::vec3> positions;
    std::vector<std::array<uint32_t, 3>> triangles;
};

/// A sparse grid of values at integer positions. Blocks store the values; outside blocks the values are 1.
class Volume {
  public:
    virtual ~Volume() = default;
    /// Adds blocks of zeros. places: corners / kBlockSide, each once.
    virtual void add(std::span<const glm::ivec3> places) = 0;
    /// All blocks. Their order depends on nothing but the places. The pointers hold until the next add.
    virtual std::vector<Block> blocks() = 0;
    /// The surface where the values cross 0. Triangles are counter-clockwise as seen from the side of positive values. A vertex's
    /// position, rounded down, is the index of the cell that it lies in.
    virtual IndexedTriangles surface() = 0;
};

/// The functions that the module exports under the name kMeshingEntry.
struct Meshing {
    const char* version;  // EWA_VERSION
    std::unique_ptr<Volume> (*make_volume)();
    /// At most `most` triangles where the topology allows it, over the same vertices.
    std::vector<std::array<uint32_t, 3>> (*simplify)(std::span<const glm::vec3> positions,
                                                     std::span<const std::array<uint32_t, 3>> triangles,
                                                     size_t most);
};

/// Ends in the number of the layout, which counts up whenever a type above changes.
inline constexpr const char* kMeshingEntry = "ewa_meshing_layout_1";

/// Throws RunError where the module cannot be loaded.
const Meshing& meshing();

}  // namespace ewa::mesh
