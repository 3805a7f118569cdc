// SPDX-License-Identifier: Apache-2.0
// The order of the work: read, pack, find the cameras and the exposure, photograph view after view, choose
// points, and write transforms.json last.
#include "ewa/photograph.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <glm/matrix.hpp>
#include <nlohmann/json.hpp>

#include "core/atomic_file.h"
#include "core/file_reader.h"
#include "core/hash.h"
#include "core/random.h"
#include "core/text.h"
#include "ewa/error.h"
#include "io/gltf_mesh.h"
#include "io/transforms_write.h"
#include "mesh/dome.h"
#include "photograph/exposure.h"
#include "photograph/photographer.h"
#include "shared/constants.h"

namespace ewa {

namespace {

namespace fs = std::filesystem;
using photograph::Photographer;

constexpr int kDomeViews = 48, kEnoughCameras = 8, kMostViews = 100000;
constexpr const char* kRecord = "photographs.json";

void check(const PhotographOptions& o) {
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

void make_folder(const fs::path& folder) {
    std::error_code error;
    fs::create_directories(folder, error);
    if (error || !fs::is_directory(folder))
        throw RunError(core::one_line(folder.string() + ": the folder cannot be made: " + error.message()));
}

std::vector<Camera> cameras_for(const mesh::Scene& scene, const PhotographOptions& o,
                                const std::string& name) {
    const size_t in_file = scene.cameras.size();
    const bool from_file = o.views ? *o.views == 0 : in_file >= kEnoughCameras;
    if (!from_file)
        return mesh::dome_cameras(mesh::bounds_of(scene), o.views.value_or(kDomeViews), o.width, o.height);
    if (in_file == 0)
        throw InputError(name + ": has no perspective cameras; --views N puts N on a dome over the scene");
    std::vector<Camera> cameras;
    for (const mesh::FileCamera& camera : scene.cameras)
        cameras.push_back(mesh::pinhole_of(camera, o.width, o.height));
    return cameras;
}

/// What the pictures depend on.
std::string fingerprint(const mesh::PackedScene& packed, const mesh::Sky& sky,
                        const std::vector<Camera>& cameras, const PhotographOptions& o) {
    core::Hash hash;
    hash.add(std::string("photographs of ewa " EWA_VERSION));
    for (const auto* words : {&packed.nodes, &packed.triangles, &packed.surfaces, &packed.materials,
                              &packed.textures, &packed.lights, &packed.texels})
        hash.add(words->data(), words->size() * sizeof(uint32_t));
    for (const glm::vec3& v : {sky.zenith, sky.horizon, sky.ground})
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
    hash.add(o.samples);
    hash.add(o.points);
    hash.add(o.seed);
    hash.add(o.exposure.value_or(1e9));
    char text[17];
    std::snprintf(text, sizeof(text), "%016llx", static_cast<unsigned long long>(hash.value()));
    return text;
}

class Run {
  public:
    Run(const std::shared_ptr<gpu::Device>& device, const fs::path& scene, const fs::path& folder,
        const PhotographOptions& options)
        : options_(options),
          folder_(folder),
          scene_(io::read_gltf_mesh(scene)),
          packed_(mesh::pack(scene_, photograph::decode_images(scene_))),
          cameras_(cameras_for(scene_, options, core::one_line(scene.string()))),
          photographer_(device, packed_, scene_.sky) {
        record_ = {{"scene", scene.filename().string()},
                   {"views", cameras_.size()},
                   {"samples", options.samples},
                   {"seed", options.seed},
                   {"fingerprint", fingerprint(packed_, scene_.sky, cameras_, options)}};
        result_.views = int(cameras_.size());
        result_.color_depends_on_view = mesh::color_depends_on_view(scene_);
        result_.dropped_triangles = scene_.dropped_triangles;
        result_.remarks = scene_.remarks;
    }

    Photographs run(const std::function<bool(int, int)>& progress) {
        prepare_folder();
        result_.interrupted = !progress(0, int(cameras_.size()));
        for (size_t i = 0; i < cameras_.size() && !result_.interrupted; ++i) {
            if (done(i))
                ++result_.kept;
            else
                photograph(i);
            result_.interrupted = !progress(int(i) + 1, int(cameras_.size()));
        }
        if (!result_.interrupted) finish();
        result_.unfinished_rays = photographer_.unfinished_rays();
        result_.dropped_samples = photographer_.dropped_samples();
        return result_;
    }

  private:
    std::string stem(size_t i) const {
        const std::string number = std::to_string(i);
        const size_t width = std::max<size_t>(3, std::to_string(cameras_.size() - 1).size());
        return "view_" + std::string(width - number.size(), '0') + number;
    }
    std::string image_name(size_t i) const { return "images/" + stem(i) + ".png"; }
    std::string depth_name(size_t i) const { return "depth/" + stem(i) + ".exr"; }
    /// The depth is written last.
    bool done(size_t i) const {
        return fs::exists(folder_ / image_name(i)) && fs::exists(folder_ / depth_name(i));
    }

    /// The files an earlier run wrote, and no others.
    void remove_views() {
        std::vector<fs::path> old{folder_ / "transforms.json"};
        for (const char* name : {"images", "depth"}) {
            std::error_code absent;
            for (const fs::directory_entry& entry : fs::directory_iterator(folder_ / name, absent))
                if (entry.path().filename().string().rfind("view_", 0) == 0) old.push_back(entry.path());
        }
        for (const fs::path& path : old) {
            std::error_code error;
            fs::remove(path, error);
            if (error)
                throw RunError(core::one_line(path.string()) + ": cannot be removed: " + error.message());
        }
    }

    /// What an earlier run recorded, where its pictures are the same; else the folder is cleared of them.
    void prepare_folder() {
        make_folder(folder_);
        using Json = nlohmann::json;
        Json earlier;
        if (fs::exists(folder_ / kRecord))
            earlier = Json::parse(core::read_text_file(folder_ / kRecord), nullptr, false);
        const bool recorded =
            earlier.is_object() && earlier.contains("fingerprint") && earlier["fingerprint"].is_string();
        for (const char* name : {kRecord, "transforms.json", "points.ply", "images", "depth", "sparse"})
            if (!recorded && fs::exists(folder_ / name))
                throw InputError(
                    core::one_line(folder_.string() + ": holds \"" + name +
                                   "\" that are no photographs of a mesh scene; name another folder"));
        core::remove_abandoned_files(folder_);
        const bool same =
            recorded &&
            earlier["fingerprint"].get<std::string>() == record_["fingerprint"].get<std::string>() &&
            earlier.contains("exposure") && earlier["exposure"].is_number();
        if (!same) remove_views();
        make_folder(folder_ / "images");
        make_folder(folder_ / "depth");
        core::remove_abandoned_files(folder_ / "images");
        core::remove_abandoned_files(folder_ / "depth");
        result_.exposure = same                ? earlier["exposure"].get<double>()
                           : options_.exposure ? *options_.exposure
                                               : measured();
        record_["exposure"] = result_.exposure;
        core::write_text_file(folder_ / kRecord, record_.dump(1) + "\n");
    }

    /// From a few small pictures.
    double measured() {
        constexpr size_t kPictures = 8;
        constexpr int kSmaller = 4, kSamples = 8;
        std::vector<Image> radiances;
        const size_t count = std::min(kPictures, cameras_.size());
        for (size_t i = 0; i < count; ++i)
            radiances.push_back(
                photographer_.radiance(downscale(cameras_[i * cameras_.size() / count], kSmaller), kSamples,
                                       options_.seed, std::numeric_limits<double>::infinity()));
        return photograph::automatic_exposure(radiances);
    }

    void photograph(size_t i) {
        const double factor = std::exp2(result_.exposure);
        // Each view has numbers of its own.
        const auto words =
            core::pcg4d({uint32_t(i), 0, uint32_t(options_.seed), uint32_t(options_.seed >> 32)});
        const uint64_t seed = uint64_t(words[0]) << 32 | words[1];
        const Image radiance =
            photographer_.radiance(cameras_[i], options_.samples, seed, shared::TRACE_SAMPLE_MAX / factor);
        save_image(folder_ / image_name(i), photograph::develop(radiance, factor));
        save_image(folder_ / depth_name(i), photographer_.seen(cameras_[i]).depth);
    }

    /// As many from each view, at pixels drawn by counting; those that see nothing give none.
    PointCloud points() const {
        PointCloud cloud;
        if (options_.points == 0) return cloud;
        const auto each = uint32_t((size_t(options_.points) + cameras_.size() - 1) / cameras_.size());
        for (size_t view = 0; view < cameras_.size(); ++view) {
            const Camera& camera = cameras_[view];
            const Image image = load_image(folder_ / image_name(view)),
                        depth = load_image(folder_ / depth_name(view));
            for (uint32_t i = 0; i < each && cloud.positions.size() < size_t(options_.points); ++i) {
                const auto u = core::uniform4({i, uint32_t(view), uint32_t(options_.seed), 0x706f696eu});
                const int x = int(u[0] * camera.width), y = int(u[1] * camera.height);
                const double z = double(depth.at(x, y)[0]);
                if (!(z > 0) || (image.channels == 4 && image.at(x, y)[3] < 0.5f)) continue;
                const glm::dvec3 seen((x + 0.5 - camera.cx) / camera.fx * z,
                                      (y + 0.5 - camera.cy) / camera.fy * z, z);
                cloud.positions.push_back(glm::transpose(camera.rotation) * (seen - camera.translation));
                std::array<uint8_t, 3> color;
                for (size_t c = 0; c < 3; ++c)
                    color[c] = uint8_t(std::lround(double(image.at(x, y)[c]) * 255));
                cloud.colors.push_back(color);
            }
        }
        return cloud;
    }

    void finish() {
        io::TransformsFile file;
        file.color_depends_on_view = result_.color_depends_on_view;
        char exposure[32];
        std::snprintf(exposure, sizeof(exposure), "%.4g", result_.exposure);
        file.remarks = {
            {"scene", record_["scene"].get<std::string>()},
            {"tone_mapping", std::string("sRGB curve over min(1, radiance * 2^") + exposure + ")"}};
        if (const PointCloud cloud = points(); !cloud.positions.empty()) {
            io::write_points_ply(folder_ / "points.ply", cloud);
            file.points = "points.ply";
        }
        for (size_t i = 0; i < cameras_.size(); ++i)
            file.frames.push_back({image_name(i), depth_name(i), cameras_[i]});
        io::write_transforms(folder_ / "transforms.json", file);
    }

    PhotographOptions options_;
    fs::path folder_;
    mesh::Scene scene_;
    mesh::PackedScene packed_;
    std::vector<Camera> cameras_;
    Photographer photographer_;
    nlohmann::ordered_json record_;
    Photographs result_;
};

}  // namespace

bool is_mesh_scene(const fs::path& path) {
    return io::is_gltf_mesh(path);
}

Photographs photograph_scene(const std::shared_ptr<gpu::Device>& device, const fs::path& scene,
                             const fs::path& folder, const PhotographOptions& options,
                             const std::function<bool(int, int)>& progress) {
    check(options);
    return Run(device, scene, folder, options).run(progress);
}

}  // namespace ewa
