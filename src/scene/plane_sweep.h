// SPDX-License-Identifier: Apache-2.0
// The depth of each pixel of an image, from other images of the same scene: the plane sweep of Collins 1996 with normalised
// cross-correlation.
#pragma once
#include <span>
#include <vector>

#include "ewa/camera.h"
#include "ewa/image.h"

namespace ewa::scene {

/// A grey image, one channel, and its camera: a pinhole of the same size.
struct SweptImage {
    Image gray;
    Camera camera;
};

/// Planes across the reference camera's axis, evenly spaced in inverse depth.
struct SweepPlanes {
    double most = 0;  // largest inverse depth, 1 / world unit; the smallest is 0
    int count = 0;    // at least 3
};

/// Depths at each pixel of the reference image, row-major.
struct SweptDepths {
    std::vector<float> inverse;  // of view z, 1 / world unit; 0: none
    std::vector<float> score;    // the correlation at that depth, -1 to 1; -1: no depth
};

/// Each plane shows the other images as the reference camera would see them if the scene were that plane. A pixel's score on a
/// plane is the correlation of 5 x 5 px with the reference image: the mean of the two images that agree best, smoothed over 3 x 3
/// px. The pixel takes the plane of the best score, moved to the peak of a parabola through the scores beside it. A pixel without
/// texture has none, nor has one whose best plane is the first or last. others: at least one.
SweptDepths sweep_planes(const SweptImage& reference, std::span<const SweptImage* const> others,
                         const SweepPlanes& planes);

}  // namespace ewa::scene
