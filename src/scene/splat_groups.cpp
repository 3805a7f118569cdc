// SPDX-License-Identifier: Apache-2.0
#include "scene/splat_groups.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <limits>
#include <map>
#include <memory>
#include <nanoflann.hpp>
#include <numeric>

#include "core/parallel.h"
#include "scene/native_lens.h"
#include "scene/splat_arrays.h"
#include "scene/splat_shape.h"

namespace ewa::scene {

namespace {

constexpr size_t kNearest = 32;
constexpr double kTouching = 9;        // squared, in standard deviations
constexpr double kOfAboutItsSize = 2;  // factor between the largest standard deviations

/// The means of some splats, such as those whose largest standard deviations are in one octave.
struct Octave {
    const Gaussians* gaussians = nullptr;
    std::vector<uint32_t> splats;

    size_t kdtree_get_point_count() const { return splats.size(); }
    double kdtree_get_pt(size_t i, size_t axis) const { return gaussians->means[3 * splats[i] + axis]; }
    template <class Box>
    bool kdtree_get_bbox(Box&) const {
        return false;
    }
};

using OctaveTree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Octave>, Octave, 3, uint32_t>;

double largest_log_scale(const Gaussians& g, size_t i) {
    return computable_log_scale(
        std::max({g.log_scales[3 * i], g.log_scales[3 * i + 1], g.log_scales[3 * i + 2]}));
}

bool touch(const Gaussians& g, size_t a, size_t b) {
    if (std::abs(largest_log_scale(g, a) - largest_log_scale(g, b)) >= std::log(kOfAboutItsSize))
        return false;
    const float* p = &g.means[3 * a];
    const float* q = &g.means[3 * b];
    const glm::dvec3 d(double(p[0]) - q[0], double(p[1]) - q[1], double(p[2]) - q[2]);
    return glm::dot(d, glm::inverse(covariance_of(g, a) + covariance_of(g, b)) * d) < kTouching;
}

/// Ends a search at the first point within a distance: points that are dense do not make it longer.
class AnyWithin {
  public:
    using DistanceType = double;  // for nanoflann
    explicit AnyWithin(double squared)
        : limit_(std::nextafter(squared, std::numeric_limits<double>::infinity())) {}
    bool addPoint(double, uint32_t) {
        found_ = true;
        return false;
    }
    double worstDist() const { return limit_; }
    bool full() const { return found_; }
    void sort() const {}

  private:
    double limit_;
    bool found_ = false;
};

/// Sets that are joined two by two.
class Sets {
  public:
    explicit Sets(size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0u); }

    uint32_t root(uint32_t i) {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }
    /// The lowest index of a set is its root.
    void join(uint32_t a, uint32_t b) {
        a = root(a), b = root(b);
        parent_[std::max(a, b)] = std::min(a, b);
    }

  private:
    std::vector<uint32_t> parent_;
};

/// Joins splats of the same mean and leaves the first of them: a query would visit all of them, and n queries n^2.
void join_places(const Gaussians& g, std::vector<uint32_t>& splats, Sets& sets) {
    const auto mean = [&](uint32_t i) {
        return std::array<float, 3>{g.means[3 * i], g.means[3 * i + 1], g.means[3 * i + 2]};
    };
    std::stable_sort(splats.begin(), splats.end(), [&](uint32_t a, uint32_t b) { return mean(a) < mean(b); });
    size_t places = 0;
    for (size_t k = 0; k < splats.size(); ++k)
        if (places > 0 && mean(splats[places - 1]) == mean(splats[k]))
            sets.join(splats[places - 1], splats[k]);
        else
            splats[places++] = splats[k];
    splats.resize(places);
}

/// Joins each splat with those of `tree` that it touches.
void join_with(const Gaussians& g, const std::vector<uint32_t>& splats, const Octave& octave,
               const OctaveTree& tree, Sets& sets) {
    std::array<uint32_t, kNearest> index{};
    std::array<double, kNearest> squared{};
    for (const uint32_t i : splats) {
        const std::array<double, 3> mean = {g.means[3 * i], g.means[3 * i + 1], g.means[3 * i + 2]};
        const size_t found = tree.knnSearch(mean.data(), kNearest, index.data(), squared.data());
        for (size_t k = 0; k < found; ++k) {
            const uint32_t j = octave.splats[index[k]];
            if (sets.root(i) != sets.root(j) && touch(g, i, j)) sets.join(i, j);
        }
    }
}

}  // namespace

