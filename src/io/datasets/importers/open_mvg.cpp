// SPDX-License-Identifier: Apache-2.0
// sfm_data.json of OpenMVG.
//
// Lists of {key, value}:
//   views       ptr_wrapper.data: filename, id_view, id_intrinsic, id_pose
//   intrinsics  polymorphic_id, polymorphic_name, and ptr_wrapper.data: width, height, focal_length, principal_point (px), and the
//               terms of the lens under a name of their own. Only the first of each type has the name, with the highest bit set in
//               its id; those of a 360 degree camera lie in "value0".
//   extrinsics  rotation (rows, from the world to the camera), center
//   structure   X, a point without a colour
#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "core/json_field.h"
#include "io/datasets/importers/image_finder.h"
#include "io/datasets/importers/importer.h"
#include "io/datasets/rotation.h"

namespace ewa::io {

namespace {

using nlohmann::json;

/// A polymorphic_name, and the list of its terms.
struct OpenMvgLens {
    std::string_view name;
    const char* key;
    Lens lens;
    std::vector<double Distortion::*> terms;
};

const std::vector<OpenMvgLens>& open_mvg_lenses() {
    using Of = Distortion;
    static const std::vector<OpenMvgLens> lenses{
        {"pinhole", nullptr, Lens::brown, {}},
        {"pinhole_radial_k1", "disto_k1", Lens::brown, {&Of::k1}},
        {"pinhole_radial_k3", "disto_k3", Lens::brown, {&Of::k1, &Of::k2, &Of::k3}},
        {"pinhole_brown_t2", "disto_t2", Lens::brown, {&Of::k1, &Of::k2, &Of::k3, &Of::p1, &Of::p2}},
        {"fisheye", "fisheye", Lens::fisheye, {&Of::k1, &Of::k2, &Of::k3, &Of::k4}},
        {"spherical", nullptr, Lens::equirectangular, {}}};
    return lenses;
}

/// The entries of a list of {key, value}, by key.
using Keyed = std::map<uint64_t, core::JsonField>;

Keyed keyed(const core::JsonField& top, const char* list, const std::string& what) {
    Keyed entries;
    if (!top.has(list)) return entries;
    for (const json& entry : top.list(list)) {
        const core::JsonField field(entry, top.where() + ": " + what + " " + std::to_string(entries.size()));
        entries.insert_or_assign(field.whole("key", UINT32_MAX), field.object("value"));
    }
    return entries;
}

core::JsonField data_of(const core::JsonField& value) {
    return value.object("ptr_wrapper").object("data");
}

/// The names of the types of intrinsics, by id without its highest bit.
using TypeNames = std::map<uint64_t, std::string>;
constexpr uint64_t kNewType = uint64_t(1) << 31;

ImageRecord open_mvg_camera(const core::JsonField& value, TypeNames& types) {
    const uint64_t id = value.whole("polymorphic_id", UINT32_MAX) & ~kNewType;
    if (value.has("polymorphic_name")) types[id] = value.text("polymorphic_name");
    const std::string type = types[id];
    const auto& lenses = open_mvg_lenses();
    const auto lens = std::ranges::find(lenses, type, &OpenMvgLens::name);
    if (lens == lenses.end())
        value.fail("the intrinsic \"" + type.substr(0, 60) +
                   "\" is not supported; export undistorted images with openMVG_main_openMVG2Colmap, or "
                   "compute with another camera model");
    const core::JsonField whole = data_of(value);
    const core::JsonField data = whole.has("value0") ? whole.object("value0") : whole;
    ImageRecord record;
    Camera& camera = record.camera;
    camera.width = data.side("width");
    camera.height = data.side("height");
    record.distortion.lens = lens->lens;
    if (lens->lens == Lens::equirectangular) {
        set_sphere(camera, value.where());
        return record;
    }
    const std::vector<double> center = data.numbers("principal_point", 2);
    camera.fx = camera.fy = data.number("focal_length");
    camera.cx = center[0];
    camera.cy = center[1];
    if (lens->key) {
        const std::vector<double> terms = data.numbers(lens->key, lens->terms.size());
        for (size_t i = 0; i < terms.size(); ++i) record.distortion.*lens->terms[i] = terms[i];
    }
    finish_record(record, value.where());
    return record;
}

void read_extrinsic(const core::JsonField& value, Camera& camera) {
    const std::vector<double> r = value.numbers("rotation", 9), c = value.numbers("center", 3);
    glm::dmat3 axes;  // the rows are the camera's axes in the world
    for (int i = 0; i < 9; ++i) axes[i / 3][i % 3] = r[size_t(i)];
    if (const std::string fault = rotation_fault(axes); !fault.empty())
        value.fail("\"rotation\" is not a rotation: " + fault);
    set_pose(camera, nearest_rotation(axes), {c[0], c[1], c[2]});
}

void add_structure(const core::JsonField& top, ImageRecords& records) {
    if (!top.has("structure")) return;
    size_t number = 0;
    for (const json& entry : top.list("structure")) {
        const std::string place = "point " + std::to_string(number++) + " of \"structure\"";
        const auto value = entry.find("value");
        const auto x = core::three_numbers(value == entry.end() ? entry : *value, "X");
        if (!x) top.fail(place + " has no \"X\" of three finite numbers");
        add_point(records.points, records.dropped, {(*x)[0], (*x)[1], (*x)[2]}, {128, 128, 128},
                  [&] { return top.where() + ": " + place; });
    }
}

}  // namespace

ImageRecords import_open_mvg(const ImportSource& source) {
    const auto top = core::JsonField::of_file(source.file, {.bytes = uint64_t(1) << 30,
                                                            .objects = size_t(1) << 22,
                                                            .values = size_t(1) << 25,
                                                            .not_finite = true,
                                                            .skipped = "observations"});
    const std::string& name = top.where();
    TypeNames types;
    std::map<uint64_t, ImageRecord> cameras;
    // In the order of the file, in which the first of a type has its name.
    size_t number = 0;
    for (const json& entry : top.list("intrinsics")) {
        const core::JsonField field(entry, name + ": intrinsic " + std::to_string(number++));
        cameras.insert_or_assign(field.whole("key", UINT32_MAX),
                                 open_mvg_camera(field.object("value"), types));
    }
    const Keyed poses = keyed(top, "extrinsics", "extrinsic");

    const ImageFinder images(source.dataset, {"images"});
    ImageRecords records = begin_records(source, "OpenMVG", images.folder());
    size_t unplaced = 0;
    number = 0;
    for (const json& entry : top.list("views")) {
        const std::string where = name + ": view " + std::to_string(number++);
        const core::JsonField view = data_of(core::JsonField(entry, where).object("value"));
        const auto pose = poses.find(view.whole("id_pose", UINT32_MAX));
        if (pose == poses.end()) {
            ++unplaced;
            continue;
        }
        const auto camera = cameras.find(view.whole("id_intrinsic", UINT32_MAX));
        if (camera == cameras.end()) view.fail("its intrinsic is not in the list \"intrinsics\"");
        ImageRecord record = camera->second;
        images.find(view.text("filename"), where, record);
        read_extrinsic(pose->second, record.camera);
        finish_record(record, where);
        records.images.push_back(std::move(record));
    }
    if (records.images.empty())
        top.fail(
            "no view has a pose; take the file that a reconstruction has written, not the one of the "
            "image listing");
    note_unplaced(unplaced, records);
    if (source.with_points) add_structure(top, records);
    if (records.points.positions.empty()) add_points_beside(source.dataset, source.with_points, records);
    return records;
}

}  // namespace ewa::io
