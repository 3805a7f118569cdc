// SPDX-License-Identifier: Apache-2.0
// Invocations that the passes of the loss take a plane.
#pragma once
#include <cstdint>

#include "shared/layouts.h"

namespace ewa::passes {

/// Of a pass down the columns. stride: floats a row, a multiple of 4.
inline uint64_t loss_column_items(uint32_t stride, uint32_t height) {
    return uint64_t(stride / 4) * ((height + shared::LOSS_ROWS - 1) / shared::LOSS_ROWS);
}

/// Of a pass along the rows.
inline uint64_t loss_row_items(uint32_t stride, uint32_t height) {
    return uint64_t((stride / 4 + shared::LOSS_TEXELS - 1) / shared::LOSS_TEXELS) * height;
}

}  // namespace ewa::passes
