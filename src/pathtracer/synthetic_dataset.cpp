// SPDX-License-Identifier: Apache-2.0
// Renders a mesh scene to a dataset: read, pack, find cameras and exposure, render each view, sample points,
// and write transforms.json last.
#include "pathtracer/synthetic_dataset.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <nlohmann/json.hpp>

#include "core/atomic_file.h"
#include "core/folders.h"
#include "core/hash.h"
#include "core/json.h"
#include "core/json_field.h"
#include "core/outputs.h"
#include "core/random.h"
#include "core/text.h"
#include "ewa/error.h"
#include "ewa/synthetic_dataset.h"
#include "image/image_files.h"
#include "io/datasets/image_records.h"
#include "io/gltf/mesh.h"
#include "pathtracer/path_tracer.h"
#include "pathtracer/virtual_camera.h"
#include "scene/camera.h"
#include "scene/frustum.h"
#include "scene/intrinsics.h"
#include "scene/native_lens.h"
#include "scene/readout.h"
#include "shared/constants.h"

namespace ewa {
namespace {

namespace fs = std::filesystem;
using pathtracer::PathTracer;

/// The record in a folder of renders. Folders of earlier versions have this name, so it stays.
constexpr const char *kRecord = "photographs.json", *kAppearances = "appearance.json";
constexpr int kDomeViews = 48, kEnoughCameras = 8, kMostViews = 100000;

void check(const SyntheticOptions& o) {
    const auto within = [](const char* what, int64_t value, int64_t low, int64_t high) {
        if (value < low || value > high)
            throw InputError(std::string(what) + ": " + std::to_string(value) + " is not in " +
                             std::to_string(low) + " .. " + std::to_string(high));
    };
    within("--views", o.views.value_or(0), 0, kMostViews);
    within("--size: the width", o.width, 1, 16384);
    within("--size: the height", o.height, 1, 16384);
    within("--samples", o.samples, 1, 65536);
    within("--points", o.points, 0, 10000000);
    if (!scene::is_native(o.lens)) throw InputError("--through: splats cannot be rendered through it");
    if (!(o.fisheye_degrees > 0 && o.fisheye_degrees <= 360))
        throw InputError("--through: the angle is not in 0 .. 360");
    if (o.lens.lens == Lens::equirectangular && o.width != 2 * o.height)
        throw InputError(
            "--through equirectangular: a 360 degree image is twice as wide as high, as with --size 512x256");
    if (o.rolling_shutter && !(std::abs(o.rolling_shutter->degrees) <= 90))
        throw InputError("--rolling-shutter: a readout turns by at most 90 degrees");
    if (o.rolling_shutter && !(o.rolling_shutter->percent >= 0 && o.rolling_shutter->percent <= 100))
        throw InputError("--rolling-shutter: a readout moves by 0 .. 100 % of the distance");
    if (o.exposure && !(std::abs(*o.exposure) <= 60))
        throw InputError("--exposure: is not in -60 .. 60 stops");
}

/// What a position in the image sees at this depth. limit: scene::lens_limit(camera).
glm::dvec3 point_at(const Camera& camera, double limit, double x, double y, double depth) {
    if (camera.distortion.none() && !scene::moves(camera)) return world_point(camera, x, y, depth);
    const auto ray = scene::world_ray(camera, limit, x, y);
    return ray ? ray->origin + depth * ray->direction : camera.position();
}

std::vector<Camera> pinholes_for(const scene::MeshScene& scene, const SyntheticOptions& o,
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

/// Each camera turns about an axis of its own and moves along a line of its own.
void add_readouts(std::vector<Camera>& cameras, const RollingShutter& shutter, uint64_t seed,
                  const glm::dvec3& middle) {
    for (size_t i = 0; i < cameras.size(); ++i) {
        const auto direction = [&](uint32_t kind) {
            const auto v = core::normal3({uint32_t(i), kind, uint32_t(seed), 0x726f6c6cu});
            return glm::normalize(glm::dvec3(v[0], v[1], v[2]));
        };
        const double distance = glm::length(cameras[i].position() - middle);
        scene::add_readout(cameras[i], shutter.from, glm::radians(shutter.degrees) * direction(0),
                           0.01 * shutter.percent * distance * direction(1));
        scene::check_readout(cameras[i]);
    }
}

std::vector<Camera> cameras_for(const scene::MeshScene& scene, const SyntheticOptions& o,
                                const std::string& name) {
    std::vector<Camera> cameras = pinholes_for(scene, o, name);
    const glm::dvec3 middle = scene::bounds_of(scene).center();
    if (!o.lens.none())
        for (Camera& camera : cameras) {
            camera = scene::through_lens(camera, o.lens, o.fisheye_degrees, middle);
            const std::string fault = scene::intrinsics_fault(camera, o.lens);
            if (!fault.empty()) throw InputError("lens: " + fault);
        }
    if (o.rolling_shutter) add_readouts(cameras, *o.rolling_shutter, o.seed, middle);
    return cameras;
}

std::string stem(size_t view, size_t views) {
    const std::string number = std::to_string(view);
    const size_t width = std::max<size_t>(3, std::to_string(views - 1).size());
    return "view_" + std::string(width - number.size(), '0') + number;
}

struct RenderJob {
    SyntheticOptions options;
    fs::path path;  // of the scene's file
    std::string name;
    scene::MeshScene scene;
    pathtracer::PackedScene packed;
    std::vector<Camera> cameras;

    /// A hash of everything that the images depend on.
    std::string fingerprint() const;
    /// Paths relative to the dataset's folder.
    std::string image_name(size_t view) const { return "images/" + stem(view, cameras.size()) + ".png"; }
    std::string depth_name(size_t view) const { return "depth/" + stem(view, cameras.size()) + ".exr"; }
    /// Whether image and depth of a view exist. The depth is written last.
    bool rendered(const fs::path& folder, size_t view) const {
        return fs::exists(folder / image_name(view)) && fs::exists(folder / depth_name(view));
    }
};

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
        if (!camera.readout) continue;
        hash.add(int(camera.readout->from));
        for (int i = 0; i < 3; ++i) {
            hash.add(camera.readout->translation[i]);
            for (int j = 0; j < 3; ++j) hash.add(camera.readout->rotation[i][j]);
        }
    }
    hash.add(options.samples);
    hash.add(options.points);
    hash.add(options.seed);
    hash.add(options.exposure.value_or(1e9));
    if (options.appearance != AppearanceModel::none) hash.add(double(options.appearance));
    if (options.sky) hash.add(std::string("sky"));
    if (const Distortion& d = options.lens; !d.none()) {
        hash.add(int(d.lens));
        for (const double term : {d.k1, d.k2, d.p1, d.p2, d.k3, d.k4, d.k5, d.k6, d.s1, d.s2, d.s3, d.s4})
            hash.add(term);
    }
    char text[17];
    std::snprintf(text, sizeof(text), "%016llx", static_cast<unsigned long long>(hash.value()));
    return text;
}

/// Reads and packs the scene. Throws InputError as io::read_gltf_mesh does, for options out of range, and if
/// the options ask for the file's cameras but it has none.
RenderJob read_render_job(const fs::path& path, const SyntheticOptions& options) {
    check(options);
    RenderJob job{.options = options,
                  .path = path,
                  .name = path.filename().string(),
                  .scene = io::read_gltf_mesh(path),
                  .packed = {},
                  .cameras = {}};
    job.packed = pathtracer::pack(job.scene, pathtracer::decode_images(job.scene));
    job.cameras = cameras_for(job.scene, options, core::one_line(path.string()));
    return job;
}

/// The contents of a folder's record. Empty if the record is missing or unreadable.
struct Record {
    std::string fingerprint;
    std::optional<double> exposure;  // stops
};

std::optional<Record> read_record(const fs::path& folder) {
    std::error_code none;
    if (!fs::exists(folder / kRecord, none)) return std::nullopt;
    nlohmann::json json;
    try {
        json = core::read_json_file<nlohmann::json>(folder / kRecord);
    } catch (const InputError&) {
        return std::nullopt;  // truncated, or not a record of ewa
    }
    Record record{core::text_in(json, "fingerprint"), core::number_in(json, "exposure")};
    return record.fingerprint.empty() ? std::nullopt : std::optional(std::move(record));
}

class DatasetJob {
  public:
    DatasetJob(const std::shared_ptr<gpu::Device>& device, RenderJob job, const fs::path& folder)
        : job_(std::move(job)), folder_(folder), tracer_(device, job_.packed, job_.scene.sky) {
        record_ = {{"scene", job_.name},
                   {"views", cameras_.size()},
                   {"samples", options_.samples},
                   {"seed", options_.seed},
                   {"fingerprint", job_.fingerprint()}};
        result_.views = int(cameras_.size());
        result_.color_depends_on_view = scene::color_depends_on_view(job_.scene);
        result_.dropped_triangles = job_.scene.dropped_triangles;
        result_.remarks = job_.scene.remarks;
        if (options_.appearance == AppearanceModel::none) return;
        const std::vector<Ppisp> varied = pathtracer::varied_appearances(cameras_.size(), options_.seed);
        appearances_.assign(varied.begin(), varied.end());
    }

