// SPDX-License-Identifier: Apache-2.0
// ewa render: renders a splat scene, through the cameras of a dataset, whose images are not needed, or as it is framed
// by itself.
#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <glm/matrix.hpp>
#include <memory>
#include <optional>

#include "cli/arguments.h"
#include "cli/command.h"
#include "cli/film.h"
#include "cli/interrupt.h"
#include "cli/output.h"
#include "cli/render_views.h"
#include "cli/run_inputs.h"
#include "core/text.h"
#include "ewa/error.h"
#include "ewa/renderer.h"
#include "ewa/splat_files.h"
#include "io/datasets/dataset_folders.h"
#include "io/datasets/refined_cameras.h"
#include "report/pictures.h"
#include "scene/dataset_files.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;

struct RenderArguments {
    fs::path splats, cameras, output = "out/render";
    std::string frames = "all", format = "png", mode = "color", exposures = "auto";
    int test_every = 8, downscale = 1;
    ViewsArguments views;
    DrawArguments draw;
    DeviceOptions device;
    bool quiet = false;
    // Of the run that SPLATS names; empty: none.
    std::optional<live::Run> run;
    bool cameras_of_run = false;
};

/// Divides by the largest value and returns it: the value of white in a PNG.
float normalize(Image& image) {
    float largest = 0;
    for (const float v : image.pixels) largest = std::max(largest, v);
    if (largest > 0)
        for (float& v : image.pixels) v /= largest;
    return largest;
}

/// The image to save. remark: a fact that the file itself does not hold.
Image chosen_image(Rendering&& rendering, const RenderArguments& arguments, std::string& remark) {
    const bool exr = arguments.format == "exr";
    if (arguments.mode == "alpha") return std::move(rendering.alpha);
    if (arguments.mode == "color")
        return exr ? with_alpha(rendering.color, rendering.alpha) : std::move(rendering.color);
    if (!exr) remark = fmt::format("white is depth {:.6g}", normalize(rendering.depth));
    return std::move(rendering.depth);
}

void note_skipped(Progress& progress, uint32_t skipped) {
    if (skipped > 0)
        progress.note("skipped " + core::counted(skipped, "splat") + " with a value that is not finite");
}

int render_dataset_views(const RenderArguments& arguments) {
    RenderOptions options = arguments.draw.options();
    Gaussians gaussians = load_splats(arguments.splats);
    arguments.draw.match_kernel(gaussians, options);
    Dataset dataset = load_cameras_as_trained(arguments.cameras, arguments.downscale);
    const fs::path refined = arguments.cameras_of_run ? refined_cameras_of(*arguments.run) : fs::path();
    if (!refined.empty()) io::use_refined_cameras(dataset, refined);
    const std::vector<int> frames = select_frames(dataset, arguments.frames, arguments.test_every);
    const std::vector<fs::path> names = report::picture_names(dataset.frames);
    const auto file_of = [&](int frame) {
        return arguments.output / (names[size_t(frame)].string() + "." + arguments.format);
    };
    io::check_output_folder("-o", arguments.output, dataset);
    std::vector<NamedFile> written, read = scene::files_of(dataset, "--cameras");
    for (const int frame : frames) written.push_back({"the render", file_of(frame)});
    read.insert(read.end(), {{"SPLATS", arguments.splats}, {"--cameras", arguments.cameras}});
    check_command_outputs(written, read);
    const std::vector<Exposure> exposures = exposures_of(
        arguments.exposures, arguments.cameras_of_run ? arguments.run : std::nullopt, dataset, frames);
    make_folder(arguments.output);

    Renderer renderer(open_device(arguments.device), gaussians, options);
    const InterruptWatch watch;
    Progress progress("rendered", static_cast<int>(frames.size()), "frames", arguments.quiet);
    uint32_t skipped = 0;
    for (size_t i = 0; i < frames.size(); ++i) {
        if (interrupted()) return kInterruptedStatus;
        const Frame& frame = dataset.frames[frames[i]];
        Rendering rendering = renderer.render(frame.camera, arguments.mode == "depth");
        if (!exposures.empty()) rendering.color = exposed(std::move(rendering.color), exposures[i]);
        skipped = std::max(skipped, renderer.skipped_nonfinite());

        std::string remark;
        const fs::path file = file_of(frames[i]);
        make_folder(file.parent_path());
        save_image(file, chosen_image(std::move(rendering), arguments, remark));
        if (!remark.empty()) progress.note(file.string() + ": " + remark);
        progress.update(static_cast<int>(i) + 1);
    }
    note_skipped(progress, skipped);
    progress.note(fmt::format("{} {} in {}", core::counted(frames.size(), "image"),
                              core::is_or_are(frames.size()), arguments.output.string()));
    return 0;
}

