// SPDX-License-Identifier: Apache-2.0
// A point cloud with fewer points, spread evenly over the cells that have any.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <unordered_set>
#include <vector>

#include "ewa/dataset.h"

namespace ewa::scene {

/// Thins points that come one by one, with memory for a few times `most` of them. Cells are cubes whose sides are powers of two. The
/// first point of a cell is kept. The same points in the same order give the same result.
class PointThinner {
  public:
    explicit PointThinner(size_t most);

    /// Adds a point. Its position must be finite in float32.
    void add(const glm::dvec3& position, const std::array<uint8_t, 3>& color);

    /// Returns all added points if there are at most `most`, else exactly `most` of them, in the order of adding. Call it once, at
    /// the end.
    PointCloud take();

  private:
    using Cell = std::array<double, 3>;  // a corner, in sides: exact, however far it is
    struct CellHash {
        size_t operator()(const Cell& cell) const;
    };
    using Cells = std::unordered_set<Cell, CellHash>;

    Cell cell_of(const glm::dvec3& position, int exponent) const;
    Cells cells_of(int exponent, size_t most) const;
    int finest_with(size_t most) const;
    void keep(size_t count);

    size_t most_, room_;
    int exponent_ = 0;  // of the cells' side, once there are cells
    Cells cells_;
    PointCloud points_;
};

/// `points`, thinned to at most `most` by PointThinner.
PointCloud thinned(const PointCloud& points, size_t most);

}  // namespace ewa::scene
