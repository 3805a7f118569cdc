// SPDX-License-Identifier: Apache-2.0
#include "cli/arguments.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cstdlib>
#include <memory>

#include "capture/what_is.h"
#include "cli/interrupt.h"
#include "cli/output.h"
#include "core/folders.h"
#include "core/messages.h"
#include "core/text.h"
#include "ewa/error.h"
#include "ewa/sky_map.h"
#include "ewa/splat_edit.h"
#include "ewa/splat_files.h"
#include "folders/run_folder.h"
#include "run/option_table.h"
#include "scene/camera.h"
#include "scene/looks.h"
#include "scene/names.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;

void print_notes(const SyntheticDataset& made, const fs::path& folder) {
    for (const std::string& remark : made.remarks) fmt::print("note: {}\n", core::one_line(remark));
    if (made.dropped_triangles > 0)
        fmt::print("skipped {} with a corner that is not finite\n",
                   core::counted(uint64_t(made.dropped_triangles), "triangle"));
    if (made.unfinished_rays > 0)
        fmt::print("{} rays exceeded the step limit of the device and see nothing\n", made.unfinished_rays);
    if (made.dropped_samples > 0)
        fmt::print("{} paths were not finite and count as black\n", made.dropped_samples);
    if (made.interrupted)
        print_how_to_continue();
    else
        fmt::print("{} {} in {}{}, exposure {:+.1f} stops; {}\n", core::counted(uint64_t(made.views), "view"),
                   core::is_or_are(uint64_t(made.views)), core::one_line(folder.string()),
                   made.kept > 0 ? fmt::format(" ({} existed already)", made.kept) : "", made.exposure,
                   made.color_depends_on_view ? "colours depend on the view"
                                              : "every material is diffuse: SH degree 0 suffices");
}

}  // namespace

core::PixelSize size_of(const std::string& text) {
    constexpr int kLargestSide = 16384;            // px
    constexpr uint64_t kMostPixels = 134'000'000;  // 8 * 65,535 tiles of 16 x 16
    const auto size = core::parse_size(text, kLargestSide);
    if (!size || uint64_t(size->width) * uint64_t(size->height) > kMostPixels)
        throw InputError(fmt::format(
            "--size: '{}' is not a size such as 1280x720 or 4k, of at most {} a side and {} million pixels",
            text, kLargestSide, kMostPixels / 1'000'000));
    return *size;
}

RenderOptions DrawArguments::options() const {
    RunOptions drawn;
    const auto set = [&](const char* name, const std::string& text) {
        try {
            train::run_option(name).set(drawn, text);
        } catch (const InputError& error) {
            throw InputError(std::string("--") + name + ": " + error.what());
        }
    };
    if (background == "random" || background == "sky" || background == "auto")
        throw InputError("--background: only ewa train takes " + background);
    const bool sky = background.ends_with(".json");
    if (!sky) set("background", background);
    set("kernel", kernel);
    RenderOptions render = drawn.train.render;
    if (sky) render.sky = std::make_shared<const SkyMap>(load_sky(background));
    render.sh_degree = sh_degree;
    render.points = points;
    render.nearest = nearest.value_or(render.nearest);
    render.integrator = core::value_of(scene::kIntegratorWords, integrator);
    scene::check_look({.render = render, .nearest = nearest.has_value(), .samples = samples.has_value()});
    render.samples = samples.value_or(render.samples);
    return render;
}

Gaussians DrawArguments::load(const fs::path& splats, RenderOptions& options) const {
    SplatScene scene = read_splats(splats);
    for (const std::string& remark : scene.remarks)
        core::warn(core::one_line(splats.string()) + ": " + core::one_line(remark));
    if (!names_kernel() && !options.points) {
        if (scene.gaussians.density) options.kernel = Footprint::density;
        if (scene.antialiased && options.integrator != Integrator::march)
            options.kernel = Footprint::antialias;
    }
    const fs::path sky = splats.parent_path() / folders::kSkyFile;
    if (!names_background() && core::is_file(sky))
        options.sky = std::make_shared<const SkyMap>(load_sky(sky));
    fit_opacities(scene.gaussians, options.kernel == Footprint::density);
    return std::move(scene.gaussians);
}

void add_draw_options(CLI::App& app, DrawArguments& arguments) {
    arguments.background_option = options::add(app, "background", arguments.background);
    arguments.kernel_option = options::add(app, "kernel", arguments.kernel);
    options::add(app, "points", arguments.points);
    options::add(app, "nearest", arguments.nearest);
    options::add(app, "sh-degree", arguments.sh_degree);
    options::add(app, "integrator", arguments.integrator);
    options::add(app, "samples", arguments.samples);
}

void add_device_options(CLI::App& app, DeviceOptions& options) {
    if (const char* named = std::getenv("EWA_DEVICE")) options.selector = named;
    options::add(app, "device", options.selector);
    options::add(app, "validation", options.validation);
}

