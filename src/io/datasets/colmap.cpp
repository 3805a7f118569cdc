// SPDX-License-Identifier: Apache-2.0
#include "io/datasets/colmap.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/quaternion.hpp>

#include "core/sandboxed_path.h"
#include "core/text.h"
#include "ewa/error.h"
#include "io/datasets/colmap_model.h"

namespace ewa::io {

namespace {

using D = Distortion;

// In the order of COLMAP's model ids, each with its parameters after the principal point in the file's order
// (src/colmap/sensor/models.h).
constexpr ColmapLens kLenses[] = {
    {"SIMPLE_PINHOLE", 1, Lens::brown, {}},
    {"PINHOLE", 2, Lens::brown, {}},
    {"SIMPLE_RADIAL", 1, Lens::brown, {&D::k1}},
    {"RADIAL", 1, Lens::brown, {&D::k1, &D::k2}},
    {"OPENCV", 2, Lens::brown, {&D::k1, &D::k2, &D::p1, &D::p2}},
    {"OPENCV_FISHEYE", 2, Lens::fisheye, {&D::k1, &D::k2, &D::k3, &D::k4}},
    {"FULL_OPENCV", 2, Lens::brown, {&D::k1, &D::k2, &D::p1, &D::p2, &D::k3, &D::k4, &D::k5, &D::k6}},
    {"FOV", 2, Lens::fov, {&D::k1}},
    {"SIMPLE_RADIAL_FISHEYE", 1, Lens::fisheye, {&D::k1}},
    {"RADIAL_FISHEYE", 1, Lens::fisheye, {&D::k1, &D::k2}},
    {"THIN_PRISM_FISHEYE",
     2,
     Lens::fisheye,
     {&D::k1, &D::k2, &D::p1, &D::p2, &D::k3, &D::k4, &D::s1, &D::s3}},
    {"RAD_TAN_THIN_PRISM_FISHEYE",
     2,
     Lens::fisheye624,
     {&D::k1, &D::k2, &D::k3, &D::k4, &D::k5, &D::k6, &D::p2, &D::p1, &D::s1, &D::s2, &D::s3, &D::s4}},
    {"SIMPLE_DIVISION", 1, Lens::division, {&D::k1}},
    {"DIVISION", 2, Lens::division, {&D::k1}},
    {"SIMPLE_FISHEYE", 1, Lens::fisheye, {}},
    {"FISHEYE", 2, Lens::fisheye, {}},
    {"EUCM", 2, Lens::unified, {&D::k1, &D::k2}}};

constexpr uint64_t kMaxSize = 1u << 20;  // px

}  // namespace

size_t ColmapLens::parameters() const {
    const auto end = std::find(terms.begin(), terms.end(), nullptr);
    return focal_lengths + 2 + size_t(end - terms.begin());
}

const ColmapLens* colmap_lens(int64_t id) {
    return id >= 0 && id < int64_t(std::size(kLenses)) ? &kLenses[id] : nullptr;
}

const ColmapLens* colmap_lens(std::string_view name) {
    const auto* found =
        std::find_if(std::begin(kLenses), std::end(kLenses), [&](auto& lens) { return lens.name == name; });
    return found == std::end(kLenses) ? nullptr : found;
}

void ColmapBuilder::add_camera(uint32_t id, const ColmapLens& lens, uint64_t width, uint64_t height,
                               const std::vector<double>& parameters, const Fail& fail) {
    const std::string camera_name = "camera " + std::to_string(id);
    if (width < 1 || height < 1 || width > kMaxSize || height > kMaxSize)
        fail(camera_name + " is " + std::to_string(width) + " x " + std::to_string(height) + " pixels large");
    Camera camera;
    camera.width = static_cast<int>(width);
    camera.height = static_cast<int>(height);
    camera.fx = parameters[0];
    camera.fy = parameters[lens.focal_lengths - 1];
    camera.cx = parameters[lens.focal_lengths];
    camera.cy = parameters[lens.focal_lengths + 1];
    Distortion distortion;
    for (size_t i = lens.focal_lengths + 2; i < parameters.size(); ++i)
        distortion.*lens.terms[i - lens.focal_lengths - 2] = parameters[i];
    distortion.lens = lens.lens;
    const bool finite =
        std::all_of(parameters.begin(), parameters.end(), [](double v) { return std::isfinite(v); });
    if (!(camera.fx > 0 && camera.fy > 0) || !finite)
        fail(camera_name + " has a focal length that is not positive, or a parameter that is not finite");
    if (!cameras_.emplace(id, Taken{camera, distortion}).second) fail(camera_name + " is there twice");
}

void ColmapBuilder::add_image(const std::array<double, 7>& pose, uint32_t camera_id, const std::string& name,
                              const Fail& fail) {
    const std::string image_name = "image \"" + core::one_line(name) + "\"";
    const auto inside = core::name_inside(name);
    if (!inside) return fail(image_name + " lies outside the images folder");
    if (!core::links_stay_with_pictures(images_.parent_path(), images_.filename() / *inside))
        fail(image_name + " is a link out of the dataset's folder; " + core::kLinkAdvice);
    const auto camera = cameras_.find(camera_id);
    if (camera == cameras_.end())
        fail(image_name + " has camera " + std::to_string(camera_id) + ", which is not there");
    double largest = 0;
    for (double v : pose)
        if (!std::isfinite(v)) fail(image_name + " has a pose that is not finite");
    for (size_t i = 0; i < 4; ++i) largest = std::max(largest, std::abs(pose[i]));
    if (largest == 0) fail(image_name + " has a quaternion of zero");
    // Divided first, so that the squares of very small or large components do not leave the range of double.
    const glm::dquat q = glm::normalize(
        glm::dquat(pose[0] / largest, pose[1] / largest, pose[2] / largest, pose[3] / largest));
    PosedImage image;
    image.name = name;
    image.path = images_ / *inside;
    image.camera = camera->second.camera;
    image.distortion = camera->second.distortion;
    image.camera.rotation = glm::mat3_cast(q);
    image.camera.translation = {pose[4], pose[5], pose[6]};
    result_.images.push_back(std::move(image));
}

void ColmapBuilder::add_point(const glm::dvec3& position, const std::array<uint8_t, 3>& color,
                              const std::function<std::string()>& where) {
    io::add_point(result_.points, result_.dropped, position, color, where);
}

std::optional<std::filesystem::path> find_colmap_model(const std::filesystem::path& root) {
    std::error_code ignored;
    for (const std::filesystem::path& folder : {root / "sparse" / "0", root / "sparse", root})
        for (const char* extension : {".bin", ".txt"})
            if (std::filesystem::exists(folder / (std::string("cameras") + extension), ignored) &&
                std::filesystem::exists(folder / (std::string("images") + extension), ignored))
                return folder;
    return std::nullopt;
}

PosedImages read_colmap(const std::filesystem::path& model, const std::filesystem::path& images) {
    ColmapBuilder builder(images);
    if (std::filesystem::exists(model / "cameras.bin") && std::filesystem::exists(model / "images.bin"))
        read_colmap_binary(model, builder);
    else
        read_colmap_text(model, builder);
    return builder.take();
}

}  // namespace ewa::io
