// SPDX-License-Identifier: Apache-2.0
#include "io/splats/clusters.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>

#include "core/parallel.h"

namespace ewa::io {

namespace {

constexpr size_t kCodes = 256;

/// First values for Lloyd's iterations: where values are dense, but also some where they are sparse. The
/// density of the best values is between that of the input and a constant one.
std::array<float, kCodes> first_codes(const std::vector<float>& sorted) {
    const size_t steps = std::min<size_t>(4096, sorted.size() - 1);
    std::vector<double> reached(steps + 1, 0.0);
    const auto sample = [&](size_t i) { return double(sorted[i * (sorted.size() - 1) / steps]); };
    for (size_t i = 0; i < steps; ++i) reached[i + 1] = reached[i] + std::sqrt(sample(i + 1) - sample(i));
    std::array<float, kCodes> codes;
    size_t at = 0;
    for (size_t k = 0; k < kCodes; ++k) {
        const double wanted = reached[steps] * (double(k) + 0.5) / kCodes;
        while (at + 1 < steps && reached[at + 1] < wanted) ++at;
        const double span = reached[at + 1] - reached[at];
        const double share = span > 0 ? (wanted - reached[at]) / span : 0;
        codes[k] = float(sample(at) + (sample(at + 1) - sample(at)) * share);
    }
    return codes;
}

/// The values nearest to each code: a range of the sorted values.
class Cells {
  public:
    explicit Cells(const std::vector<float>& sorted)
        : values_(sorted), sums_(sorted.size() + 1, 0.0), squares_(sorted.size() + 1, 0.0) {
        for (size_t i = 0; i < sorted.size(); ++i) {
            sums_[i + 1] = sums_[i] + sorted[i];
            squares_[i + 1] = squares_[i] + double(sorted[i]) * sorted[i];
        }
    }

    /// Lloyd's iteration: each code becomes the mean of its cell. A code without values goes to the cell with the
    /// largest error and shares it with the code there.
    void improve(std::array<float, kCodes>& codes) const {
        std::array<size_t, kCodes + 1> ends{};
        std::array<double, kCodes> errors{};
        std::vector<size_t> unused;
        for (size_t k = 0; k < kCodes; ++k) {
            const double middle = k + 1 < kCodes ? (double(codes[k]) + codes[k + 1]) / 2 : INFINITY;
            const size_t begin = ends[k];
            const size_t end =
                size_t(std::upper_bound(values_.begin() + std::ptrdiff_t(begin), values_.end(), middle) -
                       values_.begin());
            ends[k + 1] = end;
            if (end == begin) {
                unused.push_back(k);
                continue;
            }
            const double sum = sums_[end] - sums_[begin];
            codes[k] = float(sum / double(end - begin));
            errors[k] = squares_[end] - squares_[begin] - sum * sum / double(end - begin);
        }
        for (const size_t k : unused) {
            const auto worst = size_t(std::max_element(errors.begin(), errors.end()) - errors.begin());
            const size_t begin = ends[worst], count = ends[worst + 1] - begin;
            if (errors[worst] <= 0) break;
            codes[worst] = values_[begin + count / 4];
            codes[k] = values_[begin + count * 3 / 4];
            errors[worst] = 0;
        }
        std::sort(codes.begin(), codes.end());
    }

  private:
    const std::vector<float>& values_;
    std::vector<double> sums_, squares_;  // of all values before each
};

constexpr size_t kLanes = 8;

/// Centroids in blocks, so that points are compared with several centroids at once.
class Centroids {
  public:
    Centroids(const std::vector<float>& rows, size_t dimensions)
        : dimensions_(dimensions), count_(rows.size() / dimensions) {
        const size_t blocks = (count_ + kLanes - 1) / kLanes;
        values_.resize(blocks * dimensions * kLanes);
        halves_.resize(blocks * kLanes, std::numeric_limits<float>::infinity());
        for (size_t c = 0; c < count_; ++c) {
            double sum = 0;
            for (size_t d = 0; d < dimensions; ++d) {
                const float v = rows[c * dimensions + d];
                values_[(c / kLanes * dimensions + d) * kLanes + c % kLanes] = v;
                sum += double(v) * v;
            }
            halves_[c] = float(sum / 2);
        }
    }

    /// The nearest centroid of each of `count` points, the first of several; |c|^2 / 2 - c x of it goes to
    /// `scores`. Point i is points(i).
    template <class Points>
    void nearest_to(size_t count, const Points& points, uint32_t* labels, float* scores) const {
        size_t i = 0;
        for (; i + kAtOnce <= count; i += kAtOnce) {
            const float* x[kAtOnce];
            for (size_t p = 0; p < kAtOnce; ++p) x[p] = points(i + p);
            find<kAtOnce>(x, labels + i, scores + i);
        }
        for (; i < count; ++i) {
            const float* x = points(i);
            find<1>(&x, labels + i, scores + i);
        }
    }

  private:
    static constexpr size_t kAtOnce = 4;  // points, which share what is read of the centroids

