// SPDX-License-Identifier: Apache-2.0
// transforms.json in the dialects of instant-ngp, nerfstudio and Blender's synthetic scenes (NeRF).
//
// A key of a frame wins over the same key at the top of the file.
//   fl_x fl_y cx cy w h            px; defaults: fl_y is fl_x, (cx, cy) the centre, w h the image's size
//   camera_angle_x camera_angle_y  angles of view in radians, in place of fl_x and fl_y
//                                  of a fisheye, they are equidistant; parallel rays have none
//   k1 k2 k3 p1 p2 s1 s2 s3 s4     OpenCV's distortion
//   camera_model, is_fisheye       OPENCV_FISHEYE: fisheye with k1 to k4; FULL_OPENCV: k1 to k6
//   distortion_params              k1 k2 k3 k4 p1 p2; of FISHEYE624 k1 to k6, p2, p1, s1 to s4: in place of keys of their own
//   transform_matrix               camera to world; camera axes are OpenGL's (x right, y up, z back)
//   rolling_shutter                top-to-bottom, bottom-to-top, left-to-right or right-to-left: the order of the readout. Then the frame has
//   transform_matrix_start, _end   the poses when the readout leaves the first border and reaches the last one, as transform_matrix,
//                                  which is not read
//   file_path                      relative to the file's folder; may lack its extension, or be that of another machine
//   mask_path                      the image's mask
//   depth_file_path                the image's depth map: .exr in world units, or .png of 16 bits
//   depth_unit_scale_factor        world units of a level of such a .png; 0.001 without
//   ply_file_path                  points, at the top of the file
//   view_dependent                 at the top: false if no colour depends on the direction of view
//   train_filenames val_filenames test_filenames   at the top: the split, see named_splits.h
#include <algorithm>
#include <cctype>
#include <cmath>
#include <glm/matrix.hpp>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/atomic_file.h"
#include "core/folders.h"
#include "core/json_field.h"
#include "core/sandboxed_path.h"
#include "core/words.h"
#include "io/datasets/image_records.h"
#include "io/datasets/importers/image_finder.h"
#include "io/datasets/named_splits.h"
#include "io/datasets/rotation.h"
#include "scene/readout.h"

