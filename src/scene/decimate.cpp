// SPDX-License-Identifier: Apache-2.0
// Merges splats pair by pair. The cost of a pair is the error of the merged splat in three views along the axes, of parallel
// rays, in closed form: there a splat is a Gaussian in two dimensions. docs/sharing.md has measurements.
#include "scene/decimate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <limits>
#include <nanoflann.hpp>
#include <numbers>
#include <numeric>
#include <string>

#include "core/parallel.h"
#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "scene/splat_arrays.h"
#include "scene/splat_shape.h"

namespace ewa {

namespace {

constexpr size_t kNeighbors = 6, kBestOfThem = 3;
/// More splats at once merge pairs that a neighbour of the merged splat would fit better; fewer wear out the places that are cheap.
constexpr double kMostOfARound = 0.35;
/// A squared difference in opacity counts as much as this squared difference of a colour: what lies behind has a similar one.
constexpr double kOpacityWeight = 0.03;
/// Errors are divided by this power of the squared norm of both splats. Below 1, small splats are a little cheaper.
constexpr double kRelative = 0.9;
constexpr double kMostOpaque = 0.999;
constexpr double kSmallest = 1e-300;  // of a determinant or a norm: no division by 0
constexpr size_t kAtOnce = 4096;

/// A splat in the three views. The covariance is xx xy xz yy yz zz.
struct Shape {
    glm::dvec3 mean{0.0};
    std::array<double, 6> covariance{};
    std::array<double, 3> roots{};  // of the determinants of the covariance in each view
    double opacity = 0, area = 0;   // area: the integral of all three Gaussians of peak 1

    double light() const { return opacity * area; }  // that it takes, without others before it
    double square() const {
        return area / 2;
    }  // the overlap with itself: a Gaussian's square has half its integral
};

struct View {
    int x, y;           // the axes of its image
    size_t xx, xy, yy;  // where Shape::covariance has these
};
constexpr std::array<View, 3> kViews = {{{0, 1, 0, 1, 3}, {0, 2, 0, 2, 5}, {1, 2, 3, 4, 5}}};

void measure_area(Shape& shape) {
    shape.area = 0;
    for (size_t v = 0; v < kViews.size(); ++v) {
        const auto& c = shape.covariance;
        const View& view = kViews[v];
        shape.roots[v] = std::sqrt(std::max(c[view.xx] * c[view.yy] - c[view.xy] * c[view.xy], kSmallest));
        shape.area += 2 * std::numbers::pi * shape.roots[v];
    }
}

/// The integral of the product of both Gaussians of peak 1, over all three views.
double overlap(const Shape& a, const Shape& b) {
    double sum = 0;
    const glm::dvec3 d = a.mean - b.mean;
    for (size_t v = 0; v < kViews.size(); ++v) {
        const View& view = kViews[v];
        const double xx = a.covariance[view.xx] + b.covariance[view.xx],
                     xy = a.covariance[view.xy] + b.covariance[view.xy],
                     yy = a.covariance[view.yy] + b.covariance[view.yy];
        const double x = d[view.x], y = d[view.y], determinant = std::max(xx * yy - xy * xy, kSmallest);
        const double squared = (yy * x * x - 2 * xy * x * y + xx * y * y) / determinant;
        sum +=
            2 * std::numbers::pi * a.roots[v] * b.roots[v] / std::sqrt(determinant) * std::exp(-squared / 2);
    }
    return sum;
}

struct Merged {
    Shape shape;
    double share;  // of the first splat in means and colours
    double kept;   // of the light that both splats take one by one; what both cover counts once
};

/// The splat of the same mass, mean and covariance, mass being the light. ab: the overlap of a and b.
Merged merge(const Shape& a, const Shape& b, double ab) {
    const double light = std::max(a.light() + b.light(), kSmallest);
    Merged merged{{}, std::max(a.light(), kSmallest / 2) / light, 1 - a.opacity * b.opacity * ab / light};
    const double p = merged.share, q = 1 - p;
    Shape& shape = merged.shape;
    shape.mean = p * a.mean + q * b.mean;
    const glm::dvec3 d = a.mean - b.mean;
    const std::array<double, 6> spread = {d.x * d.x, d.x * d.y, d.x * d.z, d.y * d.y, d.y * d.z, d.z * d.z};
    for (size_t k = 0; k < 6; ++k)
        shape.covariance[k] = p * a.covariance[k] + q * b.covariance[k] + p * q * spread[k];
    measure_area(shape);
    shape.opacity = std::min(merged.kept * light / shape.area, kMostOpaque);
    return merged;
}

/// The squared difference of both colours, as the mean over all directions and the sum of the channels.
double color_distance(const Gaussians& g, size_t i, size_t j) {
    double sum = 0;
    for (size_t k = 0; k < g.sh_stride(); ++k) {
        const double d = double(g.sh[g.sh_stride() * i + k]) - g.sh[g.sh_stride() * j + k];
        sum += d * d;
    }
    return sum / (4 * std::numbers::pi);
}

/// What merging two splats changes: the squares of the colours, each splat's against their mean, and of the opacities.
struct Change {
    double squared, both;  // both: the squared opacity of the two splats
};

Change change_of(const Shape& a, const Shape& b, double color) {
    const double aa = a.square(), bb = b.square(), ab = overlap(a, b);
    const Merged merged = merge(a, b, ab);
    const Shape& m = merged.shape;
    const double oa = merged.kept * a.opacity, ob = merged.kept * b.opacity;
    const double both = oa * oa * aa + 2 * oa * ob * ab + ob * ob * bb;
    const double opacity =
        both + m.opacity * m.opacity * m.square() - 2 * m.opacity * (oa * overlap(a, m) + ob * overlap(b, m));
    const double ca = (1 - merged.share) * a.opacity, cb = merged.share * b.opacity;
    const double colors = color * (ca * ca * aa - 2 * ca * cb * ab + cb * cb * bb);
    return {std::max(colors, 0.0) + kOpacityWeight * std::max(opacity, 0.0), both};
}

double cost(const Shape& a, const Shape& b, double color) {
    const Change change = change_of(a, b, color);
    return change.squared / std::pow(std::max(change.both, kSmallest), kRelative);
}

/// Splats whose means are the first at their place: a query of a tree would visit all that share one. Value: of coordinates and
/// squared distances.
template <class Value>
struct Places {
    const Gaussians& gaussians;
    const std::vector<uint32_t>& splats;

