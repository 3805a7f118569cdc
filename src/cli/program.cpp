// SPDX-License-Identifier: Apache-2.0
#include "cli/program.h"

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <functional>
#include <new>
#include <sstream>

#include "cli/command.h"
#include "cli/interrupt.h"
#include "cli/usage.h"
#include "core/terminal.h"
#include "core/text.h"
#include "ewa/error.h"

namespace ewa::cli {
namespace {

enum ExitStatus { kDone = 0, kFailed = 1, kWrongUse = 2 };

struct Command {
    const char *name, *description;
    std::function<Action(CLI::App&)> add;
    CLI::App* app = nullptr;
    Action action = {};
};

int fail(const std::string& who, const std::string& what, int status) {
    std::fflush(stdout);
    std::fprintf(stderr, "%s: %s\n", who.c_str(), core::one_line(what).c_str());
    return status;
}

int status_of(const Action& action) {
    try {
        return action();
    } catch (const Interrupted&) {
        return kInterruptedStatus;
    }
}

int fail_to_print(const std::string& who) {
    return fail(who, std::string("cannot write to standard output: ") + std::strerror(errno), kFailed);
}

/// --help and --version: what CLI11 prints.
int print_text(const CLI::App& app, const CLI::ParseError& asked) {
    std::ostringstream text;
    app.exit(asked, text, text);
    return core::print_whole(text.str()) ? kDone : fail_to_print("ewa");
}

int run(const Command& command) {
    const std::string who = std::string("ewa ") + command.name;
    try {
        remove_temporary_files_on_signals();
        const int status = status_of(command.action);
        // If output is redirected to a full disk, only this flush fails.
        if (std::fflush(stdout) != 0) return fail_to_print(who);
        if (std::ferror(stdout)) return fail(who, "cannot write all of standard output", kFailed);
        return status;
    } catch (const InputError& error) {
        return fail(who, error.what(), kWrongUse);
    } catch (const CLI::Error& error) {  // an invalid value in --config
        return fail(who, error.what(), kWrongUse);
    } catch (const RunError& error) {
        return fail(who, error.what(), kFailed);
    } catch (const std::bad_alloc&) {
        return fail(who, "out of host memory; try --downscale or a smaller scene", kFailed);
    } catch (const std::exception& error) {
        return fail(who, std::string("unexpected failure: ") + error.what(), kFailed);
    }
}

/// The word as a POSIX shell reads it back.
std::string shell_quoted(const std::string& word) {
    static constexpr const char* kPlain =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=./,:@%";
    if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
    std::string quoted = "'";
    for (const char c : word) quoted += c == '\'' ? "'\\''" : std::string(1, c);
    return quoted + "'";
}

std::string command_line(int argc, char** argv) {
    std::string line = "ewa";
    for (int i = 1; i < argc; ++i) line += " " + shell_quoted(argv[i]);
    return line;
}

}  // namespace

int run_program(int argc, char** argv) {
    CLI::App app{
        "Trains, renders and inspects 3D Gaussian splats on any Vulkan device, a plain CPU included."};
    app.name("ewa");
    app.set_version_flag("--version", "ewa " EWA_VERSION);
    app.require_subcommand(1);
    core::use_help_text<CLI::Formatter>(app);
    const auto add_train_here = [&](CLI::App& train) { return add_train(train, command_line(argc, argv)); };
    Command commands[] = {
        {"train", "Trains splats from images with cameras, photos or a video", add_train_here},
        {"render", "Renders a splat scene: framed by itself, or through the cameras of a dataset",
         add_render},
        {"eval", "Measures PSNR and SSIM of a splat scene against images", add_eval},
        {"grad", "Writes the gradient of the training loss for one view", add_grad},
        {"convert", "Converts, joins and edits splat files", add_convert},
        {"info", "Shows what a splat file or a dataset holds, and what rendering skips", add_info},
        {"devices", "Lists the Vulkan devices of this machine", add_devices},
        {"dataset", "Renders a mesh scene (glTF) into a dataset to train on", add_dataset},
        {"cameras", "Finds the cameras of photos or of a video, with COLMAP", add_cameras},
        {"bench", "Measures the speed of each pass, and its error against the CPU reference", add_bench},
        {"compare", "Compares two images, folders of images, or splat scenes", add_compare},
    };
    for (Command& command : commands) {
        command.app = app.add_subcommand(command.name, command.description);
        command.action = command.add(*command.app);
        group_by_subject(*command.app);
    }

    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) return print_text(app, error);
        std::string who = "ewa";
        const CLI::App* given = &app;
        for (const Command& command : commands)
            if (command.app->parsed()) {
                who += std::string(" ") + command.name;
                given = command.app;
            }
        return fail(who, usage_error(app, *given, error, argc, argv) + " (see " + who + " --help)",
                    kWrongUse);
    }
    for (const Command& command : commands)
        if (command.app->parsed()) return run(command);
    return kWrongUse;  // not reached: the parser requires a command
}

}  // namespace ewa::cli