SplatGroups touching_groups(const Gaussians& gaussians) {
    const size_t count = gaussians.size();
    std::map<int, Octave> octaves;
    for (size_t i = 0; i < count; ++i) {
        if (!drawable(gaussians, i)) continue;
        Octave& octave = octaves[int(std::floor(largest_log_scale(gaussians, i) / std::log(2.0)))];
        octave.gaussians = &gaussians;
        octave.splats.push_back(uint32_t(i));
    }
    std::map<int, std::unique_ptr<OctaveTree>> trees;
    Sets sets(count);
    for (auto& [size, octave] : octaves) {
        join_places(gaussians, octave.splats, sets);
        trees[size] = std::make_unique<OctaveTree>(3, octave);
        trees[size]->buildIndex();
    }
    // Splats of about one size are in one octave or in two that follow each other.
    for (const auto& [size, octave] : octaves)
        for (const int other : {size, size + 1, size - 1})
            if (const auto tree = trees.find(other); tree != trees.end())
                join_with(gaussians, octave.splats, octaves.at(other), *tree->second, sets);

    std::vector<uint32_t> sizes(count, 0), roots;
    for (size_t i = 0; i < count; ++i)
        if (sizes[sets.root(uint32_t(i))]++ == 0) roots.push_back(sets.root(uint32_t(i)));
    std::stable_sort(roots.begin(), roots.end(), [&](uint32_t a, uint32_t b) { return sizes[a] > sizes[b]; });
    SplatGroups groups;
    std::vector<uint32_t> number(count, 0);
    for (const uint32_t root : roots) {
        number[root] = uint32_t(groups.sizes.size());
        groups.sizes.push_back(sizes[root]);
    }
    groups.of.resize(count);
    for (size_t i = 0; i < count; ++i) groups.of[i] = number[sets.root(uint32_t(i))];
    return groups;
}

std::vector<bool> splats_near(const Gaussians& gaussians, const std::vector<bool>& some, double radius) {
    const auto place = [&](size_t i) {
        return std::array<double, 3>{gaussians.means[3 * i], gaussians.means[3 * i + 1],
                                     gaussians.means[3 * i + 2]};
    };
    const auto finite = [](const std::array<double, 3>& p) { return std::isfinite(p[0] + p[1] + p[2]); };
    Octave points{&gaussians, {}};
    for (size_t i = 0; i < some.size(); ++i)
        if (some[i] && finite(place(i))) points.splats.push_back(uint32_t(i));
    if (points.splats.empty()) return some;
    OctaveTree tree(3, points);
    tree.buildIndex();
    constexpr size_t kAtOnce = 4096;
    std::vector<uint8_t> near(some.begin(), some.end());
    core::on_all_cores((near.size() + kAtOnce - 1) / kAtOnce, [&](size_t piece) {
        for (size_t i = piece * kAtOnce; i < std::min(near.size(), (piece + 1) * kAtOnce); ++i) {
            AnyWithin any(radius * radius);
            if (near[i] == 0 && finite(place(i))) near[i] = tree.findNeighbors(any, place(i).data(), {});
        }
    });
    return {near.begin(), near.end()};
}

std::vector<uint32_t> views_of_splats(const Gaussians& gaussians, const std::vector<Camera>& cameras) {
    std::vector<double> limits;
    for (const Camera& camera : cameras) limits.push_back(lens_limit(camera));
    std::vector<uint32_t> views(gaussians.size(), 0);
    constexpr size_t kAtOnce = 4096;
    core::on_all_cores((gaussians.size() + kAtOnce - 1) / kAtOnce, [&](size_t piece) {
        const size_t end = std::min(gaussians.size(), (piece + 1) * kAtOnce);
        for (size_t i = piece * kAtOnce; i < end; ++i)
            for (size_t k = 0; k < cameras.size(); ++k) {
                const Camera& camera = cameras[k];
                const glm::dvec3 point = camera.rotation * gaussians.world_mean(i) + camera.translation;
                const auto pixel = pixel_of(camera, limits[k], point);
                views[i] += pixel && pixel->x >= 0 && pixel->y >= 0 && pixel->x < camera.width &&
                            pixel->y < camera.height;
            }
    });
    return views;
}

}  // namespace ewa::scene
