// SPDX-License-Identifier: Apache-2.0
// Values that training learns beside the splats: tables with Adam's moments, on the device.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "gpu/buffer.h"

namespace ewa::pipeline {

/// A table of values with Adam's moments. It has a row of values for each training image, then values that several images share.
/// Each view of a step writes its gradient with respect to the shared values into its own slot.
struct LearnedTable {
    struct Layout {
        std::string name, moments;  // of the arrays in checkpoints: moments1 is called moments + "1"
        uint32_t row_floats = 0;    // values of a training image
        uint32_t slot_floats = 0;   // floats of a view's gradient with respect to shared values
        uint32_t views = 0;         // the most views of a step
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
    gpu::Buffer slots;  // empty without slot_floats

    LearnedTable() = default;
    /// start: the first values. Moments start at 0. Numbers of floats in a row and in a slot must be even.
    LearnedTable(gpu::Device& device, Layout layout, std::span<const float> start);

    bool empty() const { return floats == 0; }
    uint64_t bytes() const { return 4 * floats; }  // of values and of each moment
    std::vector<float> download() const { return values.download<float>(floats); }
    std::vector<Array> arrays();

    /// The results of a view for other ranks, as 64-bit words for Ranks::gather: its image's row with moments, and the view's slot.
    size_t words_of_view() const { return (3ull * layout.row_floats + layout.slot_floats) / 2; }
    std::vector<uint64_t> words(uint32_t row, uint32_t slot) const;
    void set(uint32_t row, uint32_t slot, std::span<const uint64_t> words);
};

}  // namespace ewa::pipeline
