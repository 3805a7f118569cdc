// SPDX-License-Identifier: Apache-2.0
#include "io/datasets/importers/reality_scan.h"

#include <algorithm>
#include <cmath>

#include "core/folders.h"
#include "ewa/error.h"
#include "io/datasets/importers/importer.h"

namespace ewa::io {

void set_calibration(ImageRecord& record, const RealityScanCalibration& given, const std::string& where) {
    constexpr double kFilm = 36;  // mm
    if (!core::is_file(record.path)) return;
    const ImageSize size = read_image_size(record.path);
    const double unit = std::max(size.width, size.height);
    Camera& camera = record.camera;
    camera.width = size.width;
    camera.height = size.height;
    camera.fx = given.focal * unit / kFilm;
    camera.fy = camera.fx;
    camera.cx = 0.5 * size.width + given.u * unit;
    camera.cy = 0.5 * size.height + given.v * unit;
    Distortion& d = record.distortion;
    if (given.terms.size() == 6) {
        d.k1 = given.terms[0];
        d.k2 = given.terms[1];
        d.k3 = given.terms[2];
        d.k4 = given.terms[3];
        d.p2 = given.terms[4];
        d.p1 = given.terms[5];
    }
    d.lens = given.division ? d.k1 != 0 ? Lens::division : Lens::brown
             : d.k4 != 0    ? Lens::radial4
                            : Lens::brown;
    finish_record(record, where);
}

}  // namespace ewa::io
