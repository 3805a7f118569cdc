// SPDX-License-Identifier: Apache-2.0
#include "image/lpips.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/parallel.h"
#include "ewa/error.h"
#include "image/metric.h"

// Compiled for several kinds of processors; the fastest that runs here is taken. All give the same bits: each sum has its own
// lane, and no multiplication is fused with an addition.
#if defined(__x86_64__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define EWA_EVERY_PROCESSOR __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define EWA_EVERY_PROCESSOR
#endif

namespace ewa::image {

// The sums of kTogether filters over kLanes pixels: of columns [terms][kLanes] times weights [terms][kTogether].
EWA_EVERY_PROCESSOR void lpips_sums(const float* columns, const float* weights, size_t terms, float* sums);

namespace {

constexpr size_t kLanes = 16, kTogether = 4;
typedef float Lanes __attribute__((vector_size(4 * kLanes)));

constexpr LpipsLayer kVgg[] = {
    {"0", 64, 3, 1, 1, 0, false},  {"2", 64, 3, 1, 1, 0, true},    {"5", 128, 3, 1, 1, 2, false},
    {"7", 128, 3, 1, 1, 0, true},  {"10", 256, 3, 1, 1, 2, false}, {"12", 256, 3, 1, 1, 0, false},
    {"14", 256, 3, 1, 1, 0, true}, {"17", 512, 3, 1, 1, 2, false}, {"19", 512, 3, 1, 1, 0, false},
    {"21", 512, 3, 1, 1, 0, true}, {"24", 512, 3, 1, 1, 2, false}, {"26", 512, 3, 1, 1, 0, false},
    {"28", 512, 3, 1, 1, 0, true},
};
constexpr LpipsLayer kAlex[] = {
    {"0", 64, 11, 4, 2, 0, true}, {"3", 192, 5, 1, 2, 3, true},  {"6", 384, 3, 1, 1, 3, true},
    {"8", 256, 3, 1, 1, 0, true}, {"10", 256, 3, 1, 1, 0, true},
};

/// The output of a layer: [channel][y][x].
struct Maps {
    int width = 0, height = 0, channels = 0;
    std::vector<float> values;

