// SPDX-License-Identifier: Apache-2.0
// reconstruction.json of OpenSfM, which OpenDroneMap (ODM) runs in opensfm/.
//
// A list of reconstructions, each with:
//   cameras   by id: projection_type, width, height, focal or focal_x and focal_y, c_x, c_y, and the terms of the lens. The unit
//             is the larger side of the image, and its middle is the origin. OpenSfM counts pixels from the first one's centre.
//   shots     by the image's name: camera, rotation (axis times angle), translation; both from the world to the camera
//   points    by id: coordinates, color (0 to 255)
#include <algorithm>
#include <array>
#include <glm/gtc/quaternion.hpp>
#include <map>
#include <nlohmann/json.hpp>

#include "core/folders.h"
#include "core/json_field.h"
#include "core/text.h"
#include "ewa/error.h"
#include "io/datasets/importers/image_finder.h"
#include "io/datasets/importers/importer.h"

namespace ewa::io {

namespace {

using nlohmann::json;
using Term = double Distortion::*;

/// A projection_type, and the keys of its terms. OpenSfM adds the tangential terms of its fisheyes to the angles, before the radial
/// ones have bent them.
struct OpenSfmLens {
    std::string_view name;
    bool one_focal_length;
    Lens lens;
    std::vector<std::pair<const char*, Term>> terms;
};

const std::vector<OpenSfmLens>& open_sfm_lenses() {
    using Of = Distortion;
    static const std::vector<OpenSfmLens> lenses{
        {"perspective", true, Lens::brown, {{"k1", &Of::k1}, {"k2", &Of::k2}}},
        {"simple_radial", false, Lens::brown, {{"k1", &Of::k1}}},
        {"radial", false, Lens::brown, {{"k1", &Of::k1}, {"k2", &Of::k2}}},
        {"brown",
         false,
         Lens::brown,
         {{"k1", &Of::k1}, {"k2", &Of::k2}, {"k3", &Of::k3}, {"p1", &Of::p1}, {"p2", &Of::p2}}},
        {"fisheye", true, Lens::fisheye, {{"k1", &Of::k1}, {"k2", &Of::k2}}},
        {"fisheye_opencv",
         false,
         Lens::fisheye,
         {{"k1", &Of::k1}, {"k2", &Of::k2}, {"k3", &Of::k3}, {"k4", &Of::k4}}},
        {"fisheye62",
         false,
         Lens::fisheye,
         {{"k1", &Of::k1},
          {"k2", &Of::k2},
          {"k3", &Of::k3},
          {"k4", &Of::k4},
          {"k5", &Of::k5},
          {"k6", &Of::k6},
          {"p1", &Of::p1},
          {"p2", &Of::p2}}},
        {"fisheye624",
         false,
         Lens::fisheye,
         {{"k1", &Of::k1},
          {"k2", &Of::k2},
          {"k3", &Of::k3},
          {"k4", &Of::k4},
          {"k5", &Of::k5},
          {"k6", &Of::k6},
          {"p1", &Of::p1},
          {"p2", &Of::p2},
          {"s0", &Of::s1},
          {"s1", &Of::s2},
          {"s2", &Of::s3},
          {"s3", &Of::s4}}},
        {"spherical", true, Lens::equirectangular, {}},
        {"equirectangular", true, Lens::equirectangular, {}}};
    return lenses;
}

ImageRecord open_sfm_camera(const core::JsonField& field) {
    const std::string type = field.text("projection_type", "perspective");
    const auto& lenses = open_sfm_lenses();
    const auto lens = std::ranges::find(lenses, type, &OpenSfmLens::name);
    if (lens == lenses.end())
        field.fail(
            "the projection_type \"" + type.substr(0, 60) +
            "\" is not supported; use the images of opensfm/undistorted with their reconstruction.json, "
            "or export with `opensfm export_colmap`");
    ImageRecord record;
    Camera& camera = record.camera;
    camera.width = field.side("width");
    camera.height = field.side("height");
    record.distortion.lens = lens->lens;
    if (lens->lens == Lens::equirectangular) {
        set_sphere(camera, field.where());
        return record;
    }
    const double unit = std::max(camera.width, camera.height);
    camera.fx = unit * field.number(lens->one_focal_length ? "focal" : "focal_x");
    camera.fy = unit * field.number(lens->one_focal_length ? "focal" : "focal_y");
    camera.cx = 0.5 * camera.width + unit * field.number("c_x", 0);
    camera.cy = 0.5 * camera.height + unit * field.number("c_y", 0);
    for (const auto& [key, term] : lens->terms) record.distortion.*term = field.number(key, 0);
    finish_record(record, field.where());
    return record;
}

glm::dmat3 rotation_by(const glm::dvec3& axis_angle) {
    const double angle = glm::length(axis_angle);
    return angle > 0 ? glm::mat3_cast(glm::angleAxis(angle, axis_angle / angle)) : glm::dmat3(1);
}

/// The reconstruction of the most images: the others have worlds of their own.
const json& largest(const json& list, const std::string& name) {
    const json* best = nullptr;
    size_t most = 0;
    for (const json& one : list) {
        const core::JsonField shots = core::JsonField(one, name).object("shots");
        if (!best || shots.value().size() > most) {
            best = &one;
            most = shots.value().size();
        }
    }
    if (!best) throw InputError(name + ": the list of reconstructions is empty");
    return *best;
}

void add_open_sfm_points(const core::JsonField& reconstruction, ImageRecords& records) {
    if (!reconstruction.has("points")) return;
    for (const auto& [id, point] : reconstruction.members("points").items()) {
        const std::string place = "point " + id.substr(0, 60);
        const auto position = core::three_numbers(point, "coordinates");
        if (!position) reconstruction.fail(place + " has no three finite coordinates");
        std::array<uint8_t, 3> color{128, 128, 128};
        if (const auto rgb = core::three_numbers(point, "color"))
            for (size_t i = 0; i < 3; ++i) color[i] = uint8_t(std::clamp((*rgb)[i], 0.0, 255.0) + 0.5);
        add_point(records.points, records.dropped, {(*position)[0], (*position)[1], (*position)[2]}, color,
                  [&] { return core::one_line(reconstruction.where() + ": " + place); });
    }
}

}  // namespace

ImageRecords import_open_sfm(const ImportSource& source) {
    const auto file = core::JsonField::of_file(source.file, {.bytes = uint64_t(1) << 30,
                                                             .objects = size_t(1) << 22,
                                                             .values = size_t(1) << 25,
                                                             .not_finite = true});
    const json& top = file.value();
    const std::string& name = file.where();
    if (!top.is_array()) file.fail("is not a list of reconstructions");
    const core::JsonField reconstruction(largest(top, name), name);
    ImageRecords records;
    records.program = source.file.parent_path().filename() == "opensfm" ? "OpenDroneMap" : "OpenSfM";
    records.files = {source.file};
    if (top.size() > 1)
        records.notes.push_back("of " + std::to_string(top.size()) +
                                " reconstructions, the one with the most images is used");
    std::map<std::string, ImageRecord> cameras;
    for (const auto& [id, camera] : reconstruction.members("cameras").items())
        cameras.emplace(id, open_sfm_camera({camera, name + ": camera \"" + id + "\""}));

    const ImageFinder images(source.dataset, {"images"});
    records.folder = images.folder();
    for (const auto& [key, value] : reconstruction.members("shots").items()) {
        const core::JsonField shot(value, name + ": shot \"" + key + "\"");
        const auto camera = cameras.find(shot.text("camera"));
        if (camera == cameras.end()) shot.fail("its camera is not in the list of cameras");
        ImageRecord record = camera->second;
        images.find(key, name, record);
        const std::vector<double> r = shot.numbers("rotation", 3), t = shot.numbers("translation", 3);
        record.camera.rotation = rotation_by({r[0], r[1], r[2]});
        record.camera.translation = {t[0], t[1], t[2]};
        finish_record(record, shot.where());
        records.images.push_back(std::move(record));
    }
    if (source.with_points) add_open_sfm_points(reconstruction, records);
    return records;
}

}  // namespace ewa::io
