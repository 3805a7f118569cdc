// SPDX-License-Identifier: Apache-2.0
// What the two files of RealityScan (once RealityCapture) have in common: a calibration in units of the image's larger side.
#pragma once
#include <string>
#include <vector>

#include "io/datasets/image_records.h"

namespace ewa::io {

struct RealityScanCalibration {
    double focal = 0;     // mm on film of 36 mm along the larger side
    double u = 0, v = 0;  // of the principal point, from the middle, over the larger side
    /// k1, k2, k3, k4, t1, t2. The radial ones are of r^2, r^4, r^6 and r^8; t1 and t2 are OpenCV's p2 and p1.
    std::vector<double> terms;
    /// p 2 / (1 + sqrt(1 - 4 k1 |p|^2)) with the first term as k1, as in COLMAP.
    bool division = false;
};

/// Sets camera and distortion. The size is the image file's; without the file it stays 0.
void set_calibration(ImageRecord& record, const RealityScanCalibration& calibration,
                     const std::string& where);

}  // namespace ewa::io
