// SPDX-License-Identifier: Apache-2.0
// What the reader and the writer of SPZ share.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "ewa/gaussians.h"

namespace ewa::io::spz {

inline constexpr uint32_t kMagic = 0x5053474e;                       // "NGSP"
inline constexpr size_t kHeaderBytes = 16, kPackedHeaderBytes = 32;  // versions 1 to 3; version 4
inline constexpr uint8_t kAntialiased = 1, kHasExtensions = 2;       // flags
inline constexpr int kMaxFileDegree = 4;
inline constexpr unsigned kMaxFractionalBits = 24;
inline constexpr double kColorScale = 0.15 * 255, kColorOffset = 0.5 * 255;
inline constexpr double kScaleSteps = 16, kScaleOffset = 10;
inline constexpr double kShSteps = 128;
inline constexpr uint32_t kRotationSteps = 511;

enum Block { positions, opacities, colors, scales, rotations, sh, kBlocks };
inline constexpr const char* kBlockNames[kBlocks] = {"the positions", "the opacities", "the colours",
                                                     "the scales",    "the rotations", "the SH coefficients"};

/// Bytes of a block a splat.
constexpr std::array<size_t, kBlocks> block_bytes(uint32_t version, int file_degree) {
    return {version == 1 ? size_t(6) : size_t(9),          1, 3, 3, version >= 3 ? size_t(4) : size_t(3),
            3 * (size_t(sh_coefficients(file_degree)) - 1)};
}

/// Signs of means, of the quaternion's x y z, and of the SH basis (from coefficient 1) when y and z change
/// theirs.
inline constexpr std::array<int, 3> kFlip = {1, -1, -1};
inline constexpr std::array<int, 15> kFlipSh = {-1, -1, 1, -1, 1, 1, -1, 1, -1, 1, -1, -1, 1, -1, 1};

}  // namespace ewa::io::spz
