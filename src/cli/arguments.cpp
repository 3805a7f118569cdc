// SPDX-License-Identifier: Apache-2.0
#include "cli/arguments.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
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
#include "io/splats/format_table.h"
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

CLI::Validator one_of(const std::vector<std::string>& words) {
    std::string all;
    for (const std::string& word : words) all += (all.empty() ? "" : "|") + word;
    return CLI::Validator([words](std::string& text) { return core::settle_word(text, words); }, all);
}

CLI::Validator accepted_by(const train::RunOption& option) {
    return CLI::Validator(
        [&option](std::string& text) {
            try {
                RunOptions scratch;
                option.set(scratch, text);
                return std::string();
            } catch (const InputError& error) {
                return std::string(error.what());
            }
        },
        "");
}

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
    arguments.background_option =
        app.add_option("--background", arguments.background,
                       "Background colour: r,g,b in 0..1, a name such as white, #rrggbb, or a sky.json "
                       "[that beside SPLATS, if it is there]")
            ->type_name("COLOUR")
            ->capture_default_str();
    const train::RunOption& kernel = train::run_option("kernel");
    arguments.kernel_option = app.add_option("--kernel", arguments.kernel, kernel.help)
                                  ->transform(one_of(kernel.choices))
                                  ->capture_default_str();
    app.add_flag("--points", arguments.points, train::run_option("points").help);
    const train::RunOption& nearest = train::run_option("nearest");
    app.add_option_function<std::string>(
           "--nearest",
           [&nearest, &arguments](const std::string& text) {
               RunOptions drawn;
               nearest.set(drawn, text);
               arguments.nearest = drawn.train.render.nearest;
           },
           nearest.help)
        ->check(accepted_by(nearest))
        ->type_name(nearest.value)
        ->default_str(std::to_string(RenderOptions().nearest));
    app.add_option("--sh-degree", arguments.sh_degree, "Highest degree of the spherical harmonics")
        ->transform(in_range(0, kMaxShDegree))
        ->type_name("0..3")
        ->capture_default_str();
    app.add_option("--integrator", arguments.integrator,
                   "How splats become a colour: splat blends footprints; fast-ray evaluates each splat on "
                   "each ray, in "
                   "the order of splat; ray orders them on each ray; march integrates the volume")
        ->transform(one_of(core::words_of(scene::kIntegratorWords)))
        ->capture_default_str();
    app.add_option("--samples", arguments.samples, "Intervals of a ray, with --integrator march (64)")
        ->transform(in_range(1, kMostSamples))
        ->type_name("N");
}

void add_device_options(CLI::App& app, DeviceOptions& options) {
    const train::RunOption& device = train::run_option("device");
    if (const char* named = std::getenv("EWA_DEVICE")) options.selector = named;
    app.add_option("--device", options.selector, device.help + " [$EWA_DEVICE]")->type_name(device.value);
    app.add_flag("--validation", options.validation, "Enable the Vulkan validation layer")
        ->group("For developers");
}

void add_size_options(CLI::App& app, int& downscale, int& max_width) {
    app.add_option("--downscale", downscale, train::run_option("downscale").help)
        ->transform(in_range(1, 1024))
        ->type_name("K")
        ->capture_default_str();
    app.add_option("--max-width", max_width, train::run_option("max-width").help)
        ->transform(in_range(0, 65535))
        ->type_name("N")
        ->capture_default_str();
}

void add_test_every_option(CLI::App& app, int& test_every) {
    app.add_option("--test-every", test_every, train::run_option("test-every").help)
        ->transform(in_range(0, 1000000000))
        ->type_name("K")
        ->capture_default_str();
}

void add_splats(CLI::App& app, fs::path& splats) {
    app.add_option("SPLATS", splats,
                   "Splat file (" + io::extension_list(io::Uses::read) + "), or folder of a training run")
        ->required()
        ->type_name("");
}

void add_frames_options(CLI::App& app, std::string& frames, int& test_every) {
    app.add_option("--frames", frames, "all, train, test, names, or indices in name order such as 0,3 or 5-9")
        ->type_name("FRAMES")
        ->capture_default_str();
    add_test_every_option(app, test_every);
}

void add_transform_option(CLI::App& app, std::vector<std::string>& steps, const std::string& of) {
    app.add_option("--transform", steps,
                   of + ": move=x,y,z, turn=x,y,z,degrees, scale=s, or a matrix of 12 or 16 numbers, "
                        "row by row. Repeat the option for several steps, applied in order. Axes are those "
                        "of a PLY: y down, z forward")
        ->type_name("STEP")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
        ->take_all();
}

void add_quiet_option(CLI::App& app, bool& quiet) {
    app.add_flag("--quiet", quiet, "Print only errors");
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

Dataset load_cameras_as_trained(const fs::path& path, const CamerasInput& input) {
    if (is_scene_file(path)) {
        Dataset dataset = scene_cameras(path, {});
        for (Frame& frame : dataset.frames) {
            if (input.max_width > 0)
                frame.camera = narrowed(frame.camera, int64_t(input.max_width) * input.downscale);
            frame.camera = ewa::downscale(frame.camera, input.downscale);
        }
        return dataset;
    }
    Dataset dataset = load_dataset(path, {.downscale = input.downscale,
                                          .lens = input.lens,
                                          .need_images = false,
                                          .need_points = input.points,
                                          .max_width = input.max_width});
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
    add_splats(app, arguments.splats);
    app.add_option(
           "DATASET", arguments.dataset,
           "Images with cameras: a COLMAP folder or transforms.json. Or a glTF file of meshes, which is "
           "rendered as in ewa train. Or the folder of a training run: its dataset [that of the run SPLATS, "
           "with "
           "the run's options]")
        ->type_name("");
}

namespace {

/// An option of a training run, with its words and help. take: from a run that has the value.
void add_word_of_run(CLI::App& app, const std::string& name,
                     const std::function<void(const RunOptions&)>& take) {
    const train::RunOption& option = train::run_option(name);
    app.add_option_function<std::string>(
           "--" + name,
           [&option, take](const std::string& text) {
               RunOptions run;
               option.set(run, text);
               take(run);
           },
           option.help)
        ->transform(one_of(option.choices))
        ->default_str("auto");
}

}  // namespace

void add_lens_option(CLI::App& app, LensUse& lens) {
    add_word_of_run(app, "lens", [&lens](const RunOptions& run) { lens = run.lens; });
}

void add_view_options(CLI::App& app, ViewArguments& arguments) {
    add_draw_options(app, arguments.draw);
    add_size_options(app, arguments.downscale, arguments.max_width);
    add_word_of_run(app, "masks", [&arguments](const RunOptions& run) { arguments.masks = run.masks; });
    add_lens_option(app, arguments.lens);
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
    Dataset dataset = load_dataset(folder, {.downscale = arguments.downscale,
                                            .masks = arguments.masks,
                                            .lens = arguments.lens,
                                            .max_width = arguments.max_width});
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
