// SPDX-License-Identifier: Apache-2.0
// ewa render: renders a splat scene, through the cameras of a dataset, whose images are not needed, or as it is framed
// by itself.
#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <memory>
#include <optional>

#include "cli/arguments.h"
#include "cli/command.h"
#include "cli/interrupt.h"
#include "cli/output.h"
#include "cli/render_output.h"
#include "cli/render_picture.h"
#include "cli/render_views.h"
#include "cli/run_inputs.h"
#include "cli/splat_statistics.h"
#include "core/messages.h"
#include "core/text.h"
#include "ewa/error.h"
#include "ewa/renderer.h"
#include "ewa/splat_files.h"
#include "image/film_file.h"
#include "io/datasets/dataset_folders.h"
#include "io/datasets/refined_cameras.h"
#include "report/pictures.h"
#include "scene/dataset_files.h"
#include "scene/framing.h"
#include "scene/looks.h"
#include "scene/native_lens.h"
#include "scene/readout.h"
#include "scene/splat_arrays.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;

struct RenderArguments {
    fs::path splats, cameras, output = "out/render";
    std::string frames = "all", format = "png", mode = "color", through, codec;
    RunOptions of_cameras;  // of a dataset: its lens, downscale and max_width
    AppearanceArguments appearance;
    int test_every = 8;
    ViewsArguments views;
    PictureArguments picture;
    DrawArguments draw;
    DeviceOptions device;
    bool quiet = false;
    // The run that SPLATS names; empty: none.
    std::optional<folders::Run> run;
    bool cameras_of_run = false, run_is_folder = false;
};

struct DrawnScene {
    const Gaussians& gaussians;
    const RenderOptions& options;
};

/// The scene, and the options to draw it with.
Gaussians load_scene(const RenderArguments& arguments, RenderOptions& options) {
    Gaussians gaussians = arguments.draw.load(arguments.splats, options);
    if (arguments.picture.transparent) {
        options.background = {0, 0, 0};
        options.sky.reset();
    }
    return gaussians;
}

void note_skipped(Progress& progress, uint32_t skipped, const Gaussians& gaussians) {
    if (skipped > 0) progress.note(skipped_text(skipped, scene::undrawable_text(gaussians)));
}

/// Counts the views that show nothing.
class EmptyViews {
  public:
    explicit EmptyViews(const std::string& mode) : what_(mode == "median-depth" ? "surface" : "splat") {}
    void add(bool empty) {
        if (empty && empty_++ == 0) first_ = views_;
        ++views_;
    }
    /// Says how many there are, and where the scene is. files: one a view, or one of all.
    void warn(const Gaussians& gaussians, const std::vector<fs::path>& files) const {
        if (empty_ == 0) return;
        const bool together = files.size() == 1;
        const std::string file = core::one_line(files[together ? 0 : first_].string());
        std::string text =
            views_ == 1 ? fmt::format("{} shows no {}", file, what_)
                        : fmt::format("{} of {} views show no {}, the first is {}", empty_, views_, what_,
                                      together ? fmt::format("view {} of {}", first_ + 1, file) : file);
        if (const scene::Box box = scene::framed_box(gaussians); box.low.x <= box.high.x)
            text += fmt::format(": the scene is within {:.3g} of {:.6g},{:.6g},{:.6g}",
                                0.5 * glm::length(box.high - box.low), box.center().x, box.center().y,
                                box.center().z);
        core::warn(text);
    }

  private:
    const char* what_;
    size_t views_ = 0, empty_ = 0, first_ = 0;
};

/// View i in its appearance. appearances: of each view, or none.
Rendering picture_of(const RenderArguments& arguments, PictureTaker& taker, size_t i,
                     const std::vector<Appearance>& appearances) {
    Rendering picture = taker.take(i);
    if (!appearances.empty() && arguments.mode == "color")
        picture.color = arguments.picture.transparent
                            ? with_appearance_over_black(picture, appearances[i])
                            : with_appearance(std::move(picture.color), appearances[i]);
    return picture;
}

