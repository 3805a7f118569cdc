// SPDX-License-Identifier: Apache-2.0
// ewa-view: parses the arguments, opens the scene in a window, and turns an error into one line and an exit
// status.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <future>
#include <new>
#include <sstream>
#include <utility>
#include <vector>

#include "core/exclusion.h"
#include "core/folders.h"
#include "core/messages.h"
#include "core/outputs.h"
#include "core/pixel_size.h"
#include "core/terminal.h"
#include "core/typing.h"
#include "core/words.h"
#include "ewa/error.h"
#include "folders/run.h"
#include "options/command_options.h"
#include "platform/desktop.h"
#include "platform/terminal.h"
#include "run/earlier_run.h"
#include "scene/dataset_files.h"
#include "scene/looks.h"
#include "scene/names.h"
#include "viewer/app.h"
#include "viewer/editor/film.h"
#include "viewer/kept_settings.h"
#include "viewer/offscreen.h"

namespace {

using namespace ewa;
using namespace ewa::viewer;

enum ExitStatus { kDone = 0, kFailed = 1, kWrongUse = 2 };
constexpr int kLargestSide = 16384;  // px

struct Arguments {
    std::filesystem::path path, cameras, views, output;
    struct {
        std::string address, token;
        std::filesystem::path token_file;
    } connect;
    std::string size, background, frame, mode, comparison;
    bool train = false, evenly = false;  // evenly: --film-seconds is given
    std::string kernel;                  // empty: that of the scene
    std::vector<std::string> train_options;
    DeviceOptions device{.selector = {}, .own_queue = false};  // the window shows what this queue renders
    Startup startup;
};

const core::Words<Mode> kModes = {{"color", Mode::color},           {"depth", Mode::depth},
                                  {"alpha", Mode::opacity},         {"count", Mode::count},
                                  {"ellipsoids", Mode::ellipsoids}, {"median-depth", Mode::median_depth},
                                  {"normal", Mode::normal}};
const core::Words<Comparison> kComparisons = {{"none", Comparison::none},
                                              {"beside", Comparison::beside},
                                              {"wipe", Comparison::wipe},
                                              {"difference", Comparison::difference}};

int fail(const std::string& what, int status) {
    std::fprintf(stderr, "ewa-view: %s\n", core::one_line(what).c_str());
    return status;
}

Size parse_size(const std::string& text) {
    const auto size = core::parse_size(text, kLargestSide);
    if (!size)
        throw InputError("--size: '" + text + "' is not a size such as 1280x720 or 4k, of at most " +
                         std::to_string(kLargestSide) + " a side");
    return {size->width, size->height};
}

/// The index of the frame that --frame names.
std::optional<int> frame_of(const std::string& frame, const Dataset* dataset) {
    if (frame.empty()) return std::nullopt;
    if (!dataset) throw InputError("--frame needs --cameras DATASET");
    const std::vector<int> frames = scene::frames_named(*dataset, frame);
    if (frames.size() > 1) throw InputError("--frame: '" + frame + "' is more than one frame");
    return frames.front();
}

/// The folder that `ewa train` would choose.
std::filesystem::path output_of(const Arguments& arguments) {
    if (!arguments.output.empty()) return arguments.output;
    return std::filesystem::path("out") / scene::dataset_name(arguments.path);
}

std::vector<std::string> options_of_training(const Arguments& arguments) {
    std::vector<std::string> options{arguments.path.string()};
    options.insert(options.end(), arguments.train_options.begin(), arguments.train_options.end());
    return options;
}

/// The last value of an option of ewa train; empty if it is not given.
std::string value_of(const std::vector<std::string>& options, const std::string& name) {
    std::string value;
    for (size_t i = 0; i < options.size(); ++i) {
        if (options[i] == name && i + 1 < options.size()) value = options[i + 1];
        if (options[i].starts_with(name + "=")) value = options[i].substr(name.size() + 1);
    }
    return value;
}

/// The options of ewa train that the search for cameras follows; ewa train checks them.
CaptureOptions capture_of(const Arguments& arguments) {
    CaptureOptions capture;
    const std::string frames = value_of(arguments.train_options, "--frames");
    capture.frames = core::parse_count<int>(frames).value_or(capture.frames);
    capture.level = value_of(arguments.train_options, "--level") != "off";
    return capture;
}

OpenedScene open_what(const Arguments& arguments, Startup& startup) {
    if (!arguments.connect.address.empty()) {
        startup.watch =
            live::WhatToWatch{{},
                              live::parse_address(arguments.connect.address),
                              live::find_token(arguments.connect.token, arguments.connect.token_file)};
        const std::filesystem::path& what = arguments.path.empty() ? arguments.cameras : arguments.path;
        OpenedScene scene =
            what.empty() ? OpenedScene() : open_scene(what, {}, startup.budget.value_or(kUsualBudget));
        scene.title = arguments.connect.address;
        return scene;
    }
    if (arguments.path.empty()) {
        if (arguments.train || !arguments.cameras.empty() || !startup.picture.empty() ||
            !startup.film.empty())
            throw InputError("PATH is required: splats, a dataset, or a run's folder (see ewa-view --help)");
        return {};  // files are dropped on the window
    }
    OpenedScene scene = open_scene(arguments.path, arguments.cameras, startup.budget.value_or(kUsualBudget));
    if (!scene.photos.empty() && (!startup.picture.empty() || !startup.film.empty()))
        throw InputError(arguments.path.string() +
                         " has no cameras yet; ewa cameras finds them, and so does the window");
    if (arguments.train) {
        if ((!scene.dataset && scene.photos.empty()) || !scene.run.empty())
            throw InputError("--train needs a dataset, and " + arguments.path.string() + " is not one");
        scene.remark.clear();
        RunOptions run;
        const auto asked = [&](const char* option) {
            return std::find(arguments.train_options.begin(), arguments.train_options.end(), option) !=
                   arguments.train_options.end();
        };
        run.resume = asked("--resume");
        run.force = asked("--force");
        train::check_free(output_of(arguments), run);  // before the window opens
        if (!scene.photos.empty()) {
            startup.later =
                LaterTraining{options_of_training(arguments), output_of(arguments), capture_of(arguments)};
            return scene;
        }
        const auto now = std::filesystem::file_time_type::clock::now();
        startup.watch = live::WhatToWatch{output_of(arguments), {}, {}, now, now};
    } else if (!scene.run.empty() && startup.picture.empty() && startup.film.empty()) {
        startup.watch = live::WhatToWatch{scene.run, {}, {}, scene.splats_time};
    }
    return scene;
}

/// Checks the files of a screenshot or a film against the inputs, and creates their folder.
void prepare_outputs(const CLI::App& command, const Startup& startup) {
    auto [written, read] = options::typed_files(command);
    if (!startup.film.empty()) {
        const FilmPath film(startup.views, double(startup.settings.film_seconds));
        for (int i = 0; i < film.frames(image::kFilmRate); ++i)
            written.push_back({"--film", frame_file(startup.film, i)});
    }
    if (written.empty()) return;
    if (startup.scene.dataset) {
        const std::vector<core::NamedFile> dataset = scene::files_of(*startup.scene.dataset, "the dataset");
        read.insert(read.begin(), dataset.begin(), dataset.end());
    }
    for (const char* name : folders::kRunFiles)
        if (!startup.scene.run.empty()) read.push_back({"a file of the run", startup.scene.run / name});
    core::check_outputs(written, read);
    core::make_folder(startup.film.empty() ? startup.picture.parent_path() : startup.film);
}

Startup open(const Arguments& arguments) {
    Startup startup = arguments.startup;
    startup.settings.look.mode = core::find_value(kModes, arguments.mode).value_or(Mode::color);
    startup.settings.comparison =
        core::find_value(kComparisons, arguments.comparison).value_or(Comparison::none);
    if (!arguments.size.empty()) startup.size = parse_size(arguments.size);
    if (!startup.picture.empty() && core::lower(startup.picture.extension().string()) != ".png")
        throw InputError("--screenshot " + startup.picture.string() + ": the name must end in .png");
    if (!arguments.views.empty()) startup.views = io::read_views(arguments.views);
    for (io::NamedView& view : startup.views)
        if (arguments.evenly) view.time.reset();
    if (!startup.film.empty() && startup.views.empty())
        throw InputError("--film needs --views FILE with the views to pass through");
    startup.scene = open_what(arguments, startup);
    startup.device.selector = arguments.device.selector;
    startup.frame = frame_of(arguments.frame, startup.scene.dataset.get());
    startup.settings.cameras = startup.scene.gaussians->size() == 0;
    Look& look = startup.settings.look;
    look.mode = std::exchange(look, startup.scene.look).mode;
    if (const auto kernel = core::find_value(scene::kKernelWords, arguments.kernel)) {
        look.kernel = *kernel;
        look.points = false;
    }
    if (arguments.background.empty()) return startup;
    look.sky.reset();
    const auto background = core::parse_colour(arguments.background);
    if (!background) throw InputError("--background: " + core::not_a_colour(arguments.background));
    look.background = *background;
    return startup;
}

/// What the last session left, where no option says otherwise. Scripts get the same result on every machine.
void take_settings(const CLI::App& app, Arguments& arguments) {
    Startup& startup = arguments.startup;
    startup.settings.train_steps = RunOptions().train.steps;
    arguments.evenly = app.count("--film-seconds") > 0;
    if (!startup.picture.empty() || !startup.film.empty()) return;
    KeptSettings kept = read_settings(settings_file());
    if (arguments.evenly) kept.film_seconds = startup.settings.film_seconds;
    static_cast<KeptSettings&>(startup.settings) = kept;
}

/// --help and --version: what CLI11 prints.
int print_text(const CLI::App& app, const CLI::ParseError& asked) {
    std::ostringstream text;
    app.exit(asked, text, text);
    if (core::print_whole(text.str())) return kDone;
    return fail(std::string("cannot write to standard output: ") + std::strerror(errno), kFailed);
}

void add_options(CLI::App& app, Arguments& arguments) {
    Startup& startup = arguments.startup;
    options::add(app, "PATH", arguments.path);
    options::add(app, "train", arguments.train);
    options::add(app, "output", arguments.output);
    options::add(app, "connect", arguments.connect.address);
    options::add(app, "token", arguments.connect.token);
    options::add(app, "token-file", arguments.connect.token_file);
    options::add(app, "cameras", arguments.cameras);
    options::add(app, "frame", arguments.frame);
    options::add(app, "mode", arguments.mode);
    options::add(app, "compare", arguments.comparison);
    options::add(app, "background", arguments.background);
    options::add(app, "kernel", arguments.kernel);
    options::add(app, "budget", startup.budget);
    options::add(app, "size", arguments.size);
    options::add(app, "screenshot", startup.picture);
    options::add(app, "views", arguments.views);
    options::add(app, "film", startup.film);
    options::add(app, "film-seconds", startup.settings.film_seconds);
    if (const char* named = std::getenv("EWA_DEVICE")) arguments.device.selector = named;
    options::add(app, "device", arguments.device.selector);
    options::add(app, "verbose", startup.verbose);
    options::arrange_help(app);
}

/// Shows the window, and remembers its settings for the next session.
void show(Startup& startup) {
    if (!startup.picture.empty()) return App(startup).run();
    App app(startup);
    app.run();
    write_settings(settings_file(), app.kept());
}

int run(const CLI::App& app, const Arguments& arguments) {
    try {
        options::check_typed(app);
        // The device opens while the scene is being read. A lost device is opened again.
        auto opening =
            std::async(std::launch::async, [options = arguments.device] { return open_device(options); });
        Startup startup = open(arguments);
        prepare_outputs(app, startup);
        startup.times.scene_read = startup.times.now();
        std::optional<TrainProcess> trainer;
        if (arguments.train) {
            const std::vector<std::string> options = options_of_training(arguments);
            if (!TrainProcess::accepts(options, output_of(arguments))) return kWrongUse;
            if (!startup.later) startup.trainer = &trainer.emplace(options, output_of(arguments));
        }
        const auto first = std::make_shared<std::shared_ptr<gpu::Device>>(opening.get());
        startup.device.name = device_info(**first).name;
        startup.times.device_open = startup.times.now();
        startup.open_device = [options = arguments.device, first] {
            return *first ? std::exchange(*first, nullptr) : open_device(options);
        };
        if (!startup.film.empty() || (!startup.picture.empty() && !platform::has_desktop()))
            write_without_window(startup);
        else
            show(startup);
        return kDone;
    } catch (const InputError& error) {
        return fail(error.what(), kWrongUse);
    } catch (const RunError& error) {
        return fail(error.what(), kFailed);
    } catch (const vk::DeviceLostError& error) {
        return fail(std::string("the device that shows the window was lost several times: ") + error.what(),
                    kFailed);
    } catch (const vk::SystemError& error) {
        return fail(std::string("the device that shows the window failed: ") + error.what(), kFailed);
    } catch (const std::bad_alloc&) {
        return fail("out of host memory; a smaller scene or window needs less", kFailed);
    } catch (const std::exception& error) {
        return fail(std::string("unexpected failure: ") + error.what(), kFailed);
    }
}

}  // namespace

int main(int argc, char** argv) {
    platform::begin_program(argc, argv);
    core::print_warnings();
    CLI::App app{"Shows a 3D Gaussian splat scene in a window. F1 in the window lists the keys."};
    app.name("ewa-view");
    app.allow_windows_style_options(false);  // paths may begin with a slash
    app.set_version_flag("--version", "ewa-view " EWA_VERSION);
    core::use_help_text<CLI::Formatter>(app);
    Arguments arguments;
    add_options(app, arguments);
    core::refuse_empty_values<CLI::Validator>(app);
    app.allow_extras();
    try {
        app.parse(argc, argv);
        arguments.train_options = app.remaining();
        if (!arguments.train && !arguments.train_options.empty())
            return fail(
                core::unexpected_arguments(argc, argv, arguments.train_options, options::option_names(app)) +
                    " (see ewa-view --help)",
                kWrongUse);
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) return print_text(app, error);
        return fail(std::string(error.what()) + " (see ewa-view --help)", kWrongUse);
    }
    take_settings(app, arguments);
    return run(app, arguments);
}