std::vector<int> select_frames(const Dataset& dataset, const std::string& which, int test_every) {
    if (dataset.frames.empty()) throw InputError(dataset.root.string() + " has no frames");
    if (which != "all" && which != "train" && which != "test") return scene::frames_named(dataset, which);

    const Split split = split_frames(dataset, test_every);
    std::vector<int> frames;
    if (which != "test") frames.insert(frames.end(), split.train.begin(), split.train.end());
    if (which != "train") frames.insert(frames.end(), split.test.begin(), split.test.end());
    std::sort(frames.begin(), frames.end());
    if (frames.empty())
        throw InputError(fmt::format("no frame of {} is in the {} split with --test-every {}",
                                     dataset.root.string(), which, test_every));
    return frames;
}

namespace {

/// A glTF of splats is one, too, where a dataset is expected: the reader of meshes says that it has none.
bool is_scene_file(const fs::path& path) {
    const What what = what_is(path);
    const std::string extension = core::lower(path.extension().string());
    return what == What::mesh || (what == What::splats && (extension == ".gltf" || extension == ".glb"));
}

}  // namespace

Dataset load_cameras_as_trained(const fs::path& path, const RunOptions& options, bool points) {
    if (is_scene_file(path)) {
        Dataset dataset = scene_cameras(path, {});
        for (Frame& frame : dataset.frames) {
            if (options.max_width > 0)
                frame.camera = narrowed(frame.camera, int64_t(options.max_width) * options.downscale);
            frame.camera = ewa::downscale(frame.camera, options.downscale);
        }
        return dataset;
    }
    Dataset dataset = load_dataset(path, {.downscale = options.downscale,
                                          .lens = options.lens,
                                          .need_images = false,
                                          .need_points = points,
                                          .max_width = options.max_width});
    auto missing = [](const Frame& frame) { return !frame.image_exists; };
    if (!std::ranges::all_of(dataset.frames, missing)) std::erase_if(dataset.frames, missing);
    return dataset;
}

void render_with_progress(const DeviceOptions& device, const fs::path& scene, const fs::path& folder,
                          const SyntheticOptions& options, bool quiet) {
    const InterruptWatch watch;
    std::unique_ptr<Progress> progress;
    const SyntheticDataset made =
        render_dataset(open_device(device), scene, folder, options, [&](int done, int total) {
            if (!progress) progress = std::make_unique<Progress>("rendered", total, "views", quiet);
            if (done > 0) progress->update(done);
            return !interrupted();
        });
    progress.reset();
    if (!quiet) print_notes(made, folder);
    if (made.interrupted) throw Interrupted();
}

void add_view_positionals(CLI::App& app, ViewArguments& arguments) {
    options::add(app, "SPLATS", arguments.splats);
    options::add(app, "DATASET", arguments.dataset);
}

void add_view_options(CLI::App& app, ViewArguments& arguments) {
    add_draw_options(app, arguments.draw);
    for (const char* name : {"downscale", "max-width", "masks", "lens"})
        options::add(app, name, arguments.run);
    add_device_options(app, arguments.device);
}

Views load_views(const ViewArguments& arguments, const std::string& which, int test_every) {
    fs::path folder = arguments.dataset;
    std::unique_ptr<core::TemporaryFolder> rendered;
    if (is_scene_file(arguments.dataset)) {
        select_frames(scene_cameras(arguments.dataset, {}), which, test_every);
        folder = arguments.splats.parent_path() / folders::kMadeDataset;
        if (!is_rendered(arguments.dataset, folder, {})) {
            rendered = std::make_unique<core::TemporaryFolder>("ewa-images-");
            folder = rendered->path();
            // A signal after the last view is noticed here: the watch of the rendering has ended.
            render_with_progress(arguments.device, arguments.dataset, folder, {}, false);
            if (interrupted()) throw Interrupted();
        }
    }
    Dataset dataset = load_dataset(folder, {.downscale = arguments.run.downscale,
                                            .masks = arguments.run.masks,
                                            .lens = arguments.run.lens,
                                            .max_width = arguments.run.max_width});
    io::RefinedUse refined;
    if (!arguments.refined_cameras.empty())
        refined = io::use_refined_cameras(dataset, arguments.refined_cameras);
    std::vector<int> frames = select_frames(dataset, which, test_every);
    if (arguments.run_frames != "all") {
        const std::vector<int> used = scene::frames_named(dataset, arguments.run_frames);
        std::erase_if(frames, [&](int i) { return std::ranges::find(used, i) == used.end(); });
        if (frames.empty())
            throw InputError("the run used --frames " + arguments.run_frames +
                             ", and none of these is in the " + which +
                             " split; name DATASET for all of its images");
    }
    return {std::move(dataset), refined, std::move(frames), std::move(rendered)};
}

}  // namespace ewa::cli
