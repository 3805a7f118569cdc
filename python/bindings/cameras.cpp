// SPDX-License-Identifier: Apache-2.0
#include "cameras.h"

#include <algorithm>
#include <cmath>
#include <glm/matrix.hpp>
#include <optional>
#include <span>
#include <utility>

#include "ewa/error.h"
#include "scene/native_lens.h"
#include "scene/readout.h"

namespace ewa::python {
namespace {

constexpr double kFarFromRotation = 1e-3;  // float32 matrices of a file with few digits are nearer
constexpr double kFarFromRow = 1e-5;       // an inverse in float32 is nearer

std::string element(const char* name, size_t index, bool batch) {
    return batch ? std::string(name) + "[" + std::to_string(index) + "]" : name;
}

[[noreturn]] void refuse(const std::string& text) {
    throw nb::value_error(text.c_str());
}

bool is_rotation(const glm::dmat3& m) {
    const glm::dmat3 square = glm::transpose(m) * m;
    for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r)
            if (!(std::abs(square[c][r] - (c == r)) <= kFarFromRotation)) return false;
    return glm::determinant(m) > 0;
}

void set_pose(Camera& camera, const double* m, const std::string& name) {
    if (!std::all_of(m, m + 16, [](double x) { return std::isfinite(x); })) refuse(name + " is not finite");
    for (size_t c = 0; c < 4; ++c)
        if (std::abs(m[12 + c] - (c == 3)) > kFarFromRow) refuse(name + ": its last row is not 0 0 0 1");
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) camera.rotation[c][r] = m[4 * r + c];
        camera.translation[r] = m[4 * r + 3];
    }
    if (!is_rotation(camera.rotation))
        refuse(name + ": its first three rows and columns are no rotation; it maps the world to the camera");
}

void set_intrinsics(Camera& camera, const double* k, const std::string& name) {
    if (!std::all_of(k, k + 9, [](double x) { return std::isfinite(x); })) refuse(name + " is not finite");
    if (k[1] != 0 || k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1)
        refuse(name + " is not [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]");
    if (!(k[0] > 0 && k[4] > 0)) refuse(name + ": a focal length is not positive");
    camera.fx = k[0];
    camera.cx = k[2];
    camera.fy = k[4];
    camera.cy = k[5];
}

using Term = double Distortion::*;
// OpenCV's orders (calib3d, "Detailed Description" and fisheye).
constexpr Term kBrownTerms[] = {&Distortion::k1, &Distortion::k2, &Distortion::p1, &Distortion::p2,
                                &Distortion::k3, &Distortion::k4, &Distortion::k5, &Distortion::k6,
                                &Distortion::s1, &Distortion::s2, &Distortion::s3, &Distortion::s4};
constexpr Term kFisheyeTerms[] = {&Distortion::k1, &Distortion::k2, &Distortion::k3, &Distortion::k4};

std::span<const Term> terms_of_lens(Lens lens) {
    if (lens == Lens::brown) return kBrownTerms;
    if (lens == Lens::fisheye) return kFisheyeTerms;
    return {};
}

const std::pair<const char*, Lens> kModels[] = {{"pinhole", Lens::brown},
                                                {"opencv", Lens::brown},
                                                {"fisheye", Lens::fisheye},
                                                {"equirectangular", Lens::equirectangular},
                                                {"orthographic", Lens::orthographic}};

Distortion distortion_of(const LensArguments& arguments) {
    const auto* model = std::ranges::find_if(kModels, [&](auto& m) { return m.first == arguments.model; });
    if (model == std::end(kModels))
        refuse("camera_model: '" + arguments.model +
               "' is none of pinhole, opencv, fisheye, equirectangular, orthographic");
    Distortion lens{.lens = model->second};
    if (arguments.distortion.is_none()) return lens;
    const Array<double> given(arguments.distortion, "distortion", Shape{any('n')});
    const auto terms = arguments.model == "pinhole" ? std::span<const Term>() : terms_of_lens(lens.lens);
    if (given.size() > terms.size())
        refuse("distortion has " + std::to_string(given.size()) + " terms; camera_model '" + arguments.model +
               "' has at most " + std::to_string(terms.size()));
    for (size_t i = 0; i < given.size(); ++i) {
        if (!std::isfinite(given.data()[i])) refuse("distortion is not finite");
        lens.*terms[i] = given.data()[i];
    }
    return lens;
}

}  // namespace

std::vector<Distortion> distortions_of(const std::string& model, nb::handle terms, const Shape& cameras,
                                       size_t count) {
    std::vector<Distortion> lenses(count, distortion_of({model, nb::none()}));
    if (terms.is_none()) return lenses;
    Shape shape = cameras;
    shape.push_back(std::size(kBrownTerms));
    const Array<float> given(terms, "distortions", shape);
    for (size_t i = 0; i < given.size(); ++i) {
        if (!std::isfinite(given.data()[i])) refuse("distortions are not finite");
        lenses[i / std::size(kBrownTerms)].*kBrownTerms[i % std::size(kBrownTerms)] = given.data()[i];
    }
    return lenses;
}