    size_t kdtree_get_point_count() const { return splats.size(); }
    Value kdtree_get_pt(size_t i, size_t axis) const { return gaussians.means[3 * splats[i] + axis]; }
    template <class Box>
    bool kdtree_get_bbox(Box&) const {
        return false;
    }
};

template <class Value>
using PlaceTree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<Value, Places<Value>>,
                                                      Places<Value>, 3, uint32_t>;

/// Squares of coordinates up to this, and sums of them, are finite in float32.
constexpr float kFarthestInFloat = 1e18f;

struct Pair {
    float cost = std::numeric_limits<float>::max();
    uint32_t i = 0, j = 0;  // the same where there is none

    bool operator<(const Pair& other) const {
        if (cost != other.cost) return cost < other.cost;
        return i != other.i ? i < other.i : j < other.j;
    }
};

/// What of a shape takes time to find.
struct Measured {
    std::array<double, 6> covariance;
    double opacity;
};

Measured measured(const Gaussians& g, size_t i) {
    const glm::dmat3 c = scene::covariance_of(g, i);
    return {{c[0][0], c[0][1], c[0][2], c[1][1], c[1][2], c[2][2]},
            1 / (1 + std::exp(-double(g.opacity_logits[i])))};
}

Shape shape_at(const Gaussians& g, size_t i, const Measured& values) {
    Shape shape;
    shape.mean = {g.means[3 * i], g.means[3 * i + 1], g.means[3 * i + 2]};
    shape.covariance = values.covariance;
    shape.opacity = values.opacity;
    measure_area(shape);
    return shape;
}

/// One round: finds pairs among near splats, and merges the cheapest of them.
class Round {
  public:
    /// errors: see decimate_traced; null where nobody asks.
    Round(Gaussians& gaussians, std::vector<float>* errors) : g_(gaussians), errors_(errors) {}

    void run(size_t target) {
        measure();
        find_pairs();
        merge_cheapest(std::max(target, size_t(double(g_.size()) * (1 - kMostOfARound))));
    }

