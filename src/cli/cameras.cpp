// SPDX-License-Identifier: Apache-2.0
// ewa cameras: finds the cameras of photos or of a video's frames.
#include "cli/cameras.h"

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include <map>
#include <memory>

#include "cli/arguments.h"
#include "cli/command.h"
#include "cli/interrupt.h"
#include "cli/output.h"
#include "core/text.h"
#include "ewa/error.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;

struct CamerasArguments {
    fs::path input, output;
    CaptureOptions options;
    bool quiet = false;
};

int run(const CLI::App& app, const CamerasArguments& arguments) {
    if (app.count("--frames") > 0 && !has_videos(arguments.input) &&
        (fs::is_directory(arguments.input) || is_archive(arguments.input)))
        refuse_frames(std::to_string(arguments.options.frames), arguments.input);
    Progress progress("searched", 1, "photos", arguments.quiet);
    place_with_progress(arguments.input, arguments.output, arguments.options, progress);
    return 0;
}

}  // namespace

void refuse_frames(const std::string& frames, const fs::path& photos) {
    throw InputError("--frames " + frames + ": " + core::one_line(photos.string()) +
                     " has photos, of which all are used; --frames is for datasets and videos");
}

void place_with_progress(const fs::path& input, const fs::path& folder, const CaptureOptions& options,
                         Progress& progress, const CaptureProgressLine::After& after,
                         const CaptureProgressLine::Before& before) {
    const InterruptWatch watch;
    CaptureProgressLine line(progress, after, before);
    const Capture capture = make_dataset(input, folder, options, [&](const CaptureProgress& now) {
        line.update(now);
        return !interrupted();
    });
    if (capture.interrupted) {
        progress.note(kHowToContinue);
        throw Interrupted();
    }
    for (const std::string& remark : capture.remarks) progress.note(remark);
    if (!capture.axes.empty()) progress.note(capture.axes);
    progress.note(
        fmt::format("{}: {} of {} photos have cameras", folder.string(), capture.placed, capture.images));
}

Action add_cameras(CLI::App& app) {
    const auto arguments = std::make_shared<CamerasArguments>();
    CaptureOptions& options = arguments->options;
    app.add_option(
           "INPUT", arguments->input,
           "Folder with photos (JPEG, PNG, TIFF or BMP), a video, or a folder with videos. COLMAP finds the "
           "cameras, ffmpeg reads the video; both must be installed")
        ->required()
        ->type_name("");
    app.add_option(
           "-o,--output", arguments->output,
           "Folder for the dataset: images/, sparse/0 and colmap/log.txt. An interrupted run continues there")
        ->required()
        ->type_name("DIR");
    app.add_option(
           "--frames", options.frames,
           "Number of frames to take from a video, or from all videos of a folder, about: the sharpest of "
           "each of as many equal parts")
        ->transform(in_range(kFewestVideoFrames, kMostVideoFrames))
        ->type_name("N")
        ->capture_default_str();
    static const std::map<std::string, Matching> kMatchings = {
        {"auto", Matching::automatic}, {"sequence", Matching::sequence}, {"unordered", Matching::unordered}};
    app.add_option_function<std::string>(
           "--matching", [&options](const std::string& name) { options.matching = kMatchings.at(name); },
           "Which photos to compare. unordered: each with each. sequence: each with those that follow it in "
           "the order of names. auto: those that look as if they showed the same things, up to 1,000 photos; "
           "sequence for more")
        ->transform(one_of({"auto", "sequence", "unordered"}))
        ->type_name("ORDER")
        ->default_str("auto");
    app.add_option_function<std::string>(
           "--level", [&options](const std::string& word) { options.level = word == "on"; },
           "Level the world, with scale, north and place where the photos' GPS says them. off: COLMAP's axes")
        ->transform(one_of({"on", "off"}))
        ->type_name("on|off")
        ->default_str("on");
    add_quiet_option(app, arguments->quiet);
    return [&app, arguments] { return run(app, *arguments); };
}

}  // namespace ewa::cli
