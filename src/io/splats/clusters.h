// SPDX-License-Identifier: Apache-2.0
// Quantises values by k-means, to tables of scalars and palettes of vectors. Results depend only on the
// input, not on the number of threads: sums have a fixed order, and no random numbers are drawn.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace ewa::io {

/// 256 values in ascending order that are near all given ones: the values themselves if no more than 256
/// differ. 0 is one of them if it is one of the values, so that absent coefficients stay absent. At least one value, all
/// finite.
std::array<float, 256> make_codebook(std::vector<float> values);

/// The index of the nearest value of a codebook; the lower one of two.
uint8_t nearest(const std::array<float, 256>& codebook, float value);

/// VectorTable in memory: vector i is the `dimensions` values from data + i * stride.
struct VectorTable {
    const float* data = nullptr;
    size_t count = 0, stride = 0, dimensions = 0;
    const float* operator[](size_t i) const { return data + i * stride; }
};

struct Palette {
    std::vector<float> rows;       // one vector after another
    std::vector<uint32_t> labels;  // the row of each vector
};

/// A palette of at most `most` rows: the vectors themselves if there are no more. Else k-means in two levels,
/// of about sqrt(most) groups and of the rows in each. One level would take sqrt(most) times as long and has
/// a few percent less error.
Palette make_palette(const VectorTable& vectors, size_t most);

}  // namespace ewa::io
