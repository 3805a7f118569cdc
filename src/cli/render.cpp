// SPDX-License-Identifier: Apache-2.0
// ewa render: renders a splat scene through the cameras of a dataset, whose images are not needed.
#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <memory>

#include "cli/arguments.h"
#include "cli/command.h"
#include "cli/interrupt.h"
#include "cli/output.h"
#include "ewa/error.h"
#include "ewa/renderer.h"
#include "ewa/splat_files.h"
#include "report/pictures.h"
#include "scene/dataset_files.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;

struct RenderArguments {
    fs::path splats, cameras, output = "out/render";
    std::string frames = "all", format = "png", mode = "color";
    int test_every = 8, downscale = 1;
    DrawArguments draw;
    DeviceOptions device;
    bool quiet = false;
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

int run(const RenderArguments& arguments) {
    const RenderOptions options = arguments.draw.options();
    const Gaussians gaussians = load_splats(arguments.splats);
    const Dataset dataset = load_cameras_as_trained(arguments.cameras, arguments.downscale);
    const std::vector<int> frames = select_frames(dataset, arguments.frames, arguments.test_every);
    const std::vector<fs::path> names = report::picture_names(dataset.frames);
    const auto file_of = [&](int frame) {
        return arguments.output / (names[size_t(frame)].string() + "." + arguments.format);
    };
    std::vector<NamedFile> written, read = scene::files_of(dataset, "--cameras");
    for (const int frame : frames) written.push_back({"the render", file_of(frame)});
    read.insert(read.end(), {{"SPLATS", arguments.splats}, {"--cameras", arguments.cameras}});
    check_outputs(written, read);
    make_folder(arguments.output);

    Renderer renderer(open_device(arguments.device), gaussians, options);
    const InterruptWatch watch;
    Progress progress("rendered", static_cast<int>(frames.size()), "frames", arguments.quiet);
    uint32_t skipped = 0;
    for (size_t i = 0; i < frames.size(); ++i) {
        if (interrupted()) return kInterruptedStatus;
        const Frame& frame = dataset.frames[frames[i]];
        Rendering rendering = renderer.render(frame.camera, arguments.mode == "depth");
        skipped = std::max(skipped, renderer.skipped_nonfinite());

        std::string remark;
        const fs::path file = file_of(frames[i]);
        make_folder(file.parent_path());
        save_image(file, chosen_image(std::move(rendering), arguments, remark));
        if (!remark.empty()) progress.note(file.string() + ": " + remark);
        progress.update(static_cast<int>(i) + 1);
    }
    if (skipped > 0)
        progress.note("skipped " + core::counted(skipped, "splat") + " with a value that is not finite");
    progress.note(fmt::format("{} {} in {}", core::counted(frames.size(), "image"),
                              core::is_or_are(frames.size()), arguments.output.string()));
    return 0;
}

}  // namespace

Action add_render(CLI::App& app) {
    const auto arguments = std::make_shared<RenderArguments>();
    add_splats(app, arguments->splats);
    app.add_option("--cameras", arguments->cameras, "Dataset whose cameras to render through")
        ->required()
        ->type_name("DATASET");
    app.add_option("-o,--output", arguments->output,
                   "Folder for the renders, named like the images of the dataset")
        ->type_name("DIR")
        ->capture_default_str();
    add_frames_options(app, arguments->frames, arguments->test_every);
    app.add_option("--format", arguments->format,
                   "File format: png (8 bit, clamped) or exr (float32, not clamped)")
        ->transform(one_of({"png", "exr"}))
        ->capture_default_str();
    app.add_option("--mode", arguments->mode,
                   "color, depth (view z; divided by its maximum in a png) or alpha")
        ->transform(one_of({"color", "depth", "alpha"}))
        ->capture_default_str();
    add_draw_options(app, arguments->draw);
    add_downscale_option(app, arguments->downscale);
    add_device_options(app, arguments->device);
    add_quiet_option(app, arguments->quiet);
    return [arguments] { return run(*arguments); };
}

}  // namespace ewa::cli