/// What the cameras of the run's dataset say about the scene, if they can be read.
scene::FramingHints hints_of(const RenderArguments& arguments) {
    if (!arguments.run || arguments.run->dataset.empty()) return {};
    try {
        const Dataset dataset = load_cameras_as_trained(arguments.run->dataset, 1);
        if (dataset.frames.empty()) return {};
        const glm::dmat3 axes = glm::transpose(dataset.frames[0].camera.rotation);
        return {.up = scene::mean_up(dataset), .forward = axes[2]};
    } catch (const InputError&) {
        return {};  // The scene is framed as one of which nothing is known.
    }
}

/// The film of these views. Returns the exit status.
int write_film(const RenderArguments& arguments, Renderer& renderer, const RenderOptions& options,
               const std::vector<Camera>& cameras, Progress& progress) {
    Film film(arguments.output, cameras[0].width, cameras[0].height);
    for (size_t i = 0; i < cameras.size(); ++i) {
        if (interrupted()) return kInterruptedStatus;
        film.add(renderer.render_bytes(cameras[i], {.render = options}));
        progress.update(int(i) + 1);
    }
    film.finish();
    note_skipped(progress, renderer.skipped_nonfinite());
    progress.note(fmt::format("{}: {} frames, {:.1f} s", arguments.output.string(), cameras.size(),
                              double(cameras.size()) / kFilmRate));
    return 0;
}

/// The file of a view without a name.
fs::path view_file(const RenderArguments& arguments, size_t view) {
    return arguments.output / fmt::format("{:05}.{}", view, arguments.format);
}

int write_views(const RenderArguments& arguments, Renderer& renderer, const std::vector<Camera>& cameras,
                bool one_image, Progress& progress) {
    uint32_t skipped = 0;
    make_folder(one_image ? arguments.output.parent_path() : arguments.output);
    for (size_t i = 0; i < cameras.size(); ++i) {
        if (interrupted()) return kInterruptedStatus;
        Rendering rendering = renderer.render(cameras[i], arguments.mode == "depth");
        skipped = std::max(skipped, renderer.skipped_nonfinite());
        std::string remark;
        const fs::path file = one_image ? arguments.output : view_file(arguments, i);
        save_image(file, chosen_image(std::move(rendering), arguments, remark));
        if (!remark.empty()) progress.note(file.string() + ": " + remark);
        if (cameras.size() > 1) progress.update(int(i) + 1);
    }
    note_skipped(progress, skipped);
    if (one_image)
        progress.note(
            fmt::format("{}: {}x{}", arguments.output.string(), cameras[0].width, cameras[0].height));
    else
        progress.note(fmt::format("{} {} in {}", core::counted(cameras.size(), "image"),
                                  core::is_or_are(cameras.size()), arguments.output.string()));
    return 0;
}

