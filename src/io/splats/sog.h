// SPDX-License-Identifier: Apache-2.0
// SOG (PlayCanvas): images with a pixel per splat, and a JSON file that names them. All are in one zip archive
// (.sog), or in one folder. Pixel i, row by row from the top, is splat i; the pixels after the last splat
// count for nothing. Images are lossless WebP with 8 bits a channel:
//   means_l, means_u   the low and high bytes of x y z in r g b. Their 16 bits span means.mins .. means.maxs of
//                      sign(v) ln(1 + |v|)
//   quats              the largest of w x y z is not stored, and positive: a = 252 + its index; r g b are the
//                      others in order, c as 255 (c / sqrt(2) + 0.5)
//   scales             r g b index a table of 256 logarithms of scales
//   sh0                r g b index a table of 256 SH coefficients; a = 255 * opacity
//   shN_labels         r + 256 g is the splat's row of the palette
//   shN_centroids      the palette: 64 rows of it in each row of the image, a pixel per coefficient from degree
//                      1 on; r g b index a table of 256 values
// Version 1 has no tables: scales, colours and opacities (as logits) span mins .. maxs of their channel, the
// palette spans shN.mins .. shN.maxs. Its means.shape[0] is the number of splats.
// The frame is that of an INRIA PLY.
#pragma once
#include <array>
#include <cstdint>
#include <string>

namespace ewa::io {

using SogTable = std::array<float, 256>;

inline constexpr int kFirstRotation = 252;  // the alpha of a rotation whose largest component is w
inline constexpr uint64_t kPaletteRow = 64, kMostPalette = 65536;
inline constexpr const char* kSogMeta = "meta.json";
/// In the order of kSogImages.
enum class SogImage {
    means_low,
    means_high,
    scale_codes,
    rotation_bytes,
    color_codes,
    palette_codes,
    labels
};
inline constexpr std::array<const char*, 7> kSogImages = {
    "means_l.webp", "means_u.webp",       "scales.webp",    "quats.webp",
    "sh0.webp",     "shN_centroids.webp", "shN_labels.webp"};

}  // namespace ewa::io