namespace ewa::io {

namespace {

using nlohmann::json;
using Json = nlohmann::ordered_json;

constexpr size_t kLongestName = 200;  // in an error

/// A key is looked up in the frame, then at the top of the file.
using Entry = core::JsonField;

using Term = double Distortion::*;

constexpr std::pair<const char*, Term> kTerms[] = {
    {"k1", &Distortion::k1}, {"k2", &Distortion::k2}, {"k3", &Distortion::k3}, {"k4", &Distortion::k4},
    {"k5", &Distortion::k5}, {"k6", &Distortion::k6}, {"p1", &Distortion::p1}, {"p2", &Distortion::p2},
    {"s1", &Distortion::s1}, {"s2", &Distortion::s2}, {"s3", &Distortion::s3}, {"s4", &Distortion::s4}};

/// A list of terms; false if the entry has none.
bool read_terms(const Entry& entry, const std::vector<Term>& terms, Distortion& d) {
    if (!entry.has("distortion_params")) return false;
    const std::vector<double> values = entry.numbers("distortion_params", terms.size());
    for (size_t i = 0; i < terms.size(); ++i) d.*terms[i] = values[i];
    return true;
}

/// Project Aria's lens. Its p0 and p1 are OpenCV's p2 and p1.
Distortion read_fisheye624(const Entry& entry) {
    using Of = Distortion;
    Distortion d;
    d.lens = Lens::fisheye624;
    if (!read_terms(entry,
                    {&Of::k1, &Of::k2, &Of::k3, &Of::k4, &Of::k5, &Of::k6, &Of::p2, &Of::p1, &Of::s1, &Of::s2,
                     &Of::s3, &Of::s4},
                    d))
        entry.fail("\"distortion_params\" is missing, which has the terms of FISHEYE624");
    return d;
}

/// A number is true unless it is 0.
bool is_set(const Entry& entry, const char* key) {
    return entry.has(key) && entry.at(key).value().is_number() ? entry.number(key) != 0 : entry.flag(key);
}

/// Throws for models that no lens of ewa's is.
void refuse_model_of(const Entry& entry, const std::string& model) {
    if (model.starts_with("OMNIDIRECTIONALSTEREO") || model.starts_with("VR180"))
        entry.fail(
            "the camera model " + model.substr(0, kLongestName) +
            " has another place for each direction; export each eye as EQUIRECTANGULAR, or PINHOLE images");
    entry.fail("the camera model " + model.substr(0, kLongestName) +
               " is not supported; undistort the images to PINHOLE first");
}

/// The lenses of nerfstudio and instant-ngp. They disagree on k4: a fourth radial term, or as in OpenCV a
/// term of the denominator. It is accepted only where its meaning is certain: for a fisheye and for
/// FULL_OPENCV.
Distortion read_lens(const Entry& entry) {
    static constexpr std::string_view kPerspective[] = {
        "", "PINHOLE", "SIMPLE_PINHOLE", "OPENCV", "SIMPLE_RADIAL", "RADIAL", "FULL_OPENCV"};
    static constexpr std::string_view kFisheye[] = {"OPENCV_FISHEYE", "SIMPLE_RADIAL_FISHEYE",
                                                    "RADIAL_FISHEYE"};
    const auto holds = [](auto& list, const std::string& name) {
        return std::find(std::begin(list), std::end(list), name) != std::end(list);
    };
    std::string model = entry.text("camera_model", {});
    std::ranges::transform(model, model.begin(), [](unsigned char c) { return char(std::toupper(c)); });
    if (model == "EQUIRECTANGULAR") return {.lens = Lens::equirectangular};
    if (model == "ORTHOGRAPHIC" || model == "ORTHOPHOTO") return {.lens = Lens::orthographic};
    if (model == "FISHEYE624") return read_fisheye624(entry);
    const bool fisheye = is_set(entry, "is_fisheye") || holds(kFisheye, model);
    if (!fisheye && !holds(kPerspective, model)) refuse_model_of(entry, model);
    Distortion d;
    d.lens = fisheye ? Lens::fisheye : Lens::brown;
    using Of = Distortion;
    if (!read_terms(entry, {&Of::k1, &Of::k2, &Of::k3, &Of::k4, &Of::p1, &Of::p2}, d))
        for (const auto& [key, term] : kTerms) d.*term = entry.number(key, 0);
    const bool full = model == "FULL_OPENCV";
    const std::pair<const char*, bool> unsure[] = {{"k4", d.k4 != 0 && !fisheye && !full},
                                                   {"k5", d.k5 != 0 && !full},
                                                   {"k6", d.k6 != 0 && !full},
                                                   {"ftheta_p0", entry.number("ftheta_p0", 0) != 0}};
    for (const auto& [key, refused] : unsure)
        if (refused)
            entry.fail(std::string("the distortion term ") + key +
                       " is not supported; undistort the images to PINHOLE first");
    return d;
}

/// The program that writes a file with these keys; empty if many do.
std::string program_of(const json& top) {
    if (top.contains("applied_transform") || top.contains("orientation_override")) return "nerfstudio";
    if (top.contains("aabb_scale")) return "instant-ngp";
    if (top.contains("camera_angle_x") && !top.contains("fl_x")) return "Blender";
    return {};
}

/// Notes about keys that change nothing.
void add_notes(const json& top, ImageRecords& records) {
    if (top.contains("fisheye_crop_radius"))
        records.notes.emplace_back(
            "fisheye_crop_radius is not used: masks can hide what is outside the circle");
    if (top.contains("rolling_shutter_time"))
        records.notes.emplace_back(
            "rolling_shutter_time is not used: rolling_shutter, transform_matrix_start and _end describe a "
            "readout");
}

/// The folders of a dataset that a path of the file may be relative to: its own, and those above it up to the dataset's.
using Bases = std::vector<std::filesystem::path>;

Bases bases_of(const std::filesystem::path& folder, const std::filesystem::path& root) {
    Bases bases{folder};
    while (!root.empty() && bases.back() != root && bases.back().has_relative_path())
        bases.push_back(bases.back().parent_path());
    return bases;
}

/// The file that the entry names under this key: a path of another machine is searched by name, in any case. Empty if it names none.
std::filesystem::path named_file(const Entry& entry, const char* key, const Bases& bases) {
    const std::string name = entry.text(key, {});
    if (name.empty()) return {};
    const std::string what = std::string("\"") + key + "\" " + name.substr(0, kLongestName);
    const std::filesystem::path inside = named_path(name);
    if (inside.empty()) entry.fail(what + " names no file");
    std::filesystem::path folder = bases[0], chosen = inside;
    const auto choose = [&] {
        for (const std::filesystem::path& base : bases)
            for (const std::filesystem::path& path : {inside, inside.filename()})
                if (const auto file = entry_in(base / path.parent_path(), path.filename().string());
                    core::is_file(file)) {
                    folder = base;
                    chosen = path.parent_path() / file.filename();
                    return;
                }
    };
    choose();
    if (!core::links_stay_with_images(folder, chosen))
        entry.fail(what + " is a link out of the file's folder; " + core::kLinkAdvice);
    return folder / chosen;
}

/// Finds the images of all frames in and below the folder, or else in the folders above it.
ImageFinder image_finder(const json& frames, const Bases& bases) {
    std::vector<ImageFinder::Place> places;
    for (const std::filesystem::path& base : bases) places.push_back({base, true});
    std::vector<std::string> names;
    bool beside = false;
    for (const json& frame : frames)
        if (const std::string name = core::text_in(frame, "file_path"); !name.empty()) {
            names.push_back(name);
            beside = beside || names.back().starts_with("../") || names.back().starts_with("..\\");
        }
    // The file may be of another folder of the dataset than the images.
    const std::filesystem::path whole =
        std::filesystem::absolute(bases.back() / "x").lexically_normal().parent_path();
    if (beside && has_outside(whole))
        for (const char* name : {"images", "input"})
            if (std::filesystem::path folder = entry_in(whole.parent_path(), name); core::is_folder(folder))
                places.push_back({std::move(folder)});
    ImageFinder finder(std::move(places));
    finder.add_last(bases.back());
    finder.settle(names);
    return finder;
}

void find_image(const Entry& entry, const ImageFinder& finder, ImageRecord& image) {
    const std::string name = entry.text("file_path", {});
    if (name.empty()) entry.fail("\"file_path\" is missing");
    finder.find(name, entry.where(), image);
}

void read_depth(const Entry& entry, const Bases& bases, ImageRecord& image) {
    image.depth = named_file(entry, "depth_file_path", bases);
    image.depth_unit = entry.number("depth_unit_scale_factor", image.depth_unit);
    if (!(image.depth_unit > 0)) entry.fail("\"depth_unit_scale_factor\" is not above 0");
}

double focal_from_angle(const Entry& entry, const char* key, int size, Lens lens) {
    const double angle = entry.number(key);
    const std::string name = std::string("\"") + key + "\"";
    if (lens == Lens::orthographic)
        entry.fail(name + " says nothing of parallel rays; they need \"fl_x\", the pixels per world unit");
    if (lens == Lens::fisheye || lens == Lens::fisheye624) {
        if (!(angle > 0 && angle <= 2 * std::numbers::pi))
            entry.fail(name + " is not an angle between 0 and 2 pi (radians)");
        return size / angle;
    }
    if (!(angle > 0 && angle < std::numbers::pi))
        entry.fail(name + " is not an angle between 0 and pi (radians)");
    return 0.5 * size / std::tan(0.5 * angle);
}

/// Width and height stay 0 if neither the entry nor an image file states them.
void read_intrinsics(const Entry& entry, ImageRecord& image) {
    Camera& camera = image.camera;
    if (entry.number_if("w") && entry.number_if("h")) {
        camera.width = entry.side("w");
        camera.height = entry.side("h");
    } else if (core::is_file(image.path)) {
        const ImageSize size = read_image_size(image.path);
        camera.width = size.width;
        camera.height = size.height;
    } else {
        return;
    }
    if (image.distortion.lens == Lens::equirectangular) {
        set_sphere(camera, entry.where());
        return;
    }
    if (entry.has("fl_x"))
        camera.fx = entry.number("fl_x");
    else if (entry.has("camera_angle_x"))
        camera.fx = focal_from_angle(entry, "camera_angle_x", camera.width, image.distortion.lens);
    else if (image.distortion.lens == Lens::orthographic)
        entry.fail("\"fl_x\" is missing, the pixels per world unit of parallel rays");
    else
        entry.fail("\"fl_x\" or \"camera_angle_x\" is missing");
    if (entry.has("fl_y"))
        camera.fy = entry.number("fl_y");
    else if (!entry.has("fl_x") && entry.has("camera_angle_y"))
        camera.fy = focal_from_angle(entry, "camera_angle_y", camera.height, image.distortion.lens);
    else
        camera.fy = camera.fx;
    if (!(camera.fx > 0 && camera.fy > 0)) entry.fail("a focal length is not positive");
    camera.cx = entry.number("cx", 0.5 * camera.width);
    camera.cy = entry.number("cy", 0.5 * camera.height);
}

void read_poses(const Entry& entry, Camera& camera) {
    const std::string order = entry.text("rolling_shutter", {});
    if (order.empty() || order == "global") return read_opengl_pose(entry, "transform_matrix", camera);
    const auto from = core::find_value(scene::kReadoutWords, order);
    if (!from)
        entry.fail("\"rolling_shutter\": '" + order.substr(0, kLongestName) +
                   "' is not top-to-bottom, bottom-to-top, left-to-right, right-to-left or global");
    read_opengl_pose(entry, "transform_matrix_start", camera);
    Camera end;
    read_opengl_pose(entry, "transform_matrix_end", end);
    camera.readout = Readout{*from, end.rotation, end.translation};
}

Json matrix_of(const Camera& camera) {
    const glm::dmat3 axes = from_opengl(glm::transpose(camera.rotation));
    const glm::dvec3 position = camera.position();
    Json rows = Json::array();
    for (int row = 0; row < 3; ++row)
        rows.push_back({axes[0][row], axes[1][row], axes[2][row], position[row]});
    rows.push_back({0.0, 0.0, 0.0, 1.0});
    return rows;
}

}  // namespace

ImageRecords read_transforms(const std::filesystem::path& path, int split, bool with_points,
                             const std::filesystem::path& root) {
    // As instant-ngp and Python write them.
    const Entry file = Entry::of_file(path, {.comments = true, .not_finite = true});
    const json& top = file.value();
    const std::string& name = file.where();
    const json& frames = file.list("frames");
    ImageRecords result;
    const Bases bases = bases_of(path.parent_path(), root);
    result.files = {path};
    result.format = "transforms";
    result.program = program_of(top);
    add_notes(top, result);
    bool unused_poses = false;
    const ImageFinder finder = image_finder(frames, bases);
    result.folder = finder.folder();
    for (size_t i = 0; i < frames.size(); ++i) {
        const Entry entry = Entry(frames[i], name + ": frame " + std::to_string(i)).or_of(top);
        if (!frames[i].is_object()) entry.fail("is not a JSON object");
        ImageRecord image;
        image.split = split;
        image.distortion = read_lens(entry);
        find_image(entry, finder, image);
        image.mask = named_file(entry, "mask_path", bases);
        read_depth(entry, bases, image);
        read_poses(entry, image.camera);
        unused_poses = unused_poses || (entry.has("transform_matrix_start") && !entry.has("rolling_shutter"));
        read_intrinsics(entry, image);
        result.images.push_back(std::move(image));
    }
    split_by_names(top, name, result);
    if (unused_poses)
        result.notes.emplace_back(
            "transform_matrix_start and _end are not used: rolling_shutter names no order of the readout");
    if (file.has("view_dependent")) result.color_depends_on_view = file.flag("view_dependent");
    const auto cloud = named_file(file, "ply_file_path", bases);
    if (!cloud.empty()) result.files.push_back(cloud);
    if (with_points && !cloud.empty()) {
        PlyPoints points = read_points_ply(cloud);
        result.points = std::move(points.points);
        result.dropped = std::move(points.dropped);
    }
    return result;
}

namespace {

/// The model of a native lens, with its terms.
Json model_of(const Distortion& d) {
    if (d.lens == Lens::equirectangular) return {{"camera_model", "EQUIRECTANGULAR"}};
    if (d.lens == Lens::orthographic) return {{"camera_model", "ORTHOGRAPHIC"}};
    if (d.lens == Lens::fisheye)
        return {{"camera_model", "OPENCV_FISHEYE"}, {"k1", d.k1}, {"k2", d.k2}, {"k3", d.k3}, {"k4", d.k4}};
    if (d.none()) return {{"camera_model", "PINHOLE"}};
    Json model = {{"camera_model", "FULL_OPENCV"},
                  {"k1", d.k1},
                  {"k2", d.k2},
                  {"p1", d.p1},
                  {"p2", d.p2},
                  {"k3", d.k3},
                  {"k4", d.k4},
                  {"k5", d.k5},
                  {"k6", d.k6}};
    const bool prism = d.s1 != 0 || d.s2 != 0 || d.s3 != 0 || d.s4 != 0;
    if (prism) model.update({{"s1", d.s1}, {"s2", d.s2}, {"s3", d.s3}, {"s4", d.s4}});
    return model;
}

/// The poses of a rolling shutter. Other programs read that of the middle.
void add_readout(const Camera& camera, Json& entry) {
    if (!camera.readout) return;
    entry["rolling_shutter"] = core::word_for(scene::kReadoutWords, camera.readout->from);
    entry["transform_matrix_start"] = matrix_of(camera);
    entry["transform_matrix_end"] = matrix_of(scene::at_share(camera, 1));
}

}  // namespace

void write_transforms(const std::filesystem::path& path, const TransformsFile& file) {
    Json top = model_of(file.frames.empty() ? Distortion() : file.frames[0].camera.distortion);
    for (const auto& [key, text] : file.remarks) top[key] = text;
    if (!file.color_depends_on_view) top["view_dependent"] = false;
    if (!file.points.empty()) top["ply_file_path"] = file.points;
    top["frames"] = Json::array();
    for (const TransformsFrame& frame : file.frames) {
        const Camera& camera = frame.camera;
        Json entry = {{"file_path", frame.image}, {"w", camera.width},
                      {"h", camera.height},       {"fl_x", camera.fx},
                      {"fl_y", camera.fy},        {"cx", camera.cx},
                      {"cy", camera.cy},          {"transform_matrix", matrix_of(scene::at_middle(camera))}};
        add_readout(camera, entry);
        if (!frame.depth.empty()) entry["depth_file_path"] = frame.depth;
        top["frames"].push_back(std::move(entry));
    }
    core::write_text_file(path, top.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
}

}  // namespace ewa::io
