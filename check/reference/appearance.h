// SPDX-License-Identifier: Apache-2.0
// The appearance of a training image, and gradients through it.
//
// PPISP, after its publication: a pixel's colour c is multiplied by 2^exposure, then by the vignette
//   clamp(1 + a0 r^2 + a1 r^4 + a2 r^6, 0, 1)
// of each channel, then mapped by a homography of (R, G, I), I = R + G + B, with the intensity kept, then by the response of
// each channel. The homography maps blue (0, 0), red (1, 0), green (0, 1) and grey (1/3, 1/3) to these colours with offsets:
//   T = their targets as columns, M = [grey]x T, lambda the longest cross product of two rows of M,
//   H = T diag(lambda) S^-1, divided by its last entry.
//
// A bilateral grid: c' = A (c, 1), where A is interpolated between the cells around (x, y, grey of c).
#pragma once
#include <array>
#include <vector>

#include "reference/values.h"

namespace ewa::reference {

using PpispPhoto = std::array<double, 9>;    // as Ppisp::photo
using PpispCamera = std::array<double, 27>;  // as Ppisp::camera

Raster ppisp(const Raster& image, const PpispPhoto& photo, const PpispCamera& camera);

struct PpispGradient {
    Raster image;  // dL/d(image)
    PpispPhoto photo{};
    PpispCamera camera{};
};
/// `image` is the image before, `gradient` is dL/d(image after).
PpispGradient ppisp_backward(const Raster& image, const PpispPhoto& photo, const PpispCamera& camera,
                             const Raster& gradient);

/// The penalties of the means over photos, and of a camera.
double ppisp_penalty(const PpispPhoto& means);
double ppisp_penalty(const PpispCamera& camera);

using Grid = std::vector<double>;  // as ColorGrid::cells
Raster sliced(const Raster& image, const Grid& grid);

struct GridGradient {
    Raster image;
    Grid grid;
};
GridGradient sliced_backward(const Raster& image, const Grid& grid, const Raster& gradient);

/// The weighted total variation, and its gradient.
double grid_variation(const Grid& grid);
Grid grid_variation_gradient(const Grid& grid);

}  // namespace ewa::reference
