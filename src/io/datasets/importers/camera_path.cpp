// SPDX-License-Identifier: Apache-2.0
// camera_path.json of nerfstudio's viewer: a path of cameras for renders, without images.
//
//   camera_type                  perspective, fisheye (equidistant) or equirectangular
//   render_width, render_height  px
//   camera_path                  the cameras: camera_to_world (four rows; x right, y up, z back), and fov: the vertical angle of a
//                                pinhole in degrees, whose focal length a fisheye has, too
//   fps, seconds                 of the film
// Keyframes, from which the cameras are interpolated, and "aspect" are not used, as in nerfstudio.
#include <cmath>
#include <glm/trigonometric.hpp>
#include <nlohmann/json.hpp>
#include <string>

#include "core/json_field.h"
#include "core/text.h"
#include "io/datasets/importers/importer.h"
#include "io/datasets/rotation.h"
#include "io/datasets/view_list.h"
#include "scene/native_lens.h"

namespace ewa::io {

namespace {

constexpr size_t kPathDigits = 5;  // of the number of a camera, below kMostCameras
constexpr double kPathRate = 30;

Lens lens_of_path(const core::JsonField& top) {
    const std::string type = core::lower(top.text("camera_type", "perspective"));
    if (type == "perspective") return Lens::brown;
    if (type == "fisheye") return Lens::fisheye;
    if (type == "equirectangular") return Lens::equirectangular;
    top.fail("the camera_type \"" + type.substr(0, 60) +
             "\" is not supported; take perspective, fisheye or equirectangular");
}

}  // namespace

ImageRecords import_camera_path(const ImportSource& source) {
    const auto top = core::JsonField::of_file(source.file, {.not_finite = true});
    const Lens lens = lens_of_path(top);
    const nlohmann::json& path = top.list("camera_path");
    if (path.empty())
        top.fail("\"camera_path\" is empty; add keyframes in the viewer, and save the path again");
    if (path.size() > kMostCameras) top.fail("\"camera_path\" has more than 100000 cameras");
    ImageRecords records = begin_records(source, "nerfstudio", source.dataset / "images");
    for (size_t i = 0; i < path.size(); ++i) {
        const std::string number = std::to_string(i);
        const core::JsonField field(path[i], top.where() + ": camera " + number);
        ImageRecord record;
        record.name = std::string(kPathDigits - number.size(), '0') + number;
        Camera& camera = record.camera;
        camera.width = top.side("render_width");
        camera.height = top.side("render_height");
        camera.cx = 0.5 * camera.width;
        camera.cy = 0.5 * camera.height;
        record.distortion.lens = lens;
        if (lens == Lens::equirectangular) {
            scene::set_equirectangular(camera);  // all directions, in an image of any size
        } else {
            const double fov = field.number("fov");
            if (!(fov > 0 && fov < 180)) field.fail("\"fov\" is not between 0 and 180 degrees");
            camera.fx = camera.fy = 0.5 * camera.height / std::tan(0.5 * glm::radians(fov));
        }
        read_opengl_pose(field, "camera_to_world", camera);
        finish_record(record, field.where());
        records.images.push_back(std::move(record));
    }
    const double rate = top.number("fps", 0), seconds = top.number("seconds", 0);
    records.frame_rate = rate > 0 ? rate : seconds > 0 ? double(path.size()) / seconds : kPathRate;
    if (top.has("crop")) records.notes.emplace_back("crop is not used; ewa convert --crop cuts splats out");
    return records;
}

}  // namespace ewa::io
