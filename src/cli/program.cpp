// SPDX-License-Identifier: Apache-2.0
#include "cli/program.h"

#include <CLI/CLI.hpp>
#include <functional>
#include <sstream>
#include <string>
#include <vector>

#include "cli/command.h"
#include "cli/interrupt.h"
#include "cli/status.h"
#include "cli/usage.h"
#include "core/exclusion.h"
#include "core/folders.h"
#include "core/terminal.h"
#include "core/text.h"
#include "options/command_options.h"

namespace ewa::cli {
namespace {

/// --help, --help-all and --version: what CLI11 prints.
int print_text(const CLI::App& app, const CLI::ParseError& asked) {
    std::ostringstream text;
    app.exit(asked, text, text);
    return core::print_whole(text.str()) ? kDone : fail_to_print("ewa");
}

int run(const Command& command) {
    return status_of("ewa " + command.name, [&] {
        options::check_typed(*command.app);
        remove_temporary_files_on_signals();
        return command.action();
    });
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

/// The arguments with ~ as the home folder, and with `help`, `help COMMAND`, `version`, -v and -V as the options that they
/// stand for.
std::vector<std::string> usual_arguments(int argc, char** argv) {
    std::vector<std::string> words;
    for (int i = 0; i < argc; ++i) words.push_back(core::with_home(argv[i]));
    if (argc < 2) return words;
    if (argc <= 3 && words[1] == "help") {
        words.erase(words.begin() + 1);
        words.emplace_back("--help");
    } else if (argc == 2 && (words[1] == "version" || words[1] == "-v" || words[1] == "-V")) {
        words[1] = "--version";
    }
    return words;
}

int run_arguments(int argc, char** argv) {
    CLI::App app{
        "Trains, renders and inspects 3D Gaussian splats on any Vulkan device, a plain CPU included."};
    app.name("ewa");
    app.allow_windows_style_options(false);  // paths may begin with a slash
    app.set_version_flag("--version", "ewa " EWA_VERSION);
    app.require_subcommand(1);
    core::use_help_text<CLI::Formatter>(app);
    const std::vector<Command> commands = add_commands(app, command_line(argc, argv));
    core::refuse_empty_values<CLI::Validator>(app);

    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        std::string who = "ewa";
        const CLI::App* given = &app;
        for (const Command& command : commands)
            if (command.app->parsed()) {
                who += " " + command.name;
                given = command.app;
            }
        const bool unknown = given == &app && argc > 1 && argv[1][0] != '-';
        if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success) && !unknown)
            return print_text(app, error);
        return fail(who, usage_error(app, *given, error, argc, argv) + " (see " + who + " --help)",
                    kWrongUse);
    }
    for (const Command& command : commands)
        if (command.app->parsed()) return run(command);
    return kWrongUse;  // not reached: the parser requires a command
}

}  // namespace

std::vector<Command> add_commands(CLI::App& app, const std::string& command_line) {
    const auto add_train_here = [&](CLI::App& train) { return add_train(train, command_line); };
    const struct {
        const char *name, *description;
        std::function<Action(CLI::App&)> add;
    } rows[] = {
        {"train", "Trains splats from images with cameras, photos or a video", add_train_here},
        {"render", "Renders a splat scene: framed by itself, or through the cameras of a dataset",
         add_render},
        {"eval", "Measures PSNR and SSIM of a splat scene against images", add_eval},
        {"grad", "Writes the gradient of the training loss for one view", add_grad},
        {"convert", "Converts, joins and edits splat files", add_convert},
        {"info", "Shows what a splat file or a dataset holds, and what rendering skips", add_info},
        {"devices", "Lists the Vulkan devices of this machine", add_devices},
        {"doctor", "Shows what works on this machine, and how to get the rest", add_doctor},
        {"dataset", "Renders a mesh scene (glTF) into a dataset to train on", add_dataset},
        {"cameras", "Finds the cameras of photos or of a video, with COLMAP", add_cameras},
        {"bench", "Measures the speed of each pass, and its error against the CPU reference", add_bench},
        {"mesh", "Makes a mesh of the surfaces in a splat scene", add_mesh},
        {"compare", "Compares two images, folders of images, or splat scenes", add_compare},
    };
    std::vector<Command> commands;
    for (const auto& row : rows) {
        CLI::App* command = app.add_subcommand(row.name, row.description);
        commands.push_back({row.name, command, row.add(*command)});
        options::arrange_help(*command);
    }
    return commands;
}

int run_program(int argc, char** argv) {
    std::vector<std::string> words = usual_arguments(argc, argv);
    std::vector<char*> pointers;
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    return run_arguments(int(words.size()), pointers.data());
}

}  // namespace ewa::cli
