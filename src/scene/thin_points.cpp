// SPDX-License-Identifier: Apache-2.0
#include "scene/thin_points.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace ewa::scene {
namespace {

constexpr size_t kRoomPerPoint = 4, kLeastRoom = 4096;
// Powers of two that a cell's side can be. The eight cells of the largest side hold all that float32 can.
constexpr int kFinest = -200, kCoarsest = 128;

}  // namespace

size_t PointThinner::CellHash::operator()(const Cell& cell) const {
    uint64_t hash = 0;
    for (const double value : cell) {  // the steps of MurmurHash3's finalizer
        hash ^= std::bit_cast<uint64_t>(value + 0.0);
        hash = (hash ^ hash >> 33) * 0xff51afd7ed558ccd;
        hash = (hash ^ hash >> 33) * 0xc4ceb9fe1a85ec53;
        hash ^= hash >> 33;
    }
    return hash;
}

PointThinner::PointThinner(size_t most)
    : most_(most), room_(std::max(most, kLeastRoom / kRoomPerPoint) * kRoomPerPoint) {}

PointThinner::Cell PointThinner::cell_of(const glm::dvec3& position, int exponent) const {
    Cell cell;
    for (size_t k = 0; k < 3; ++k) cell[k] = std::floor(std::ldexp(position[int(k)], -exponent)) + 0.0;
    return cell;
}

/// Stops where it has more than `most` cells.
PointThinner::Cells PointThinner::cells_of(int exponent, size_t most) const {
    Cells cells;
    for (const glm::dvec3& position : points_.positions) {
        if (cells.size() > most) break;
        cells.insert(cell_of(position, exponent));
    }
    return cells;
}

/// The exponent of the smallest cells that are no more than `most`.
int PointThinner::finest_with(size_t most) const {
    int low = kFinest, high = kCoarsest;
    while (low < high) {
        const int middle = low + (high - low) / 2;
        if (cells_of(middle, most).size() <= most)
            high = middle;
        else
            low = middle + 1;
    }
    return low;
}

/// Keeps the first point of each of the smallest cells that are no more than `count`. Then points in halves of these cells fill the
/// rest, in the order of a hash, which is even.
void PointThinner::keep(size_t count) {
    const size_t before = points_.positions.size();
    exponent_ = finest_with(count);
    cells_.clear();
    Cells halves;
    size_t left = count;
    std::vector<uint8_t> kept(before);
    struct Other {
        bool second;  // in its half
        size_t hash, index;
        auto operator<=>(const Other&) const = default;
    };
    std::vector<Other> others;
    for (const bool first_round : {true, false})
        for (size_t i = 0; i < before; ++i) {
            if (kept[i]) continue;
            const glm::dvec3& position = points_.positions[i];
            const Cell half = cell_of(position, exponent_ - 1);
            if (!first_round) {
                others.push_back({!halves.insert(half).second, CellHash()(half), i});
            } else if (left > 0 && cells_.insert(cell_of(position, exponent_)).second) {
                kept[i] = 1;
                halves.insert(half);
                --left;
            }
        }
    std::ranges::sort(others);
    for (size_t k = 0; k < left; ++k) kept[others[k].index] = 1;
    size_t to = 0;
    for (size_t i = 0; i < before; ++i)
        if (kept[i]) {
            points_.positions[to] = points_.positions[i];
            points_.colors[to++] = points_.colors[i];
        }
    points_.positions.resize(to);
    points_.colors.resize(to);
}

void PointThinner::add(const glm::dvec3& position, const std::array<uint8_t, 3>& color) {
    if (!cells_.empty() && !cells_.insert(cell_of(position, exponent_)).second) return;
    points_.positions.push_back(position);
    points_.colors.push_back(color);
    if (points_.positions.size() > room_) keep(room_ / 2);
}

PointCloud PointThinner::take() {
    if (points_.positions.size() > most_) keep(most_);
    return std::move(points_);
}

PointCloud thinned(const PointCloud& points, size_t most) {
    if (points.positions.size() <= most) return points;
    PointThinner thinner(most);
    for (size_t i = 0; i < points.positions.size(); ++i) thinner.add(points.positions[i], points.colors[i]);
    return thinner.take();
}

}  // namespace ewa::scene
