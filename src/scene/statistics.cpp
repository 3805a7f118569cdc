// SPDX-License-Identifier: Apache-2.0
#include "scene/statistics.h"

#include <algorithm>
#include <array>
#include <nanoflann.hpp>
#include <numeric>

#include "core/parallel.h"

namespace ewa::scene {

namespace {

constexpr size_t kNeighbors = 3;

/// The distinct positions with the number of points at each. The tree holds only these, because a query would
/// visit all duplicates of a position, and n queries n^2.
struct Places {
    std::vector<glm::dvec3> positions;
    std::vector<size_t> counts;
    std::vector<size_t> first;     // the lowest index of a point at each
    std::vector<size_t> place_of;  // of each point

    size_t kdtree_get_point_count() const { return positions.size(); }
    double kdtree_get_pt(size_t i, size_t axis) const { return positions[i][int(axis)]; }
    template <class Box>
    bool kdtree_get_bbox(Box&) const {
        return false;
    }
};

using Tree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Places>, Places, 3, size_t>;

bool before(const glm::dvec3& a, const glm::dvec3& b) {
    return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z;
}

Places places_of(const std::vector<glm::dvec3>& positions) {
    std::vector<size_t> order(positions.size());
    std::iota(order.begin(), order.end(), size_t(0));
    std::sort(order.begin(), order.end(), [&](size_t a, size_t b) {
        return before(positions[a], positions[b]) || (positions[a] == positions[b] && a < b);
    });
    Places places;
    places.place_of.resize(positions.size());
    for (size_t i : order) {
        if (places.positions.empty() || places.positions.back() != positions[i]) {
            places.positions.push_back(positions[i]);
            places.counts.push_back(0);
            places.first.push_back(i);
        }
        ++places.counts.back();
        places.place_of[i] = places.positions.size() - 1;
    }
    return places;
}

/// Calls work(i) for each i < count on all cores, many at a time.
template <class Work>
void in_blocks(size_t count, const Work& work) {
    constexpr size_t kBlock = 1024;
    core::on_all_cores((count + kBlock - 1) / kBlock, [&](size_t block) {
        for (size_t i = block * kBlock; i < std::min(count, (block + 1) * kBlock); ++i) work(i);
    });
}

/// The mean over the three nearest other points, or over all if there are fewer.
double mean_at(const Places& places, const Tree& tree, size_t place) {
    std::array<size_t, kNeighbors + 1> index{};
    std::array<double, kNeighbors + 1> squared{};
    const size_t found =
        tree.knnSearch(&places.positions[place].x, index.size(), index.data(), squared.data());
    size_t taken = std::min(places.counts[place] - 1, kNeighbors);
    double sum = 0;
    for (size_t i = 0; i < found; ++i) {
        if (index[i] == place) continue;
        const size_t share = std::min(places.counts[index[i]], kNeighbors - taken);
        sum += double(share) * squared[i];
        taken += share;
    }
    return taken == 0 ? -1.0 : sum / double(taken);
}

}  // namespace

std::vector<double> mean_squared_neighbor_distance(const std::vector<glm::dvec3>& positions) {
    const Places places = places_of(positions);
    if (places.positions.empty()) return {};

    const Tree tree(3, places);
    std::vector<double> mean(places.positions.size()), result(positions.size());
    in_blocks(mean.size(), [&](size_t i) { mean[i] = mean_at(places, tree, i); });
    for (size_t i = 0; i < result.size(); ++i) result[i] = mean[places.place_of[i]];
    return result;
}

std::vector<std::array<size_t, 2>> neighbor_pairs(const std::vector<glm::dvec3>& positions, size_t count) {
    const Places places = places_of(positions);
    if (places.positions.empty()) return {};
    const Tree tree(3, places);
    // Entry i of a place is its i-th neighbour; a pair of a place with itself stands for none.
    std::vector<std::array<size_t, 2>> pairs(places.positions.size() * (count + 1));
    in_blocks(places.positions.size(), [&](size_t place) {
        std::vector<size_t> index(count + 1);
        std::vector<double> squared(count + 1);
        const size_t found =
            tree.knnSearch(&places.positions[place].x, index.size(), index.data(), squared.data());
        const size_t a = places.first[place];
        for (size_t i = 0; i < found; ++i) {
            const size_t b = places.first[index[i]];
            pairs[place * (count + 1) + i] = {std::min(a, b), std::max(a, b)};
        }
    });
    std::erase_if(pairs, [](const std::array<size_t, 2>& pair) { return pair[0] == pair[1]; });
    std::sort(pairs.begin(), pairs.end());
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    return pairs;
}

}  // namespace ewa::scene
