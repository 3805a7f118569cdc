// SPDX-License-Identifier: Apache-2.0
// cameras.json of INRIA's trainer, beside its cfg_args: a list of
//   img_name        without extension
//   width, height   px, of the training images
//   position        of the camera, world
//   rotation        three rows: camera to world, in OpenCV's axes
//   fx, fy          px; the principal point is the middle of the image
// `ewa train --inria` writes it too.
#include <nlohmann/json.hpp>

#include "core/json_field.h"
#include "io/datasets/importers/image_finder.h"
#include "io/datasets/importers/importer.h"
#include "io/datasets/rotation.h"

namespace ewa::io {

ImageRecords import_inria(const ImportSource& source) {
    const auto top = core::JsonField::of_file(source.file, {.not_finite = true});
    const nlohmann::json& document = top.value();
    if (!document.is_array()) top.fail("is not a list of cameras");
    const ImageFinder images(source.dataset, {"images", "input"});
    ImageRecords records =
        begin_records(source, "INRIA's trainer, or another one in its layout", images.folder());
    for (size_t i = 0; i < document.size(); ++i) {
        const std::string where = top.where() + ": camera " + std::to_string(i);
        const core::JsonField field(document[i], where);
        ImageRecord record = begin_record(images, field.text("img_name"), field);
        Camera& camera = record.camera;
        camera.cx = 0.5 * camera.width;
        camera.cy = 0.5 * camera.height;
        const std::vector<double> rows = field.numbers("rotation", 9), p = field.numbers("position", 3);
        const glm::dmat3 axes(rows[0], rows[3], rows[6], rows[1], rows[4], rows[7], rows[2], rows[5],
                              rows[8]);
        const std::string fault = rotation_fault(axes);
        if (!fault.empty()) field.fail("\"rotation\": " + fault);
        set_pose(camera, nearest_rotation(axes), {p[0], p[1], p[2]});
        finish_record(record, where);
        records.images.push_back(std::move(record));
    }
    add_points_beside(source.dataset, source.with_points, records);
    return records;
}

}  // namespace ewa::io