/// Renders the views into the files. appearances: of each, or none. Returns the exit status.
int write_images(const RenderArguments& arguments, const DrawnScene& scene, Renderer& renderer,
                 ViewPath views, const std::vector<fs::path>& files,
                 const std::vector<Appearance>& appearances, Progress& progress) {
    const std::vector<Camera> cameras = views.cameras;
    const ImageKind kind{arguments.mode, arguments.format, arguments.picture.transparent};
    PictureTaker taker(arguments.picture, renderer, drawing_of(arguments.mode), scene.options.kernel,
                       std::move(views));
    EmptyViews empty(arguments.mode);
    for (size_t i = 0; i < cameras.size(); ++i) {
        if (interrupted()) return kInterruptedStatus;
        Rendering picture = picture_of(arguments, taker, i, appearances);
        empty.add(is_empty(picture));
        save_render(files[i], std::move(picture), kind, scene::shows_all_around(cameras[i]), progress);
        if (cameras.size() > 1) progress.update(int(i) + 1);
    }
    note_skipped(progress, taker.skipped(), scene.gaussians);
    progress.clear();
    empty.warn(scene.gaussians, files);
    if (files[0] == arguments.output)
        progress.note(
            fmt::format("{}: {}x{}", arguments.output.string(), cameras[0].width, cameras[0].height));
    else
        progress.note(fmt::format("{} {} in {}", core::counted(cameras.size(), "image"),
                                  core::is_or_are(cameras.size()), arguments.output.string()));
    return 0;
}

/// The file of each frame's render, in the output folder or as the one image that --output names.
std::vector<fs::path> files_of_frames(const RenderArguments& arguments, const Dataset& dataset,
                                      const std::vector<int>& frames) {
    const ViewsOutput output = views_output(arguments.output);
    if (output == ViewsOutput::film && dataset.frame_rate == 0)
        throw InputError("--output " + core::one_line(arguments.output.string()) +
                         ": a film goes round the scene, along --views or a path of cameras; those of a "
                         "dataset's photos make "
                         "images in a folder");
    if (output == ViewsOutput::film) return {arguments.output};
    if (output == ViewsOutput::image && frames.size() > 1)
        throw InputError(fmt::format(
            "--output {}: one image, and there are {} frames; choose one with --frames, or name a "
            "folder",
            core::one_line(arguments.output.string()), frames.size()));
    if (output == ViewsOutput::image) return {arguments.output};
    const std::vector<fs::path> names = report::picture_names(dataset.frames);
    std::vector<fs::path> files;
    for (const int frame : frames)
        files.push_back(arguments.output / (names[size_t(frame)].string() + "." + arguments.format));
    return files;
}

