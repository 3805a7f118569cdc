#include "io/colmap.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/quaternion.hpp>

#include "core/text.h"
#include "ewa/error.h"
#include "io/colmap_model.h"

namespace ewa::io {

namespace {

// In the order of COLMAP's model ids (src/colmap/sensor/models.h).
constexpr ColmapLens kLenses[] = {{"SIMPLE_PINHOLE", 3},
                                  {"PINHOLE", 4},
                                  {"SIMPLE_RADIAL", 4},
                                  {"RADIAL", 5},
                                  {"OPENCV", 8},
                                  {"OPENCV_FISHEYE", 8},
                                  {"FULL_OPENCV", 12},
                                  {"FOV", 5},
                                  {"SIMPLE_RADIAL_FISHEYE", 4},
                                  {"RADIAL_FISHEYE", 5},
                                  {"THIN_PRISM_FISHEYE", 12},
                                  {"RAD_TAN_THIN_PRISM_FISHEYE", 16}};

/// Parameters before the distortion: 3 (f cx cy) or 4 (fx fy cx cy); 0 for a lens that is no pinhole at any
/// distortion.
size_t pinhole_parameters(std::string_view lens) {
    if (lens == "SIMPLE_PINHOLE" || lens == "SIMPLE_RADIAL" || lens == "RADIAL") return 3;
    if (lens == "PINHOLE" || lens == "OPENCV" || lens == "FULL_OPENCV") return 4;
    return 0;
}

constexpr uint64_t kMaxSize = 1u << 20;  // px

/// Names come from a file that somebody else may have made; they must stay inside the images folder.
bool leaves_folder(const std::string& name) {
    std::string slashes = name;
    std::replace(slashes.begin(), slashes.end(), '\\', '/');
    const std::filesystem::path path = std::filesystem::path(slashes).lexically_normal();
    const bool drive = name.size() > 1 && name[1] == ':';
    return path.empty() || drive || path.is_absolute() || *path.begin() == "..";
}

}  // namespace

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
    const size_t pinhole = pinhole_parameters(lens.name);
    const bool distorted = std::any_of(parameters.begin() + std::ptrdiff_t(pinhole), parameters.end(),
                                       [](double v) { return v != 0; });
    if (pinhole == 0 || distorted)
        fail(camera_name + " has the lens model " + std::string(lens.name) +
             "; undistort the images with `colmap image_undistorter` and use its output");
    if (width < 1 || height < 1 || width > kMaxSize || height > kMaxSize)
        fail(camera_name + " is " + std::to_string(width) + " x " + std::to_string(height) + " pixels large");
    Camera camera;
    camera.width = static_cast<int>(width);
    camera.height = static_cast<int>(height);
    camera.fx = parameters[0];
    camera.fy = parameters[pinhole - 3];
    camera.cx = parameters[pinhole - 2];
    camera.cy = parameters[pinhole - 1];
    if (!(camera.fx > 0 && camera.fy > 0) || !std::isfinite(camera.fx + camera.fy + camera.cx + camera.cy))
        fail(camera_name + " has a focal length that is not positive, or a parameter that is not finite");
    if (!cameras_.emplace(id, camera).second) fail(camera_name + " is there twice");
}

void ColmapBuilder::add_image(const std::array<double, 7>& pose, uint32_t camera_id, const std::string& name,
                              const Fail& fail) {
    const std::string image_name = "image \"" + core::one_line(name) + "\"";
    if (leaves_folder(name)) fail(image_name + " lies outside the images folder");
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
    image.path = images_ / name;
    image.camera = camera->second;
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