  private:
    template <class Work>
    void for_all(size_t count, const Work& work) const {
        core::on_all_cores((count + kAtOnce - 1) / kAtOnce, [&](size_t piece) {
            for (size_t i = piece * kAtOnce; i < std::min(count, (piece + 1) * kAtOnce); ++i) work(i);
        });
    }

    void measure() {
        measured_.resize(g_.size());
        for_all(g_.size(), [&](size_t i) { measured_[i] = measured(g_, i); });
    }

    Shape shape_of(size_t i) const { return shape_at(g_, i, measured_[i]); }

    Pair pair_of(const Shape& a, size_t i, size_t j) const {
        Pair pair{float(cost(a, shape_of(j), color_distance(g_, i, j))), uint32_t(i), uint32_t(j)};
        if (!(pair.cost < std::numeric_limits<float>::max())) pair.cost = std::numeric_limits<float>::max();
        return pair;
    }

    /// The first splat of each place, in order of the places. Each other splat there is paired with the one before.
    std::vector<uint32_t> find_places() {
        std::vector<uint32_t> order(g_.size());
        std::iota(order.begin(), order.end(), 0u);
        const auto before = [&](uint32_t a, uint32_t b) {
            return std::lexicographical_compare(&g_.means[3 * a], &g_.means[3 * a] + 3, &g_.means[3 * b],
                                                &g_.means[3 * b] + 3);
        };
        std::sort(order.begin(), order.end(),
                  [&](uint32_t a, uint32_t b) { return before(a, b) || (!before(b, a) && a < b); });
        std::vector<uint32_t> places;
        for (size_t k = 0; k < order.size(); ++k)
            if (k == 0 || before(order[k - 1], order[k]))
                places.push_back(order[k]);
            else
                pairs_[kBestOfThem * order[k]] = pair_of(shape_of(order[k]), order[k], order[k - 1]);
        return places;
    }

    void find_pairs() {
        pairs_.assign(kBestOfThem * g_.size(), {});
        const std::vector<uint32_t> places = find_places();
        const bool near =
            std::ranges::all_of(g_.means, [](float v) { return std::abs(v) < kFarthestInFloat; });
        near ? find_pairs_among<float>(places) : find_pairs_among<double>(places);
    }

    template <class Value>
    void find_pairs_among(const std::vector<uint32_t>& splats) {
        const Places<Value> places{g_, splats};
        const PlaceTree<Value> tree(3, places);
        for_all(splats.size(), [&](size_t at) {
            const uint32_t i = splats[at];
            const Shape shape = shape_of(i);
            std::array<uint32_t, kNeighbors + 1> near{};  // i itself is one of them
            std::array<Value, kNeighbors + 1> squared{};
            const std::array<Value, 3> here = {g_.means[3 * i], g_.means[3 * i + 1], g_.means[3 * i + 2]};
            std::array<Pair, kNeighbors> pairs{};
            const size_t found = tree.knnSearch(here.data(), near.size(), near.data(), squared.data());
            size_t count = 0;
            for (size_t k = 0; k < found && count < pairs.size(); ++k)
                if (const uint32_t j = splats[near[k]]; j != i) pairs[count++] = pair_of(shape, i, j);
            const size_t best = std::min(count, kBestOfThem);
            std::partial_sort(pairs.begin(), pairs.begin() + std::ptrdiff_t(best),
                              pairs.begin() + std::ptrdiff_t(count));
            std::copy_n(pairs.begin(), best, &pairs_[kBestOfThem * i]);
        });
    }

    void merge_cheapest(size_t least) {
        std::sort(pairs_.begin(), pairs_.end());
        std::vector<uint8_t> state(g_.size(), 0);  // 1: merged, 2: gone
        size_t left = g_.size();
        for (const Pair& pair : pairs_) {
            if (left == least) break;
            if (pair.i == pair.j || state[pair.i] != 0 || state[pair.j] != 0) continue;
            merge_into(pair.i, pair.j);
            state[pair.i] = 1;
            state[pair.j] = 2;
            --left;
        }
        pairs_ = {};
        measured_ = {};
        std::vector<uint32_t> kept;
        kept.reserve(left);
        for (size_t i = 0; i < state.size(); ++i)
            if (state[i] != 2) kept.push_back(uint32_t(i));
        keep_splats(g_, kept);
        if (!errors_) return;
        for (size_t k = 0; k < kept.size(); ++k) (*errors_)[k] = (*errors_)[kept[k]];
        errors_->resize(kept.size());
    }