    Maps(int width_, int height_, int channels_)
        : width(width_),
          height(height_),
          channels(channels_),
          values(size_t(std::max(0, width_)) * size_t(std::max(0, height_)) * size_t(channels_)) {}
    const float* row(int channel, int y) const {
        return &values[(size_t(channel) * size_t(height) + size_t(y)) * size_t(width)];
    }
    float* row(int channel, int y) {
        return &values[(size_t(channel) * size_t(height) + size_t(y)) * size_t(width)];
    }
};

/// The image as the networks were trained on it.
Maps network_input(const Image& image, bool unit_range) {
    constexpr std::array<float, 3> kShift = {-0.030f, -0.088f, -0.188f}, kScale = {0.458f, 0.448f, 0.450f};
    Maps maps(image.width, image.height, 3);
    for (int c = 0; c < 3; ++c)
        for (int y = 0; y < image.height; ++y)
            for (int x = 0; x < image.width; ++x) {
                const float value = std::clamp(image.at(x, y)[c], 0.0f, 1.0f);
                maps.row(c, y)[x] =
                    ((unit_range ? value : 2 * value - 1) - kShift[size_t(c)]) / kScale[size_t(c)];
            }
    return maps;
}

Maps pooled(const Maps& from, int side) {
    Maps result((from.width - side) / 2 + 1, (from.height - side) / 2 + 1, from.channels);
    if (from.width < side || from.height < side) return {0, 0, from.channels};
    core::on_all_cores(size_t(from.channels), [&](size_t channel) {
        const int c = int(channel);
        for (int y = 0; y < result.height; ++y)
            for (int x = 0; x < result.width; ++x) {
                float most = from.row(c, 2 * y)[2 * x];
                for (int j = 0; j < side; ++j)
                    for (int i = 0; i < side; ++i) most = std::max(most, from.row(c, 2 * y + j)[2 * x + i]);
                result.row(c, y)[x] = most;
            }
    });
    return result;
}

/// What a row of the result multiplies with the filters: [tile][channel, row and column of the filter][pixel of the tile].
std::vector<float> columns_of(const Maps& from, const LpipsLayer& layer, int y, int width) {
    const size_t tiles = (size_t(width) + kLanes - 1) / kLanes;
    std::vector<float> columns(tiles * size_t(from.channels * layer.kernel * layer.kernel) * kLanes, 0.0f);
    float* to = columns.data();
    for (size_t tile = 0; tile < tiles; ++tile)
        for (int c = 0; c < from.channels; ++c)
            for (int j = 0; j < layer.kernel; ++j) {
                const int from_y = y * layer.stride + j - layer.padding;
                const bool inside = from_y >= 0 && from_y < from.height;
                for (int i = 0; i < layer.kernel; ++i, to += kLanes) {
                    if (!inside) continue;
                    const float* row = from.row(c, from_y);
                    const int first = int(tile * kLanes) * layer.stride + i - layer.padding;
                    if (layer.stride == 1 && first >= 0 && first + int(kLanes) <= from.width) {
                        std::copy_n(row + first, kLanes, to);
                        continue;
                    }
                    for (int k = 0; k < int(kLanes); ++k) {
                        const int x = first + k * layer.stride;
                        if (x >= 0 && x < from.width) to[k] = row[x];
                    }
                }
            }
    return columns;
}

Maps convolved(const Maps& from, const LpipsLayer& layer, const std::vector<float>& packed,
               const std::vector<float>& bias) {
    const auto size = [&](int side) { return (side + 2 * layer.padding - layer.kernel) / layer.stride + 1; };
    if (from.values.empty() || from.width + 2 * layer.padding < layer.kernel ||
        from.height + 2 * layer.padding < layer.kernel)
        return {0, 0, layer.channels};
    Maps result(size(from.width), size(from.height), layer.channels);
    const size_t terms = size_t(from.channels * layer.kernel * layer.kernel);
    core::on_all_cores(size_t(result.height), [&](size_t y) {
        const std::vector<float> columns = columns_of(from, layer, int(y), result.width);
        std::array<float, kTogether * kLanes> sums;
        for (int c = 0; c < layer.channels; c += int(kTogether))
            for (int x = 0; x < result.width; x += int(kLanes)) {
                lpips_sums(&columns[size_t(x) * terms], &packed[size_t(c) * terms], terms, sums.data());
                const int count = std::min(int(kLanes), result.width - x);
                for (int k = 0; k < int(kTogether); ++k)
                    for (int i = 0; i < count; ++i)
                        result.row(c + k, int(y))[x + i] =
                            std::max(0.0f, sums[size_t(k) * kLanes + size_t(i)] + bias[size_t(c + k)]);
            }
    });
    return result;
}

/// Weights of a layer's pixels: means over the pixels that lie in the same place.
Image weights_of_layer(const Image& weights, int width, int height) {
    Image result;
    if (weights.pixels.empty()) return result;
    result = Image(width, height, 1);
    const auto begin = [](int i, int from, int to) { return int(int64_t(i) * from / to); };
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const int top = begin(y, weights.height, height), left = begin(x, weights.width, width);
            const int bottom = std::max(top + 1, begin(y + 1, weights.height, height));
            const int right = std::max(left + 1, begin(x + 1, weights.width, width));
            double sum = 0;
            for (int j = top; j < bottom; ++j)
                for (int i = left; i < right; ++i) sum += double(*weights.at(i, j));
            *result.at(x, y) = float(sum / ((bottom - top) * (right - left)));
        }
    return result;
}

/// Mean over the pixels of the weighted squared differences between the maps, each normalised over its channels.
double layer_distance(const Maps& a, const Maps& b, const std::vector<float>& scores, const Image& weights) {
    constexpr double kEpsilon = 1e-10;
    const Image of_layer = weights_of_layer(weights, a.width, a.height);
    std::vector<double> rows(size_t(a.height)), counts(rows.size());
    core::on_all_cores(rows.size(), [&](size_t row) {
        const int y = int(row);
        const auto inverse_norms = [&](const Maps& maps) {
            std::vector<double> norms(size_t(a.width), 0.0);
            for (int c = 0; c < maps.channels; ++c)
                for (size_t x = 0; x < norms.size(); ++x)
                    norms[x] += double(maps.row(c, y)[x]) * double(maps.row(c, y)[x]);
            for (double& norm : norms) norm = 1 / (std::sqrt(norm) + kEpsilon);
            return norms;
        };
        const std::vector<double> of_a = inverse_norms(a), of_b = inverse_norms(b);
        std::vector<double> sums(size_t(a.width), 0.0);
        for (int c = 0; c < a.channels; ++c)
            for (size_t x = 0; x < sums.size(); ++x) {
                const double difference = double(a.row(c, y)[x]) * of_a[x] - double(b.row(c, y)[x]) * of_b[x];
                sums[x] += double(scores[size_t(c)]) * difference * difference;
            }
        for (int x = 0; x < a.width; ++x) {
            const double weight = weight_at(of_layer, x, y);
            rows[row] += weight * sums[size_t(x)];
            counts[row] += weight;
        }
    });
    double sum = 0, count = 0;
    for (size_t y = 0; y < rows.size(); ++y) {
        sum += rows[y];
        count += counts[y];
    }
    return count == 0 ? std::numeric_limits<double>::quiet_NaN() : sum / count;
}

/// The tensor of this name and number of values.
const std::vector<float>& tensor_values(const std::map<std::string, Tensor>& weights, const std::string& name,
                                        uint64_t count, const std::string& file) {
    const auto found = weights.find(name);
    if (found == weights.end())
        throw InputError(file + ": has no tensor \"" + name + "\"; scripts/lpips-weights makes such a file");
    if (found->second.values.size() != count)
        throw InputError(file + ": \"" + name + "\" has " + std::to_string(found->second.values.size()) +
                         " values, not " + std::to_string(count));
    return found->second.values;
}

}  // namespace