    template <size_t N>
    void find(const float* const* x, uint32_t* labels, float* scores) const {
        std::fill_n(scores, N, std::numeric_limits<float>::infinity());
        std::fill_n(labels, N, 0u);
        for (size_t block = 0; block * kLanes < count_; ++block) {
            float sums[N][kLanes];
            for (size_t p = 0; p < N; ++p) std::copy_n(&halves_[block * kLanes], kLanes, sums[p]);
            const float* values = &values_[block * dimensions_ * kLanes];
            for (size_t d = 0; d < dimensions_; ++d, values += kLanes)
                for (size_t p = 0; p < N; ++p) {
                    const float factor = x[p][d];
                    for (size_t lane = 0; lane < kLanes; ++lane) sums[p][lane] -= factor * values[lane];
                }
            for (size_t p = 0; p < N; ++p)
                for (size_t lane = 0; lane < kLanes; ++lane)
                    if (sums[p][lane] < scores[p]) {
                        scores[p] = sums[p][lane];
                        labels[p] = uint32_t(block * kLanes + lane);
                    }
        }
    }

    size_t dimensions_, count_;
    std::vector<float> values_, halves_;
};

double squared_length(const float* x, size_t dimensions) {
    double sum = 0;
    for (size_t d = 0; d < dimensions; ++d) sum += double(x[d]) * x[d];
    return sum;
}

/// The members in `k` clusters. `errors` gets the squared distance of each to its row.
struct Clusters {
    std::vector<float> rows;
    std::vector<uint32_t> labels;
    std::vector<double> errors;
};

void assign(const VectorTable& vectors, std::span<const uint32_t> members, Clusters& clusters) {
    std::vector<float> scores(members.size());
    Centroids(clusters.rows, vectors.dimensions)
        .nearest_to(
            members.size(), [&](size_t m) { return vectors[members[m]]; }, clusters.labels.data(),
            scores.data());
    for (size_t m = 0; m < members.size(); ++m)
        clusters.errors[m] =
            std::max(0.0, squared_length(vectors[members[m]], vectors.dimensions) + 2 * double(scores[m]));
}

/// Rows become the means of their members. A row without members becomes one of the worst members.
void update(const VectorTable& vectors, std::span<const uint32_t> members, Clusters& clusters) {
    const size_t dimensions = vectors.dimensions, k = clusters.rows.size() / dimensions;
    std::vector<double> sums(k * dimensions);
    std::vector<uint32_t> counts(k);
    for (size_t m = 0; m < members.size(); ++m) {
        const float* x = vectors[members[m]];
        double* sum = &sums[clusters.labels[m] * dimensions];
        for (size_t d = 0; d < dimensions; ++d) sum[d] += x[d];
        ++counts[clusters.labels[m]];
    }
    const auto empty = size_t(std::count(counts.begin(), counts.end(), 0u));
    std::vector<uint32_t> worst(empty > 0 ? members.size() : 0);
    std::iota(worst.begin(), worst.end(), 0u);
    if (empty > 0)
        std::partial_sort(
            worst.begin(), worst.begin() + std::ptrdiff_t(empty), worst.end(), [&](uint32_t a, uint32_t b) {
                return clusters.errors[a] != clusters.errors[b] ? clusters.errors[a] > clusters.errors[b]
                                                                : a < b;
            });
    size_t next = 0;
    for (size_t c = 0; c < k; ++c) {
        float* row = &clusters.rows[c * dimensions];
        if (counts[c] == 0)
            std::copy_n(vectors[members[worst[next++]]], dimensions, row);
        else
            for (size_t d = 0; d < dimensions; ++d) row[d] = float(sums[c * dimensions + d] / counts[c]);
    }
}

/// Lloyd's iterations from members at even distances, which are spread in space if the members are ordered by
/// place. 1 <= k <= members.
Clusters cluster(const VectorTable& vectors, std::span<const uint32_t> members, size_t k, int iterations) {
    Clusters clusters;
    clusters.labels.resize(members.size());
    clusters.errors.resize(members.size());
    clusters.rows.resize(k * vectors.dimensions);
    for (size_t c = 0; c < k; ++c)
        std::copy_n(vectors[members[c * members.size() / k]], vectors.dimensions,
                    &clusters.rows[c * vectors.dimensions]);
    if (k == members.size()) {
        std::iota(clusters.labels.begin(), clusters.labels.end(), 0u);
        return clusters;
    }
    for (int i = 0; i < iterations; ++i) {
        assign(vectors, members, clusters);
        update(vectors, members, clusters);
    }
    assign(vectors, members, clusters);
    return clusters;
}

/// How many rows each group gets: one, and the others by the groups' errors, but no more than it has members.
std::vector<size_t> shares_of(size_t rows, const std::vector<double>& errors,
                              const std::vector<size_t>& sizes) {
    std::vector<size_t> shares(sizes.size());
    for (size_t g = 0; g < sizes.size(); ++g) shares[g] = std::min<size_t>(1, sizes[g]);
    size_t left = rows - std::accumulate(shares.begin(), shares.end(), size_t(0));
    // A group that is full leaves its share to the others.
    constexpr int kRounds = 8;
    for (int round = 0; round < kRounds && left > 0; ++round) {
        double total = 0;
        for (size_t g = 0; g < sizes.size(); ++g) total += shares[g] < sizes[g] ? errors[g] : 0;
        if (!(total > 0) || !std::isfinite(total)) break;  // not finite: values beyond 1e19
        const auto budget = double(left);
        for (size_t g = 0; g < sizes.size(); ++g) {
            const size_t more = std::min({size_t(budget * errors[g] / total), sizes[g] - shares[g], left});
            shares[g] += more;
            left -= more;
        }
    }
    return shares;
}

/// The members of each of the groups that are nearest to them, with the error of each group.
struct Groups {
    std::vector<std::vector<uint32_t>> members;
    std::vector<double> errors;
};

Groups group(const VectorTable& vectors, size_t count) {
    constexpr size_t kSamples = 64;  // per group
    constexpr int kIterations = 8;
    const size_t samples = std::min(vectors.count, kSamples * count);
    std::vector<uint32_t> sample(samples);
    for (size_t i = 0; i < samples; ++i) sample[i] = uint32_t(i * vectors.count / samples);
    const Clusters coarse = cluster(vectors, sample, count, kIterations);

    const Centroids centroids(coarse.rows, vectors.dimensions);
    std::vector<uint32_t> labels(vectors.count);
    std::vector<float> scores(vectors.count);
    constexpr size_t kPiece = 4096;
    core::on_all_cores((vectors.count + kPiece - 1) / kPiece, [&](size_t piece) {
        const size_t begin = piece * kPiece, end = std::min(vectors.count, begin + kPiece);
        centroids.nearest_to(
            end - begin, [&](size_t i) { return vectors[begin + i]; }, &labels[begin], &scores[begin]);
    });
    Groups groups;
    groups.members.resize(count);
    groups.errors.resize(count);
    for (size_t i = 0; i < vectors.count; ++i) {
        groups.members[labels[i]].push_back(uint32_t(i));
        groups.errors[labels[i]] +=
            std::max(0.0, squared_length(vectors[i], vectors.dimensions) + 2 * double(scores[i]));
    }
    return groups;
}

}  // namespace

std::array<float, 256> make_codebook(std::vector<float> values) {
    assert(!values.empty());
    std::sort(values.begin(), values.end());
    std::vector<float> distinct;
    for (size_t i = 0; i < values.size() && distinct.size() <= kCodes; ++i)
        if (i == 0 || values[i] != values[i - 1]) distinct.push_back(values[i]);
    std::array<float, kCodes> codes;
    if (distinct.size() <= kCodes) {
        codes.fill(distinct.back());
        std::copy(distinct.begin(), distinct.end(), codes.begin());
        return codes;
    }
    Cells cells(values);
    codes = first_codes(values);
    constexpr int kIterations = 40;
    for (int round = 0; round < kIterations; ++round) cells.improve(codes);
    if (std::binary_search(values.begin(), values.end(), 0.0f)) codes[nearest(codes, 0)] = 0;
    return codes;
}

uint8_t nearest(const std::array<float, 256>& codebook, float value) {
    const auto above = std::lower_bound(codebook.begin(), codebook.end(), value);
    if (above == codebook.begin()) return 0;
    const auto below = std::lower_bound(codebook.begin(), above, *(above - 1));
    const bool upper =
        above != codebook.end() && double(*above) - double(value) < double(value) - double(*below);
    return uint8_t((upper ? above : below) - codebook.begin());
}

Palette make_palette(const VectorTable& vectors, size_t most) {
    assert(most > 0);
    Palette palette;
    palette.labels.resize(vectors.count);
    if (vectors.count <= most) {
        for (size_t i = 0; i < vectors.count; ++i)
            palette.rows.insert(palette.rows.end(), vectors[i], vectors[i] + vectors.dimensions);
        std::iota(palette.labels.begin(), palette.labels.end(), 0u);
        return palette;
    }
    const auto count = size_t(std::sqrt(double(most)));
    const Groups groups = group(vectors, count);
    std::vector<size_t> sizes;
    for (const auto& members : groups.members) sizes.push_back(members.size());
    const std::vector<size_t> shares = shares_of(most, groups.errors, sizes);
    std::vector<Clusters> fine(count);
    constexpr int kIterations = 5;
    core::on_all_cores(count, [&](size_t g) {
        if (shares[g] > 0) fine[g] = cluster(vectors, groups.members[g], shares[g], kIterations);
    });
    for (size_t g = 0; g < count; ++g) {
        const size_t first = palette.rows.size() / vectors.dimensions;
        palette.rows.insert(palette.rows.end(), fine[g].rows.begin(), fine[g].rows.end());
        for (size_t m = 0; m < sizes[g]; ++m)
            palette.labels[groups.members[g][m]] = uint32_t(first + fine[g].labels[m]);
    }
    return palette;
}

}  // namespace ewa::io
