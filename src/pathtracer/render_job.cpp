// SPDX-License-Identifier: Apache-2.0
#include "pathtracer/render_job.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "core/hash.h"
#include "core/json.h"
#include "core/text.h"
#include "ewa/error.h"
#include "image/image_files.h"
#include "io/gltf/mesh.h"
#include "pathtracer/virtual_camera.h"

namespace ewa {
namespace pathtracer {
namespace {

namespace fs = std::filesystem;

constexpr int kDomeViews = 48, kEnoughCameras = 8, kMostViews = 100000;

void check(const SyntheticOptions& o) {
    const auto within = [](const char* what, int64_t value, int64_t low, int64_t high) {
        if (value < low || value > high)
            throw InputError(std::string(what) + ": " + std::to_string(value) + " is not in " +
                             std::to_string(low) + " .. " + std::to_string(high));
    };
    within("views", o.views.value_or(0), 0, kMostViews);
    within("width", o.width, 1, 16384);
    within("height", o.height, 1, 16384);
    within("samples", o.samples, 1, 65536);
    within("points", o.points, 0, 10000000);
    if (o.exposure && !(std::abs(*o.exposure) <= 60)) throw InputError("exposure: is not in -60 .. 60 stops");
}

std::vector<Camera> cameras_for(const scene::MeshScene& scene, const SyntheticOptions& o,
                                const std::string& name) {
    const size_t in_file = scene.cameras.size();
    const bool from_file = o.views ? *o.views == 0 : in_file >= kEnoughCameras;
    if (!from_file)
        return pathtracer::dome_cameras(scene::bounds_of(scene), o.views.value_or(kDomeViews), o.width,
                                        o.height);
    if (in_file == 0)
        throw InputError(name + ": has no perspective cameras; --views N places N on a dome over the scene");
    std::vector<Camera> cameras;
    for (const scene::FileCamera& camera : scene.cameras)
        cameras.push_back(pathtracer::pinhole_of(camera, o.width, o.height));
    return cameras;
}

std::string stem(size_t view, size_t views) {
    const std::string number = std::to_string(view);
    const size_t width = std::max<size_t>(3, std::to_string(views - 1).size());
    return "view_" + std::string(width - number.size(), '0') + number;
}

}  // namespace

std::string RenderJob::fingerprint() const {
    core::Hash hash;
    hash.add(std::string("photographs of ewa " EWA_VERSION));
    for (const auto* words : {&packed.nodes, &packed.triangles, &packed.surfaces, &packed.materials,
                              &packed.textures, &packed.lights, &packed.texels})
        hash.add(words->data(), words->size() * sizeof(uint32_t));
    for (const glm::vec3& v : {scene.sky.zenith, scene.sky.horizon, scene.sky.ground})
        for (int i = 0; i < 3; ++i) hash.add(v[i]);
    for (int i = 0; i < 3; ++i) hash.add(packed.origin[i]);
    hash.add(packed.unit);
    for (const Camera& camera : cameras) {
        for (const double x :
             {double(camera.width), double(camera.height), camera.fx, camera.fy, camera.cx, camera.cy})
            hash.add(x);
        for (int i = 0; i < 3; ++i) {
            hash.add(camera.translation[i]);
            for (int j = 0; j < 3; ++j) hash.add(camera.rotation[i][j]);
        }
    }
    hash.add(options.samples);
    hash.add(options.points);
    hash.add(options.seed);
    hash.add(options.exposure.value_or(1e9));
    char text[17];
    std::snprintf(text, sizeof(text), "%016llx", static_cast<unsigned long long>(hash.value()));
    return text;
}

std::string RenderJob::image_name(size_t view) const {
    return "images/" + stem(view, cameras.size()) + ".png";
}

std::string RenderJob::depth_name(size_t view) const {
    return "depth/" + stem(view, cameras.size()) + ".exr";
}

bool RenderJob::rendered(const fs::path& folder, size_t view) const {
    return fs::exists(folder / image_name(view)) && fs::exists(folder / depth_name(view));
}

std::vector<Image> decode_images(const scene::MeshScene& scene) {
    constexpr int kLargest = 8192;
    std::vector<Image> images;
    for (const scene::EncodedImage& encoded : scene.images)
        images.push_back(image::decode(encoded.bytes, encoded.what, kLargest));
    return images;
}

RenderJob read_render_job(const fs::path& path, const SyntheticOptions& options) {
    check(options);
    RenderJob job{.options = options,
                  .name = path.filename().string(),
                  .scene = io::read_gltf_mesh(path),
                  .packed = {},
                  .cameras = {}};
    job.packed = pathtracer::pack(job.scene, decode_images(job.scene));
    job.cameras = cameras_for(job.scene, options, core::one_line(path.string()));
    return job;
}

std::optional<Record> read_record(const fs::path& folder) {
    std::error_code none;
    if (!fs::exists(folder / kRecord, none)) return std::nullopt;
    nlohmann::json json;
    try {
        json = core::read_json_file<nlohmann::json>(folder / kRecord);
    } catch (const InputError&) {
        return std::nullopt;  // truncated, or not a record of ewa
    }
    if (!json.is_object() || !json.contains("fingerprint") || !json["fingerprint"].is_string())
        return std::nullopt;
    Record record{.fingerprint = json["fingerprint"].get<std::string>(), .exposure = std::nullopt};
    if (json.contains("exposure") && json["exposure"].is_number())
        record.exposure = json["exposure"].get<double>();
    return record;
}

}  // namespace pathtracer

bool is_mesh_scene(const std::filesystem::path& path) {
    return io::is_gltf_mesh(path);
}

bool is_rendered(const std::filesystem::path& scene, const std::filesystem::path& folder,
                 const SyntheticOptions& options) {
    std::error_code none;
    const auto record = pathtracer::read_record(folder);
    if (!record || !std::filesystem::exists(folder / "transforms.json", none)) return false;
    const pathtracer::RenderJob job = pathtracer::read_render_job(scene, options);
    if (record->fingerprint != job.fingerprint()) return false;
    for (size_t i = 0; i < job.cameras.size(); ++i)
        if (!job.rendered(folder, i)) return false;
    return true;
}

Dataset scene_cameras(const std::filesystem::path& path, const SyntheticOptions& options) {
    pathtracer::check(options);
    const scene::MeshScene scene = io::read_gltf_mesh(path);
    const std::vector<Camera> cameras =
        pathtracer::cameras_for(scene, options, core::one_line(path.string()));
    Dataset dataset;
    dataset.root = path;
    dataset.color_depends_on_view = scene::color_depends_on_view(scene);
    for (size_t i = 0; i < cameras.size(); ++i) {
        Frame frame;
        frame.name = "images/" + pathtracer::stem(i, cameras.size()) + ".png";
        frame.camera = frame.source = frame.pinhole = cameras[i];
        dataset.frames.push_back(frame);
    }
    return dataset;
}

}  // namespace ewa