    void merge_into(size_t i, size_t j) {
        const Shape a = shape_of(i), b = shape_of(j);
        if (errors_)
            (*errors_)[i] += (*errors_)[j] + float(change_of(a, b, color_distance(g_, i, j)).squared);
        const Merged merged = merge(a, b, overlap(a, b));
        const auto& c = merged.shape.covariance;
        for (size_t k = 0; k < 3; ++k) g_.means[3 * i + k] = float(merged.shape.mean[int(k)]);
        scene::set_covariance(g_, i, glm::dmat3(c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5]));
        const double opacity = std::max(merged.shape.opacity, kSmallest);
        g_.opacity_logits[i] = float(std::log(opacity) - std::log1p(-opacity));
        float* into = &g_.sh[g_.sh_stride() * i];
        const float* from = &g_.sh[g_.sh_stride() * j];
        for (size_t k = 0; k < g_.sh_stride(); ++k)
            into[k] = float(merged.share * into[k] + (1 - merged.share) * from[k]);
    }

    Gaussians& g_;
    std::vector<float>* errors_;
    std::vector<Measured> measured_;
    std::vector<Pair> pairs_;  // kBestOfThem of each splat
};

/// Moves the values of splat order[i] to splat i.
void reorder(std::vector<float>& values, size_t stride, const std::vector<uint32_t>& order) {
    std::vector<bool> moved(order.size());
    std::vector<float> first(stride);
    const auto at = [&](size_t i) { return values.begin() + std::ptrdiff_t(i * stride); };
    for (size_t i = 0; i < order.size(); ++i) {
        if (moved[i]) continue;
        std::copy_n(at(i), stride, first.begin());
        size_t to = i;
        for (; order[to] != i; to = order[to]) {
            std::copy_n(at(order[to]), stride, at(to));
            moved[to] = true;
        }
        std::copy_n(first.begin(), stride, at(to));
        moved[to] = true;
    }
}

/// The splats must be drawable, with opacities of 3DGS's kernel.
void merge_rounds(Gaussians& gaussians, size_t target, std::vector<float>* errors,
                  const std::function<void(size_t)>& progress) {
    target = std::max(target, size_t(1));
    while (gaussians.size() > target) {
        const size_t before = gaussians.size();
        Round(gaussians, errors).run(target);
        if (gaussians.size() == before)
            throw RunError("no two of " + std::to_string(before) + " splats can be merged to have " +
                           std::to_string(target));
        if (progress) progress(gaussians.size());
    }
}

}  // namespace

void decimate_splats(Gaussians& gaussians, size_t target, const std::function<void(size_t)>& progress) {
    check(gaussians);
    if (gaussians.size() <= target) return;
    std::vector<uint32_t> kept;
    for (size_t i = 0; i < gaussians.size(); ++i)
        if (drawable(gaussians, i)) kept.push_back(uint32_t(i));
    keep_splats(gaussians, kept);
    if (!scene::is_computable(gaussians)) gaussians = scene::computable(std::move(gaussians));
    const bool density = gaussians.density;
    fit_opacities(gaussians, false);
    scene::put_neighbors_together(gaussians);
    merge_rounds(gaussians, target, nullptr, progress);
    fit_opacities(gaussians, density);
}

namespace scene {

void put_neighbors_together(Gaussians& gaussians) {
    const std::vector<uint32_t> order = morton_order(gaussians);
    const auto all = arrays_of(gaussians);
    core::on_all_cores(all.size(), [&](size_t k) { reorder(*all[k].values, all[k].each, order); });
}

double squared_light(const Gaussians& gaussians, size_t i) {
    const Shape shape = shape_at(gaussians, i, measured(gaussians, i));
    return shape.opacity * shape.opacity * shape.square();
}

void decimate_traced(Gaussians& gaussians, size_t target, std::vector<float>& errors) {
    errors.resize(gaussians.size());
    merge_rounds(gaussians, target, &errors, {});
}

}  // namespace scene

}  // namespace ewa