std::string model_of(const Distortion& lens) {
    if (lens.none()) return "pinhole";
    for (const auto& [name, model] : kModels)
        if (model == lens.lens && std::string(name) != "pinhole") return name;
    return "undistorted";
}

nb::object terms_of(const Distortion& lens) {
    std::vector<double> values;
    for (const Term term : terms_of_lens(lens.lens)) values.push_back(lens.*term);
    if (lens.none() || values.empty()) return nb::none();
    const size_t count = values.size();
    return nb::cast(to_numpy(std::move(values), {count}));
}

namespace {

constexpr const char* kGlobal = "global";

/// Gives the cameras their readouts.
void add_readouts(Cameras& cameras, const ReadoutArguments& readout) {
    if (readout.order == kGlobal) {
        if (!readout.ends.is_none())
            refuse("viewmats_end needs rolling_shutter, the order in which the rows or columns are read");
        return;
    }
    const auto from = core::find_value(scene::kReadoutWords, readout.order);
    if (!from)
        refuse("rolling_shutter: '" + readout.order +
               "' is none of global, top-to-bottom, bottom-to-top, left-to-right, right-to-left");
    if (readout.ends.is_none())
        refuse("rolling_shutter '" + readout.order +
               "' needs viewmats_end, the poses when the readout reaches the last border");
    const size_t count = cameras.all.size();
    const Array<double> ends(readout.ends, "viewmats_end",
                             cameras.batch ? Shape{ptrdiff_t(count), 4, 4} : Shape{4, 4});
    for (size_t i = 0; i < count; ++i) {
        const std::string name = element("viewmats_end", i, cameras.batch);
        Camera end;
        set_pose(end, ends.data() + 16 * i, name);
        Camera& camera = cameras.all[i];
        camera.readout = Readout{*from, end.rotation, end.translation};
        try {
            scene::check_readout(camera);
        } catch (const InputError& error) {
            refuse(name + ": " + error.what());
        }
    }
}

}  // namespace

Cameras cameras_of(nb::handle viewmats, nb::handle intrinsics, int width, int height,
                   const LensArguments& lens, const ReadoutArguments& readout) {
    const Distortion distortion = distortion_of(lens);
    const bool whole = distortion.lens == Lens::equirectangular && intrinsics.is_none();
    const Array<double> poses(viewmats, "viewmats", {Shape{any('C'), 4, 4}, Shape{4, 4}});
    Cameras cameras;
    cameras.batch = poses.dimensions() == 3;
    const size_t count = cameras.batch ? poses.length(0) : 1;
    std::optional<Array<double>> ks;
    if (!whole)
        ks.emplace(intrinsics, "Ks",
                   cameras.batch ? std::initializer_list<Shape>{Shape{ptrdiff_t(count), 3, 3}, Shape{3, 3}}
                                 : std::initializer_list<Shape>{Shape{3, 3}});
    if (width < 1 || height < 1) refuse("width and height are not positive");
    const bool each = ks && ks->dimensions() == 3;
    for (size_t i = 0; i < count; ++i) {
        Camera camera;
        camera.width = width;
        camera.height = height;
        set_pose(camera, poses.data() + 16 * i, element("viewmats", i, cameras.batch));
        camera.distortion = distortion;
        if (ks)
            set_intrinsics(camera, ks->data() + (each ? 9 * i : 0), element("Ks", i, each));
        else
            scene::set_equirectangular(camera);
        cameras.all.push_back(camera);
    }
    add_readouts(cameras, readout);
    return cameras;
}

std::string order_of(const Camera& camera) {
    return camera.readout ? core::word_for(scene::kReadoutWords, camera.readout->from) : kGlobal;
}

std::vector<Camera> ends_of(const std::vector<Camera>& cameras) {
    std::vector<Camera> ends = cameras;
    for (Camera& camera : ends) {
        if (!camera.readout) continue;
        camera.rotation = camera.readout->rotation;
        camera.translation = camera.readout->translation;
    }
    return ends;
}

nb::ndarray<nb::numpy, double> viewmats_of(const std::vector<Camera>& cameras) {
    std::vector<double> values;
    for (const Camera& camera : cameras) {
        for (int r = 0; r < 3; ++r) {
            for (int c = 0; c < 3; ++c) values.push_back(camera.rotation[c][r]);
            values.push_back(camera.translation[r]);
        }
        values.insert(values.end(), {0, 0, 0, 1});
    }
    return to_numpy(std::move(values), {cameras.size(), 4, 4});
}

nb::ndarray<nb::numpy, double> intrinsics_of(const std::vector<Camera>& cameras) {
    std::vector<double> values;
    for (const Camera& camera : cameras)
        values.insert(values.end(), {camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1});
    return to_numpy(std::move(values), {cameras.size(), 3, 3});
}

}  // namespace ewa::python
