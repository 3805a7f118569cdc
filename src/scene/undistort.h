// SPDX-License-Identifier: Apache-2.0
// The pinhole picture in a lens's picture.
#pragma once
#include "ewa/camera.h"
#include "ewa/dataset.h"
#include "ewa/image.h"

namespace ewa::scene {

/// The pinhole camera of the same pose and focal lengths whose picture is as large as the source covers
/// without a blank pixel, as COLMAP's image_undistorter chooses it (blank_pixels 0, sizes between 0.2 and 2
/// times the source's; COLMAP, src/colmap/image/undistortion.cc): the border's pixel centres are undistorted,
/// and on each axis the picture shrinks or grows about the principal point, all in one ratio, until the
/// nearer border fits. Border pixels that no ray in front reaches do not count. Where the rectangle then
/// still leaves the source at a corner (a fisheye's circle), it shrinks on both axes until it does not. A
/// camera without distortion comes back as it is. Throws InputError where no such rectangle exists because
/// the lens model folds over.
Camera undistorted_camera(const Camera& source, const Distortion& distortion);

/// The picture of `camera`, sampled bilinearly from that of `source`, which has the image's size.
Image undistort_image(const Image& image, const Camera& source, const Distortion& distortion,
                      const Camera& camera);

}  // namespace ewa::scene