/// Without the cameras of a dataset.
int render_free_views(RenderArguments arguments) {
    const ViewsOutput output = views_output(arguments.output);
    const bool film = output == ViewsOutput::film, one_image = output == ViewsOutput::image;
    RenderOptions options = arguments.draw.options();
    check_views(arguments.views);
    if (film && arguments.mode != "color")
        throw InputError("a film has --mode color; a folder can have any mode");
    if (film) find_ffmpeg();
    if (one_image) arguments.format = core::lower(arguments.output.extension().string()).substr(1);
    if (output != ViewsOutput::folder) {
        check_command_outputs({{"--output", arguments.output}},
                              {{"SPLATS", arguments.splats}, {"--views", arguments.views.views}});
    }
    SplatScene scene = read_splats(arguments.splats);
    if (scene.antialiased && !arguments.draw.names_kernel()) options.kernel = Footprint::antialias;
    arguments.draw.match_kernel(scene.gaussians, options);
    const std::vector<Camera> cameras =
        views_of(arguments.views, scene.gaussians, hints_of(arguments), output);
    if (output == ViewsOutput::folder) {
        io::check_output_folder("-o", arguments.output);
        std::vector<NamedFile> written;
        for (size_t i = 0; i < cameras.size(); ++i)
            written.push_back({"the render", view_file(arguments, i)});
        check_command_outputs(written, {{"SPLATS", arguments.splats}, {"--views", arguments.views.views}});
    }
    if (film) make_folder(arguments.output.parent_path());

    Renderer renderer(open_device(arguments.device), scene.gaussians, options);
    const InterruptWatch watch;
    Progress progress("rendered", int(cameras.size()), "views", arguments.quiet);
    if (film) return write_film(arguments, renderer, options, cameras, progress);
    return write_views(arguments, renderer, cameras, one_image, progress);
}

/// Completes the arguments by the run that SPLATS may name, and chooses whose cameras are used.
int run(CLI::App& app, RenderArguments& arguments) {
    std::string of_frames;  // a given option that only a dataset's views have
    for (const char* option : {"--frames", "--test-every", "--downscale", "--exposures"})
        if (app.count(option) > 0) of_frames = option;
    if (arguments.mode == "depth" && arguments.draw.integrator == "march")
        throw InputError("--mode depth: the integrator march draws no depth; splat and ray do");
    SplatInput input = splat_input(arguments.splats);
    arguments.splats = input.file;
    if (input.run) use_options_of(*input.run, app);
    if (!arguments.cameras.empty()) {
        arguments.cameras = dataset_input(arguments.cameras);
        return render_dataset_views(arguments);
    }
    const bool free = any_given(arguments.views) || views_output(arguments.output) != ViewsOutput::folder;
    if (input.run && !free) {
        arguments.cameras = dataset_of(*input.run);
        arguments.run = std::move(input.run);
        arguments.cameras_of_run = true;
        return render_dataset_views(arguments);
    }
    if (!of_frames.empty()) throw InputError(of_frames + " needs --cameras DATASET");
    arguments.run = input.run ? std::move(input.run) : live::run_of_splats(arguments.splats);
    return render_free_views(arguments);
}

}  // namespace

Action add_render(CLI::App& app) {
    const auto arguments = std::make_shared<RenderArguments>();
    add_splats(app, arguments->splats);
    CLI::Option* cameras =
        app.add_option(
               "--cameras", arguments->cameras,
               "Dataset whose cameras to render through [that of a run]. Without, the whole scene is shown "
               "from the front")
            ->type_name("DATASET");
    app.add_option(
           "-o,--output", arguments->output,
           "Folder for the renders, named like the images of the dataset or by number. Without --cameras "
           "also one image (.png, .exr), or a film (.mp4, .mov, .mkv, .webm) that the program ffmpeg writes")
        ->type_name("OUT")
        ->capture_default_str();
    add_views_options(app, arguments->views, cameras);
    add_frames_options(app, arguments->frames, arguments->test_every);
    app.add_option("--format", arguments->format,
                   "Format in a folder: png (8 bit, clamped) or exr (float32, not clamped)")
        ->transform(one_of({"png", "exr"}))
        ->capture_default_str();
    app.add_option("--mode", arguments->mode,
                   "color, depth (view z; divided by its maximum in a png) or alpha")
        ->transform(one_of({"color", "depth", "alpha"}))
        ->capture_default_str();
    add_draw_options(app, arguments->draw);
    add_downscale_option(app, arguments->downscale);
    add_exposures_option(app, arguments->exposures);
    add_device_options(app, arguments->device);
    add_quiet_option(app, arguments->quiet);
    return [&app, arguments] { return run(app, *arguments); };
}

}  // namespace ewa::cli
