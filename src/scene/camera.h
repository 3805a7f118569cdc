// SPDX-License-Identifier: Apache-2.0
// Cameras: paths between them, and the aspect ratio of their images.
#pragma once
#include <cstdint>
#include <span>

#include "ewa/camera.h"

namespace ewa {

/// The camera at `time` on a path through at least one key. Key i is at time i; before the first key and
/// after the last one the camera stays. Positions follow a uniform Catmull-Rom spline (Catmull and Rom 1974),
/// which is straight at its ends. Rotations follow the shortest great arc. Focal lengths are geometric means,
/// relative to the width. Size and relative principal point are the first key's, and the shutter is global.
Camera along_path(std::span<const Camera> keys, double time);

/// The same with key i at times[i] (s), of which each is later than the one before. smooth: the velocity has no jumps at the keys,
/// and with equal distances in time the path is that of the other function. Else the camera goes from key to key in straight lines.
Camera along_path(std::span<const Camera> keys, std::span<const double> times, double time, bool smooth);

/// The camera, or, if its image is wider than most_width px, the same view reduced to that width. The rounded height keeps the
/// aspect ratio.
Camera narrowed(const Camera& camera, int64_t most_width);

/// Whether an image of the new size is the old one resized by one factor, with each side rounded to a whole pixel. Sizes that
/// differ by only a pixel or so do not match: such an image was cropped, or is of another camera.
bool same_aspect(int old_width, int old_height, int width, int height);

}  // namespace ewa
