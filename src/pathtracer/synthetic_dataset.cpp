// SPDX-License-Identifier: Apache-2.0
// Renders a mesh scene to a dataset: read, pack, find cameras and exposure, render each view, sample points,
// and write transforms.json last.
#include "ewa/synthetic_dataset.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <glm/matrix.hpp>
#include <nlohmann/json.hpp>

#include "core/atomic_file.h"
#include "core/random.h"
#include "core/text.h"
#include "ewa/error.h"
#include "io/datasets/image_records.h"
#include "pathtracer/path_tracer.h"
#include "pathtracer/render_job.h"
#include "pathtracer/virtual_camera.h"
#include "shared/constants.h"

namespace ewa {

namespace {

namespace fs = std::filesystem;
using pathtracer::PathTracer;

void make_folder(const fs::path& folder) {
    std::error_code error;
    fs::create_directories(folder, error);
    if (error || !fs::is_directory(folder))
        throw RunError(
            core::one_line(folder.string() + ": the folder cannot be created: " + error.message()));
}

class Run {
  public:
    Run(const std::shared_ptr<gpu::Device>& device, pathtracer::RenderJob job, const fs::path& folder)
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

    /// Continues an earlier run if its record matches, else removes its files.
    void prepare_folder() {
        make_folder(folder_);
        const auto earlier = pathtracer::read_record(folder_);
        for (const char* name :
             {pathtracer::kRecord, "transforms.json", "points.ply", "images", "depth", "sparse"})
            if (!earlier && fs::exists(folder_ / name))
                throw InputError(
                    core::one_line(folder_.string() + ": holds \"" + name +
                                   "\" that ewa did not render from a mesh scene; name another folder"));
        core::remove_abandoned_files(folder_);
        const bool same =
            earlier && earlier->exposure && earlier->fingerprint == record_["fingerprint"].get<std::string>();
        if (!same) remove_views();
        result_.exposure = same ? *earlier->exposure : options_.exposure ? *options_.exposure : measured();
        record_["exposure"] = result_.exposure;
        // Written before the folders, which without it would count as another program's.
        core::write_text_file(folder_ / pathtracer::kRecord, record_.dump(1) + "\n");
        for (const char* name : {"images", "depth"}) {
            make_folder(folder_ / name);
            core::remove_abandoned_files(folder_ / name);
        }
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
        const Image radiance =
            tracer_.radiance(cameras_[i], options_.samples, seed, shared::TRACE_SAMPLE_MAX / factor);
        save_image(folder_ / job_.image_name(i), pathtracer::develop(radiance, factor));
        save_image(folder_ / job_.depth_name(i), tracer_.seen(cameras_[i]).depth);
    }

    /// Points from equally many random pixels of each view. Pixels without a surface give none.
    PointCloud points() const {
        PointCloud cloud;
        if (options_.points == 0) return cloud;
        const auto each = uint32_t((size_t(options_.points) + cameras_.size() - 1) / cameras_.size());
        for (size_t view = 0; view < cameras_.size(); ++view) {
            const Camera& camera = cameras_[view];
            const Image image = load_image(folder_ / job_.image_name(view)),
                        depth = load_image(folder_ / job_.depth_name(view));
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
            file.frames.push_back({job_.image_name(i), job_.depth_name(i), cameras_[i]});
        io::write_transforms(folder_ / "transforms.json", file);
    }

    pathtracer::RenderJob job_;
    const SyntheticOptions& options_ = job_.options;
    const std::vector<Camera>& cameras_ = job_.cameras;
    fs::path folder_;
    PathTracer tracer_;
    nlohmann::ordered_json record_;
    SyntheticDataset result_;
};

}  // namespace

SyntheticDataset render_dataset(const std::shared_ptr<gpu::Device>& device, const fs::path& scene,
                                const fs::path& folder, const SyntheticOptions& options,
                                const std::function<bool(int, int)>& progress) {
    return Run(device, pathtracer::read_render_job(scene, options), folder).run(progress);
}

}  // namespace ewa