/// Throws if a render would replace a file that is read, or land among photos.
void check_renders(const CLI::App& app, const RenderArguments& arguments, const std::vector<fs::path>& files,
                   const Dataset* dataset) {
    // The user names a single file, so its folder may be a dataset.
    const fs::path folder = files[0] == arguments.output ? fs::path() : arguments.output;
    if (folder.empty())
        io::check_not_inside_dataset("-o", fs::absolute(arguments.output).parent_path());
    else if (dataset)
        io::check_output_folder("-o", folder, *dataset);
    else
        io::check_output_folder("-o", folder);
    std::vector<NamedFile> written;
    for (const fs::path& file : files) written.push_back({"the render", file});
    check_typed_outputs(app, written,
                        dataset ? scene::files_of(*dataset, "the dataset") : std::vector<NamedFile>());
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

/// The film of these views. appearances: of each, or none. Returns the exit status.
int write_film(const RenderArguments& arguments, const DrawnScene& scene, Renderer& renderer,
               const ViewPath& views, const std::vector<Appearance>& appearances, const std::string& encoder,
               Progress& progress) {
    const std::vector<Camera>& cameras = views.cameras;
    make_folder(arguments.output.parent_path());
    image::FilmFile film(arguments.output, cameras[0].width, cameras[0].height, encoder, views.rate);
    PictureTaker taker(arguments.picture, renderer, Drawing::color, scene.options.kernel, views);
    EmptyViews empty(arguments.mode);
    for (size_t i = 0; i < cameras.size(); ++i) {
        if (interrupted()) return kInterruptedStatus;
        if (arguments.picture.blurs() || !appearances.empty()) {
            const Rendering picture = picture_of(arguments, taker, i, appearances);
            empty.add(is_empty(picture));
            film.add(screen_bytes(picture.color));
        } else {
            film.add(renderer.render_bytes(cameras[i], {.render = scene.options}));
            empty.add(renderer.splats_drawn() == 0);
        }
        progress.update(int(i) + 1);
    }
    film.finish();
    note_skipped(progress, renderer.skipped_nonfinite(), scene.gaussians);
    progress.clear();
    empty.warn(scene.gaussians, {arguments.output});
    progress.note(fmt::format("{}: {} frames, {:.1f} s", arguments.output.string(), cameras.size(),
                              double(cameras.size()) / views.rate));
    return 0;
}

/// The encoder of the film that --output names. Empty: there is no film, or ffmpeg chooses.
std::string encoder_of(const RenderArguments& arguments) {
    if (views_output(arguments.output) != ViewsOutput::film) return {};
    if (arguments.mode != "color") throw InputError("a film has --mode color; a folder can have any mode");
    std::string encoder = image::find_encoder(arguments.codec, arguments.output);
    image::find_ffmpeg();
    return encoder;
}

void check_motion(const RenderArguments& arguments, const ViewPath& views) {
    if (arguments.picture.shutter > 0 && !views.at)
        throw InputError("--shutter: there is no motion; the film has one frame");
}

int render_dataset_views(const CLI::App& app, RenderArguments arguments) {
    RenderOptions options = arguments.draw.options();
    const Gaussians gaussians = load_scene(arguments, options);
    Dataset dataset = load_cameras_as_trained(arguments.cameras, arguments.of_cameras);
    const fs::path refined = arguments.cameras_of_run ? refined_cameras_of(*arguments.run) : fs::path();
    if (!refined.empty()) io::use_refined_cameras(dataset, refined);
    const std::vector<int> frames = select_frames(dataset, arguments.frames, arguments.test_every);
    const std::vector<fs::path> files = files_of_frames(arguments, dataset, frames);
    const bool path = dataset.frame_rate > 0;
    check_picture(arguments.picture, path, core::lower(files[0].extension().string()));
    arguments.format = core::lower(files[0].extension().string()).substr(1);
    check_renders(app, arguments, files, &dataset);
    const std::string encoder = encoder_of(arguments);
    const std::vector<Appearance> appearances = appearances_of(
        arguments.appearance, arguments.cameras_of_run ? arguments.run : std::nullopt, dataset, frames);

    if (arguments.views.lens)
        for (Frame& frame : dataset.frames)
            frame.camera = of_frame(*arguments.views.lens, frame.camera, dataset, gaussians);

    ViewPath views;
    if (path)
        views = path_of(dataset, frames);
    else
        for (const int frame : frames) views.cameras.push_back(dataset.frames[size_t(frame)].camera);
    check_motion(arguments, views);
    Renderer renderer(open_device(arguments.device), gaussians, options);
    const InterruptWatch watch;
    Progress progress("rendered", static_cast<int>(frames.size()), "frames", arguments.quiet);
    const DrawnScene scene{gaussians, options};
    if (views_output(arguments.output) == ViewsOutput::film)
        return write_film(arguments, scene, renderer, views, appearances, encoder, progress);
    return write_images(arguments, scene, renderer, std::move(views), files, appearances, progress);
}

/// The dataset of the run, if it can be read. Else the scene is framed as one of which nothing is known.
std::optional<Dataset> dataset_of_run(const RenderArguments& arguments) try {
    if (!arguments.run || arguments.run->dataset.empty()) return std::nullopt;
    return load_cameras_as_trained(arguments.run->dataset);
} catch (const InputError&) {
    return std::nullopt;
}

/// What its cameras say about the scene.
scene::FramingHints hints_of(const std::optional<Dataset>& dataset) {
    if (!dataset || dataset->frames.empty()) return {};
    const glm::dmat3 axes = glm::transpose(dataset->frames[0].camera.rotation);
    return {.up = scene::mean_up(*dataset), .forward = axes[2]};
}

/// Without the cameras of a dataset.
int render_free_views(const CLI::App& app, RenderArguments arguments) {
    const ViewsOutput output = views_output(arguments.output);
    const bool film = output == ViewsOutput::film, one_image = output == ViewsOutput::image;
    RenderOptions options = arguments.draw.options();
    check_views(arguments.views);
    const std::string encoder = encoder_of(arguments);
    const bool path = film || arguments.views.orbit > 1 || arguments.views.film_seconds > 0;
    check_picture(arguments.picture, path,
                  output == ViewsOutput::folder ? "." + arguments.format
                                                : core::lower(arguments.output.extension().string()));
    if (one_image) arguments.format = core::lower(arguments.output.extension().string()).substr(1);
    const std::optional<Dataset> dataset = dataset_of_run(arguments);
    const Dataset* const known = dataset ? &*dataset : nullptr;
    std::vector<fs::path> files{arguments.output};
    if (output != ViewsOutput::folder) check_renders(app, arguments, files, known);
    const NewViewAppearance appearance = appearance_of_new_views(
        arguments.appearance, arguments.run_is_folder ? arguments.run : std::nullopt, known);
    const Gaussians gaussians = load_scene(arguments, options);
    if (dataset && !dataset->frames.empty()) {
        glm::dvec3 sum(0);
        for (const Frame& frame : dataset->frames) sum += frame.camera.position();
        arguments.views.inside = sum / double(dataset->frames.size());
    }
    const ViewPath views = views_of(arguments.views, gaussians, hints_of(dataset), output);
    check_motion(arguments, views);
    if (output == ViewsOutput::folder) {
        files.clear();
        for (size_t i = 0; i < views.cameras.size(); ++i)
            files.push_back(arguments.output / fmt::format("{:05}.{}", i, arguments.format));
        check_renders(app, arguments, files, known);
    }

    Renderer renderer(open_device(arguments.device), gaussians, options);
    const InterruptWatch watch;
    Progress progress("rendered", int(views.cameras.size()), "views", arguments.quiet);
    const DrawnScene scene{gaussians, options};
    std::vector<Appearance> appearances;
    for (const Camera& camera : views.cameras)
        if (auto of_view = appearance.at(camera.position())) appearances.push_back(std::move(*of_view));
    if (film) return write_film(arguments, scene, renderer, views, appearances, encoder, progress);
    return write_images(arguments, scene, renderer, views, files, appearances, progress);
}

/// of_frames: an option that only a dataset's views have.
[[noreturn]] void refuse_dataset_options(const CLI::App& app, const std::string& of_frames, bool run) {
    if (!run) throw InputError(of_frames + " needs --cameras DATASET");
    std::string other = "a film";
    for (const char* option : {"--size", "--look-at", "--up", "--orbit", "--views"})
        if (app.count(option) > 0) other = option;
    throw InputError(of_frames + " is of the images of the run, and " + other +
                     " of other views: leave one out" +
                     (other == "--size" ? "; --max-width makes the images smaller" : ""));
}

/// Completes the arguments by the run that SPLATS may name, and chooses whose cameras are used.
int run(CLI::App& app, RenderArguments& arguments) {
    std::string of_frames;  // a given option that only a dataset's views have
    for (const char* option : {"--frames", "--test-every", "--downscale", "--max-width", "--lens"})
        if (app.count(option) > 0) of_frames = option;
    if (!arguments.codec.empty() && views_output(arguments.output) != ViewsOutput::film)
        throw InputError("--codec: only a film has one, such as -o film.mp4");
    SplatInput input = splat_input(arguments.splats);
    arguments.splats = input.file;
    arguments.appearance.run = input.run ? input.run : folders::run_of_splats(arguments.splats);
    if (!arguments.cameras.empty()) arguments.cameras = dataset_input(arguments.cameras);
    if (input.run) use_options_of(*input.run, app, arguments.cameras);
    if (!arguments.through.empty()) arguments.views.lens = lens_of(arguments.through);
    if (!arguments.cameras.empty()) return render_dataset_views(app, arguments);
    const ViewsOutput output = views_output(arguments.output);
    const bool free = any_given(arguments.views) || (arguments.views.lens && of_frames.empty()) ||
                      output == ViewsOutput::film || (output == ViewsOutput::image && of_frames.empty());
    if (input.run && !free) {
        arguments.cameras = dataset_of(*input.run);
        arguments.run = std::move(input.run);
        arguments.cameras_of_run = true;
        return render_dataset_views(app, arguments);
    }
    if (!of_frames.empty()) refuse_dataset_options(app, of_frames, input.run.has_value());
    arguments.run_is_folder = input.run.has_value();
    arguments.run = arguments.appearance.run;
    return render_free_views(app, arguments);
}

}  // namespace

