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
#include "scene/framing.h"
#include "scene/looks.h"
#include "scene/native_lens.h"
#include "scene/readout.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;

struct RenderArguments {
    fs::path splats, cameras, output = "out/render";
    std::string frames = "all", format = "png", mode = "color", lens = "auto";
    LensUse lens_use = LensUse::automatic;  // of a dataset's cameras
    AppearanceArguments appearance;
    int test_every = 8, downscale = 1, max_width = 0;
    ViewsArguments views;
    DrawArguments draw;
    DeviceOptions device;
    bool quiet = false;
    // The run that SPLATS names; empty: none.
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

/// From -1 to 1 to what a file of 8 bits holds; no surface is black.
void encode_normals(Image& normals) {
    for (size_t i = 0; i < normals.pixels.size(); i += 3) {
        float* n = &normals.pixels[i];
        if (n[0] == 0 && n[1] == 0 && n[2] == 0) continue;
        for (int c = 0; c < 3; ++c) n[c] = 0.5f + 0.5f * n[c];
    }
}

/// What to draw for --mode; opacity comes with colours.
Drawing drawing_of(const RenderArguments& arguments) {
    if (arguments.mode == "depth") return Drawing::depth;
    if (arguments.mode == "median-depth") return Drawing::median_depth;
    if (arguments.mode == "normal") return Drawing::normal;
    return Drawing::color;
}

/// The image to save. remark: a fact that the file itself does not hold.
Image chosen_image(Rendering&& rendering, const RenderArguments& arguments, std::string& remark) {
    const bool exr = arguments.format == "exr";
    if (arguments.mode == "alpha") return std::move(rendering.alpha);
    if (arguments.mode == "color")
        return exr ? with_alpha(rendering.color, rendering.alpha) : std::move(rendering.color);
    if (arguments.mode == "normal") {
        if (!exr) encode_normals(rendering.normal);
        return std::move(rendering.normal);
    }
    Image& depth = arguments.mode == "depth" ? rendering.depth : rendering.median_depth;
    if (!exr) remark = fmt::format("white is depth {:.6g}", normalize(depth));
    return std::move(depth);
}

/// Saves what the camera shows.
void save_view(const fs::path& file, const Camera& camera, const Image& image) {
    if (scene::shows_all_around(camera))
        save_panorama(file, image);
    else
        save_image(file, image);
}

void note_skipped(Progress& progress, uint32_t skipped) {
    if (skipped > 0)
        progress.note("skipped " + core::counted(skipped, "splat") + " with a value that is not finite");
}

/// The file of each frame's render, in the output folder or as the one image that --output names.
std::vector<fs::path> files_of_frames(const RenderArguments& arguments, const Dataset& dataset,
                                      const std::vector<int>& frames) {
    const ViewsOutput output = views_output(arguments.output);
    if (output == ViewsOutput::film)
        throw InputError(
            "--output " + core::one_line(arguments.output.string()) +
            ": a film goes round the scene or along --views; the cameras of a dataset make images in a "
            "folder");
    if (output == ViewsOutput::image && frames.size() > 1)
        throw InputError(
            fmt::format("--output {}: one image, and there are {} frames; choose one with --frames, or "
                        "name a folder",
                        core::one_line(arguments.output.string()), frames.size()));
    if (output == ViewsOutput::image) return {arguments.output};
    const std::vector<fs::path> names = report::picture_names(dataset.frames);
    std::vector<fs::path> files;
    for (const int frame : frames)
        files.push_back(arguments.output / (names[size_t(frame)].string() + "." + arguments.format));
    return files;
}

/// Throws if a render would replace a file that is read, or land among photos.
void check_renders(const RenderArguments& arguments, const std::vector<fs::path>& files,
                   const Dataset* dataset) {
    // The user names a single file, so its folder may be a dataset.
    const fs::path folder = files[0] == arguments.output ? fs::path() : arguments.output;
    if (folder.empty())
        io::check_not_inside_dataset("-o", fs::absolute(arguments.output).parent_path());
    else if (dataset)
        io::check_output_folder("-o", folder, *dataset);
    else
        io::check_output_folder("-o", folder);
    std::vector<NamedFile> written, read{{"SPLATS", arguments.splats},
                                         {"--views", arguments.views.views},
                                         {"--cameras", arguments.cameras}};
    for (const fs::path& file : files) written.push_back({"the render", file});
    if (dataset) {
        const std::vector<NamedFile> more = scene::files_of(*dataset, "the dataset");
        read.insert(read.end(), more.begin(), more.end());
    }
    check_command_outputs(written, read);
}

/// The view of a frame through another lens. A 360° image is twice as wide as high, and as high as the frame's longer side.
Camera of_frame(const LensArgument& lens, const Camera& frame, const Dataset& dataset,
                const Gaussians& gaussians) {
    Camera camera = scene::at_middle(frame);
    if (lens.lens.lens == Lens::equirectangular) {
        camera.height = std::max(frame.width, frame.height);
        camera.width = 2 * camera.height;
    }
    return through(lens, camera, scene::mean_up(dataset), scene::framed_box(gaussians).center());
}

int render_dataset_views(RenderArguments arguments) {
    RenderOptions options = arguments.draw.options();
    const Gaussians gaussians = arguments.draw.load(arguments.splats, options);
    Dataset dataset = load_cameras_as_trained(
        arguments.cameras,
        {.downscale = arguments.downscale, .max_width = arguments.max_width, .lens = arguments.lens_use});
    const fs::path refined = arguments.cameras_of_run ? refined_cameras_of(*arguments.run) : fs::path();
    if (!refined.empty()) io::use_refined_cameras(dataset, refined);
    const std::vector<int> frames = select_frames(dataset, arguments.frames, arguments.test_every);
    const std::vector<fs::path> files = files_of_frames(arguments, dataset, frames);
    arguments.format = core::lower(files[0].extension().string()).substr(1);
    check_renders(arguments, files, &dataset);
    const std::vector<Appearance> appearances = appearances_of(
        arguments.appearance, arguments.cameras_of_run ? arguments.run : std::nullopt, dataset, frames);

    if (arguments.views.lens)
        for (Frame& frame : dataset.frames)
            frame.camera = of_frame(*arguments.views.lens, frame.camera, dataset, gaussians);

    Renderer renderer(open_device(arguments.device), gaussians, options);
    const InterruptWatch watch;
    Progress progress("rendered", static_cast<int>(frames.size()), "frames", arguments.quiet);
    uint32_t skipped = 0;
    for (size_t i = 0; i < frames.size(); ++i) {
        if (interrupted()) return kInterruptedStatus;
        const Frame& frame = dataset.frames[frames[i]];
        Rendering rendering = renderer.render(frame.camera, drawing_of(arguments));
        if (!appearances.empty() && arguments.mode == "color")
            rendering.color = with_appearance(std::move(rendering.color), appearances[i]);
        skipped = std::max(skipped, renderer.skipped_nonfinite());

        std::string remark;
        make_folder(files[i].parent_path());
        save_view(files[i], frame.camera, chosen_image(std::move(rendering), arguments, remark));
        if (!remark.empty()) progress.note(files[i].string() + ": " + remark);
        progress.update(static_cast<int>(i) + 1);
    }
    note_skipped(progress, skipped);
    progress.note(fmt::format("{} {} in {}", core::counted(frames.size(), "image"),
                              core::is_or_are(frames.size()), arguments.output.string()));
    return 0;
}

/// The dataset of the run, if it can be read. Else the scene is framed as one of which nothing is known.
std::optional<Dataset> dataset_of_run(const RenderArguments& arguments) try {
    if (!arguments.run || arguments.run->dataset.empty()) return std::nullopt;
    return load_cameras_as_trained(arguments.run->dataset, {});
} catch (const InputError&) {
    return std::nullopt;
}

/// What its cameras say about the scene.
scene::FramingHints hints_of(const std::optional<Dataset>& dataset) {
    if (!dataset || dataset->frames.empty()) return {};
    const glm::dmat3 axes = glm::transpose(dataset->frames[0].camera.rotation);
    return {.up = scene::mean_up(*dataset), .forward = axes[2]};
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

int write_views(const RenderArguments& arguments, Renderer& renderer, const std::vector<Camera>& cameras,
                const std::vector<fs::path>& files, Progress& progress) {
    const bool one_image = files[0] == arguments.output;
    uint32_t skipped = 0;
    make_folder(files[0].parent_path());
    for (size_t i = 0; i < cameras.size(); ++i) {
        if (interrupted()) return kInterruptedStatus;
        Rendering rendering = renderer.render(cameras[i], drawing_of(arguments));
        skipped = std::max(skipped, renderer.skipped_nonfinite());
        std::string remark;
        save_view(files[i], cameras[i], chosen_image(std::move(rendering), arguments, remark));
        if (!remark.empty()) progress.note(files[i].string() + ": " + remark);
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
    const std::optional<Dataset> dataset = dataset_of_run(arguments);
    const Dataset* const known = dataset ? &*dataset : nullptr;
    std::vector<fs::path> files{arguments.output};
    if (output != ViewsOutput::folder) check_renders(arguments, files, known);
    const Gaussians gaussians = arguments.draw.load(arguments.splats, options);
    if (dataset && !dataset->frames.empty()) {
        glm::dvec3 sum(0);
        for (const Frame& frame : dataset->frames) sum += frame.camera.position();
        arguments.views.inside = sum / double(dataset->frames.size());
    }
    const std::vector<Camera> cameras = views_of(arguments.views, gaussians, hints_of(dataset), output);
    if (output == ViewsOutput::folder) {
        files.clear();
        for (size_t i = 0; i < cameras.size(); ++i)
            files.push_back(arguments.output / fmt::format("{:05}.{}", i, arguments.format));
        check_renders(arguments, files, known);
    }
    if (film) make_folder(arguments.output.parent_path());

    Renderer renderer(open_device(arguments.device), gaussians, options);
    const InterruptWatch watch;
    Progress progress("rendered", int(cameras.size()), "views", arguments.quiet);
    if (film) return write_film(arguments, renderer, options, cameras, progress);
    return write_views(arguments, renderer, cameras, files, progress);
}

/// Completes the arguments by the run that SPLATS may name, and chooses whose cameras are used.
int run(CLI::App& app, RenderArguments& arguments) {
    std::string of_frames;  // a given option that only a dataset's views have
    for (const char* option :
         {"--frames", "--test-every", "--downscale", "--max-width", "--exposures", "--appearance-of"})
        if (app.count(option) > 0) of_frames = option;
    if (arguments.lens == "native" || arguments.lens == "undistort") of_frames = "--lens " + arguments.lens;
    if (arguments.mode == "depth" && arguments.draw.integrator == "march")
        throw InputError("--mode depth: the integrator march draws no depth; the others do");
    SplatInput input = splat_input(arguments.splats);
    arguments.splats = input.file;
    if (input.run) use_options_of(*input.run, app);
    if (const auto use = core::find_value(scene::kLensWords, arguments.lens))
        arguments.lens_use = *use;
    else
        arguments.views.lens = lens_of(arguments.lens);
    if (!arguments.cameras.empty()) {
        arguments.cameras = dataset_input(arguments.cameras);
        return render_dataset_views(arguments);
    }
    const ViewsOutput output = views_output(arguments.output);
    const bool free = any_given(arguments.views) || (arguments.views.lens && of_frames.empty()) ||
                      output == ViewsOutput::film || (output == ViewsOutput::image && of_frames.empty());
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
    app.add_option("-o,--output", arguments->output,
                   "Folder for the renders, named like the images of the dataset or by number. Or one image "
                   "(.png, .jpg, .exr). "
                   "Without --cameras also a film (.mp4, .mov, .mkv, .webm) that the program ffmpeg writes")
        ->type_name("OUT")
        ->capture_default_str();
    add_views_options(app, arguments->views, cameras);
    add_frames_options(app, arguments->frames, arguments->test_every);
    app.add_option("--format", arguments->format,
                   "Format in a folder: png, jpg (8 bit, clamped) or exr (float32, not clamped)")
        ->transform(one_of({"png", "jpg", "exr"}))
        ->capture_default_str();
    app.add_option("--mode", arguments->mode,
                   "color, alpha, depth (mean view z; divided by its maximum in a png), median-depth (of the "
                   "surface) or normal (of the surface, in world axes; from -1..1 to 0..1 in a png)")
        ->transform(one_of({"color", "depth", "alpha", "median-depth", "normal"}))
        ->capture_default_str();
    add_draw_options(app, arguments->draw);
    app.add_option(
           "--lens", arguments->lens,
           std::string("Lens to render through, in place of a pinhole: ") + kLensForms +
               ". Or what becomes of the lenses of a dataset's cameras, as in ewa train: auto, native or "
               "undistort")
        ->type_name("LENS")
        ->capture_default_str();
    add_size_options(app, arguments->downscale, arguments->max_width);
    add_appearance_options(app, arguments->appearance);
    add_device_options(app, arguments->device);
    add_quiet_option(app, arguments->quiet);
    return [&app, arguments] { return run(app, *arguments); };
}

}  // namespace ewa::cli
