// SPDX-License-Identifier: Apache-2.0
// What training learns beside the splats: tables of values with Adam's moments, on the device.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "gpu/buffer.h"

namespace ewa::pipeline {

/// Values with Adam's moments of each. A row has those of one training image alone. Values of several images come after the rows;
/// a view of a step leaves its part of their gradient in its slot.
struct LearnedTable {
    struct Layout {
        std::string name, moments;  // of the arrays in checkpoints: moments1 is called moments + "1"
        uint32_t row_floats = 0;    // of a training image
        uint32_t slot_floats = 0;   // of a view of a step
        uint32_t views = 0;         // of a step at most
    };
    /// An array of a checkpoint.
    struct Array {
        std::string name;
        gpu::Buffer* buffer;
        uint64_t bytes;
    };

    Layout layout;
    uint64_t floats = 0;
    gpu::Buffer values, moments1, moments2;
    gpu::Buffer slots;  // without a buffer if they have no floats

    LearnedTable() = default;
    /// start: the first values. The moments are 0. Floats of a row and of a slot are even.
    LearnedTable(gpu::Device& device, Layout layout, std::span<const float> start);

    bool empty() const { return floats == 0; }
    uint64_t bytes() const { return 4 * floats; }  // of values and of each moment
    std::vector<float> download() const { return values.download<float>(floats); }
    std::vector<Array> arrays();

    /// What a step learns of a view, for other ranks: the row of its image with its moments, and its slot.
    size_t words_of_view() const { return (3ull * layout.row_floats + layout.slot_floats) / 2; }
    std::vector<uint64_t> words(uint32_t row, uint32_t slot) const;
    void set(uint32_t row, uint32_t slot, std::span<const uint64_t> words);
};

}  // namespace ewa::pipeline