Action add_render(CLI::App& app) {
    const auto arguments = std::make_shared<RenderArguments>();
    options::add(app, "SPLATS", arguments->splats);
    options::add(app, "cameras", arguments->cameras);
    options::add(app, "output", arguments->output);
    ViewsArguments& views = arguments->views;
    options::add(app, "size", views.size);
    options::add(app, "orbit", views.orbit);
    options::add(app, "look-at", views.look_at);
    options::add(app, "up", views.up);
    options::add(app, "views", views.views);
    options::add(app, "film-seconds", views.film_seconds);
    options::add(app, "frames", arguments->frames);
    options::add(app, "test-every", arguments->test_every);
    options::add(app, "format", arguments->format);
    options::add(app, "mode", arguments->mode);
    options::add(app, "codec", arguments->codec);
    PictureArguments& picture = arguments->picture;
    options::add(app, "aperture", picture.aperture);
    options::add(app, "focus", picture.focus);
    options::add(app, "shutter", picture.shutter);
    options::add(app, "blur-samples", picture.blur_samples);
    options::add(app, "transparent", picture.transparent);
    add_draw_options(app, arguments->draw);
    options::add(app, "through", arguments->through);
    for (const char* name : {"lens", "downscale", "max-width"})
        options::add(app, name, arguments->of_cameras);
    add_appearance_options(app, arguments->appearance);
    add_device_options(app, arguments->device);
    options::add(app, "quiet", arguments->quiet);
    return [&app, arguments] { return run(app, *arguments); };
}

}  // namespace ewa::cli
