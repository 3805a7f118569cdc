// SPDX-License-Identifier: Apache-2.0
// Record3D: metadata.json beside rgb/, or an unpacked .r3d with metadata beside rgbd/. Image N.jpg has the N-th pose.
//
//   w, h                      px
//   K                         9 numbers, column after column: fx 0 0, 0 fy 0, cx cy 1
//   perFrameIntrinsicCoeffs   fx fy cx cy of each image, in place of K where it is there
//   poses                     qx qy qz qw tx ty tz of each image, from the camera (x right, y up, z back) to the world with y up
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <nlohmann/json.hpp>

#include "core/folders.h"
#include "core/json_field.h"
#include "io/datasets/importers/image_finder.h"
#include "io/datasets/importers/importer.h"
#include "io/datasets/rotation.h"

namespace ewa::io {

namespace {

/// `count` finite numbers at that index of a list of lists.
std::vector<double> numbers_at(const core::JsonField& top, const char* key, size_t index, size_t count) {
    return core::JsonField(top.value()[key][index],
                           top.where() + ": \"" + key + "\" " + std::to_string(index))
        .numbers(nullptr, count);
}

void set_record3d_intrinsics(const core::JsonField& top, size_t index, bool per_frame, Camera& camera) {
    camera.width = top.side("w");
    camera.height = top.side("h");
    if (per_frame) {
        const std::vector<double> v = numbers_at(top, "perFrameIntrinsicCoeffs", index, 4);
        camera.fx = v[0];
        camera.fy = v[1];
        camera.cx = v[2];
        camera.cy = v[3];
        return;
    }
    const std::vector<double> k = top.numbers("K", 9);
    camera.fx = k[0];
    camera.fy = k[4];
    camera.cx = k[6];
    camera.cy = k[7];
}

void set_record3d_pose(const core::JsonField& top, size_t index, Camera& camera) {
    const std::vector<double> p = numbers_at(top, "poses", index, 7);
    const glm::dquat q(p[3], p[0], p[1], p[2]);
    const double length = glm::length(q);
    constexpr double kMostDeviation = 1e-2;
    if (!(std::abs(length - 1) <= kMostDeviation))
        top.fail("\"poses\" " + std::to_string(index) + ": the quaternion is not of unit length");
    set_pose(camera, from_opengl(glm::mat3_cast(q / length)), {p[4], p[5], p[6]});
}

}  // namespace

ImageRecords import_record3d(const ImportSource& source) {
    const auto top = core::JsonField::of_file(source.file, {.not_finite = true});
    const std::string& name = top.where();
    const size_t poses = top.list("poses").size();
    const bool per_frame = top.has("perFrameIntrinsicCoeffs") && !top.list("perFrameIntrinsicCoeffs").empty();
    if (per_frame && top.value()["perFrameIntrinsicCoeffs"].size() != poses)
        top.fail("\"perFrameIntrinsicCoeffs\" and \"poses\" differ in length");
    const ImageFinder images(source.dataset, {"rgb", "rgbd", "images"});
    ImageRecords records = begin_records(source, "Record3D", images.folder());
    for (size_t i = 0; i < poses; ++i) {
        ImageRecord record;
        images.find(std::to_string(i), name, record);
        set_record3d_intrinsics(top, i, per_frame, record.camera);
        set_record3d_pose(top, i, record.camera);
        finish_record(record, name + ": image " + std::to_string(i));
        records.images.push_back(std::move(record));
    }
    add_points_beside(source.dataset, source.with_points, records);
    return records;
}

}  // namespace ewa::io