    SyntheticDataset run(const std::function<bool(int, int)>& progress) {
        prepare_folder();
        result_.interrupted = !progress(0, int(cameras_.size()));
        for (size_t i = 0; i < cameras_.size() && !result_.interrupted; ++i) {
            if (job_.rendered(folder_, i))
                ++result_.kept;
            else
                render(i);
            result_.interrupted = !progress(int(i) + 1, int(cameras_.size()));
        }
        if (!result_.interrupted) finish();
        result_.unfinished_rays = tracer_.unfinished_rays();
        result_.dropped_samples = tracer_.dropped_samples();
        return result_;
    }

  private:
    /// Removes the files of an earlier run, and no others.
    void remove_views() {
        std::vector<fs::path> old{folder_ / "transforms.json", folder_ / kAppearances};
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

    void check_outputs() const {
        std::vector<core::NamedFile> written;
        for (const char* name : {kRecord, "transforms.json", "points.ply", kAppearances})
            written.push_back({"the dataset's", folder_ / name});
        for (size_t i = 0; i < cameras_.size(); ++i)
            for (const fs::path& name : {fs::path(job_.image_name(i)), fs::path(job_.depth_name(i))})
                written.push_back({"the view", folder_ / name});
        core::check_outputs(written, {{"SCENE", job_.path}});
    }

    /// Throws InputError if the folder has views, which are of another scene or other options.
    void refuse_to_replace() const {
        size_t views = 0;
        std::error_code absent;
        for (const fs::directory_entry& entry : fs::directory_iterator(folder_ / "images", absent))
            views += entry.path().filename().string().rfind("view_", 0) == 0;
        if (views == 0) return;
        throw InputError(
            core::one_line(folder_.string()) + ": holds " + std::to_string(views) +
            (views == 1 ? " view" : " views") +
            " of another scene or other options; --force replaces them, -o DIR takes another folder");
    }

    /// Continues an earlier run if its record matches. Else removes its files, if options.force allows that.
    void prepare_folder() {
        check_outputs();
        core::make_folder(folder_);
        const auto earlier = read_record(folder_);
        for (const char* name :
             {kRecord, "transforms.json", "points.ply", kAppearances, "images", "depth", "sparse"})
            if (!earlier && fs::exists(folder_ / name))
                throw InputError(
                    core::one_line(folder_.string() + ": holds \"" + name +
                                   "\" that ewa did not render from a mesh scene; name another folder"));
        const bool same =
            earlier && earlier->exposure && earlier->fingerprint == record_["fingerprint"].get<std::string>();
        if (!same && earlier && !options_.force) refuse_to_replace();
        if (!same) remove_views();
        result_.exposure = same ? *earlier->exposure : options_.exposure ? *options_.exposure : measured();
        record_["exposure"] = result_.exposure;
        // Written before the folders, which without it would count as another program's.
        core::write_text_file(folder_ / kRecord, record_.dump(1) + "\n");
        for (const char* name : {"images", "depth"}) core::make_folder(folder_ / name);
    }

    /// Measures the exposure in a few small images.
    double measured() {
        constexpr size_t kImages = 8;
        constexpr int kSmaller = 4, kSamples = 8;
        std::vector<Image> radiances;
        const size_t count = std::min(kImages, cameras_.size());
        for (size_t i = 0; i < count; ++i)
            radiances.push_back(tracer_.radiance(downscale(cameras_[i * cameras_.size() / count], kSmaller),
                                                 kSamples, options_.seed,
                                                 std::numeric_limits<double>::infinity()));
        return pathtracer::automatic_exposure(radiances);
    }

    void render(size_t i) {
        const double factor = std::exp2(result_.exposure);
        // Each view has its own random numbers.
        const auto words =
            core::pcg4d({uint32_t(i), 0, uint32_t(options_.seed), uint32_t(options_.seed >> 32)});
        const uint64_t seed = uint64_t(words[0]) << 32 | words[1];
        Image radiance =
            tracer_.radiance(cameras_[i], options_.samples, seed, shared::TRACE_SAMPLE_MAX / factor);
        if (options_.sky) pathtracer::show_sky(radiance, cameras_[i], job_.scene.sky);
        Image image = pathtracer::develop(radiance, factor);
        if (!appearances_.empty()) image = with_appearance(std::move(image), appearances_[i]);
        save_image(folder_ / job_.image_name(i), image);
        save_image(folder_ / job_.depth_name(i), tracer_.seen(cameras_[i]).depth);
    }

    /// Equally many points from random pixels of each view. A pixel without a surface gives none, and another is tried: a wide lens
    /// shows much sky. A view that shows hardly anything gives less.
    PointCloud points() const {
        PointCloud cloud;
        if (options_.points == 0) return cloud;
        constexpr uint32_t kTries = 64;  // for a point
        const auto each = uint32_t((size_t(options_.points) + cameras_.size() - 1) / cameras_.size());
        for (size_t view = 0; view < cameras_.size(); ++view) {
            const Camera& camera = cameras_[view];
            const double limit = scene::lens_limit(camera);
            const Image image = load_image(folder_ / job_.image_name(view)),
                        depth = load_image(folder_ / job_.depth_name(view));
            const size_t enough = std::min(cloud.positions.size() + each, size_t(options_.points));
            for (uint32_t i = 0; i < kTries * each && cloud.positions.size() < enough; ++i) {
                const auto u = core::uniform4({i, uint32_t(view), uint32_t(options_.seed), 0x706f696eu});
                const int x = int(u[0] * camera.width), y = int(u[1] * camera.height);
                const double z = double(depth.at(x, y)[0]);
                if (!(z > 0) || (image.channels == 4 && image.at(x, y)[3] < 0.5f)) continue;
                cloud.positions.push_back(point_at(camera, limit, x + 0.5, y + 0.5, z));
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
        std::vector<std::string> names;
        for (size_t i = 0; i < cameras_.size(); ++i) names.push_back(job_.image_name(i));
        if (!appearances_.empty()) save_appearances(folder_ / kAppearances, names, appearances_);
        for (size_t i = 0; i < cameras_.size(); ++i)
            file.frames.push_back({job_.image_name(i), job_.depth_name(i), cameras_[i]});
        io::write_transforms(folder_ / "transforms.json", file);
    }

    RenderJob job_;
    const SyntheticOptions& options_ = job_.options;
    const std::vector<Camera>& cameras_ = job_.cameras;
    fs::path folder_;
    PathTracer tracer_;
    nlohmann::ordered_json record_;
    std::vector<Appearance> appearances_;  // of the views; empty: none
    SyntheticDataset result_;
};

}  // namespace

std::vector<Image> pathtracer::decode_images(const scene::MeshScene& scene) {
    constexpr int kLargest = 8192;
    std::vector<Image> images;
    for (const scene::EncodedImage& encoded : scene.images)
        images.push_back(image::decode(encoded.bytes, encoded.what, kLargest));
    return images;
}

bool is_mesh_scene(const fs::path& path) {
    return io::is_gltf_mesh(path);
}

bool is_rendered(const fs::path& scene, const fs::path& folder, const SyntheticOptions& options) {
    std::error_code none;
    const auto record = read_record(folder);
    if (!record || !fs::exists(folder / "transforms.json", none)) return false;
    const RenderJob job = read_render_job(scene, options);
    if (record->fingerprint != job.fingerprint()) return false;
    for (size_t i = 0; i < job.cameras.size(); ++i)
        if (!job.rendered(folder, i)) return false;
    return true;
}

Dataset scene_cameras(const fs::path& path, const SyntheticOptions& options) {
    check(options);
    const scene::MeshScene scene = io::read_gltf_mesh(path);
    const std::vector<Camera> cameras = cameras_for(scene, options, core::one_line(path.string()));
    Dataset dataset;
    dataset.root = path;
    dataset.color_depends_on_view = scene::color_depends_on_view(scene);
    for (size_t i = 0; i < cameras.size(); ++i) {
        Frame frame;
        frame.name = "images/" + stem(i, cameras.size()) + ".png";
        frame.camera = frame.source = frame.pinhole = cameras[i];
        dataset.frames.push_back(frame);
    }
    return dataset;
}

SyntheticDataset render_dataset(const std::shared_ptr<gpu::Device>& device, const fs::path& scene,
                                const fs::path& folder, const SyntheticOptions& options,
                                const std::function<bool(int, int)>& progress) {
    return DatasetJob(device, read_render_job(scene, options), folder).run(progress);
}

}  // namespace ewa