void lpips_sums(const float* columns, const float* weights, size_t terms, float* sums) {
    Lanes s0{}, s1{}, s2{}, s3{};
    for (size_t k = 0; k < terms; ++k, columns += kLanes, weights += kTogether) {
        Lanes column;
        std::memcpy(&column, columns, sizeof(column));
        s0 += column * weights[0];
        s1 += column * weights[1];
        s2 += column * weights[2];
        s3 += column * weights[3];
    }
    std::memcpy(sums, &s0, sizeof(s0));
    std::memcpy(sums + kLanes, &s1, sizeof(s1));
    std::memcpy(sums + 2 * kLanes, &s2, sizeof(s2));
    std::memcpy(sums + 3 * kLanes, &s3, sizeof(s3));
}

Lpips::Lpips(Network network, const std::map<std::string, Tensor>& weights, const std::string& file,
             bool unit_range)
    : unit_range_(unit_range) {
    const std::string prefix = network == Network::vgg ? "vgg." : "alex.";
    const std::span<const LpipsLayer> layers =
        network == Network::vgg ? std::span<const LpipsLayer>(kVgg) : std::span<const LpipsLayer>(kAlex);
    int inputs = 3, compared = 0;
    for (const LpipsLayer& layer : layers) {
        Filters filters{layer, inputs, {}, {}, {}};
        const std::string name = prefix + "features." + layer.name, weight = name + ".weight";
        const size_t terms = size_t(inputs * layer.kernel * layer.kernel);
        const std::vector<float>& values =
            tensor_values(weights, weight, terms * size_t(layer.channels), file);
        filters.packed.resize(values.size());
        for (size_t c = 0; c < size_t(layer.channels); ++c)
            for (size_t k = 0; k < terms; ++k)
                filters.packed[(c / kTogether * terms + k) * kTogether + c % kTogether] =
                    values[c * terms + k];
        filters.bias = tensor_values(weights, name + ".bias", uint64_t(layer.channels), file);
        if (layer.compared)
            filters.scores = tensor_values(weights, prefix + "lin." + std::to_string(compared++) + ".weight",
                                           uint64_t(layer.channels), file);
        layers_.push_back(std::move(filters));
        inputs = layer.channels;
    }
}

double Lpips::distance(const Image& a, const Image& b, const Image& weights) const {
    compared_channels(a, b);
    weight_sum(weights, a);
    Maps first = network_input(pulled_onto(a, b, weights), unit_range_),
         second = network_input(b, unit_range_);
    double sum = 0;
    for (const Filters& filters : layers_) {
        for (Maps* maps : {&first, &second}) {
            if (filters.layer.pool > 0) *maps = pooled(*maps, filters.layer.pool);
            *maps = convolved(*maps, filters.layer, filters.packed, filters.bias);
        }
        if (first.values.empty()) return std::numeric_limits<double>::quiet_NaN();
        if (filters.layer.compared) sum += layer_distance(first, second, filters.scores, weights);
    }
    return sum;
}

}  // namespace ewa::image
