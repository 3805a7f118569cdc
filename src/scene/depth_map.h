// SPDX-License-Identifier: Apache-2.0
// Depth maps of training images.
#pragma once
#include "ewa/dataset.h"
#include "ewa/image.h"

namespace ewa {

/// The frame's depth map as `frame.camera` sees it: one channel of view z in world units, 0 where the file has no depth
/// (0, negative, or not finite). Depths are those of the nearest pixels in the file, which may have another size than the
/// image. frame.depth_path: not empty. Throws InputError, also where the frame's lens is neither a pinhole nor OpenCV's
/// perspective model, which is undistorted.
Image load_depth_map(const Frame& frame);

/// Sets the depth to 0 where the photo's alpha, a mask's too, is below a half. Both of one size.
void drop_masked(Image& depths, const Image& photo);

}  // namespace ewa
