// SPDX-License-Identifier: Apache-2.0
// ewa: reads the arguments, runs one command, and turns every failure into one line and an exit status.
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <new>

#include "cli/command.h"
#include "cli/help_formatter.h"
#include "cli/interrupt.h"
#include "cli/manual.h"
#include "cli/text.h"
#include "core/text.h"
#include "ewa/error.h"

namespace {

using namespace ewa;
using namespace ewa::cli;

enum ExitStatus { kDone = 0, kFailed = 1, kWrongUse = 2 };

struct Command {
    CLI::App* app;
    Action action;
};

int fail(const std::string& who, const std::string& what, int status) {
    std::fflush(stdout);
    std::fprintf(stderr, "%s: %s\n", who.c_str(), core::one_line(what).c_str());
    return status;
}

int run(const Command& command) {
    const std::string who = "ewa " + command.app->get_name();
    try {
        leave_nothing_when_ended();
        const int status = command.action();
        // A full disk behind a redirected output shows up only here.
        if (std::fflush(stdout) != 0)
            return fail(who, std::string("cannot write to standard output: ") + std::strerror(errno),
                        kFailed);
        if (std::ferror(stdout)) return fail(who, "could not write all to standard output", kFailed);
        return status;
    } catch (const InputError& error) {
        return fail(who, error.what(), kWrongUse);
    } catch (const CLI::Error& error) {  // a value of --config that its option refuses
        return fail(who, error.what(), kWrongUse);
    } catch (const RunError& error) {
        return fail(who, error.what(), kFailed);
    } catch (const std::bad_alloc&) {
        return fail(who, "out of host memory; --downscale or a smaller scene needs less", kFailed);
    } catch (const std::exception& error) {
        return fail(who, std::string("unexpected failure: ") + error.what(), kFailed);
    }
}

std::string command_line(int argc, char** argv) {
    std::string line = "ewa";
    for (int i = 1; i < argc; ++i) line += " " + shell_quoted(argv[i]);
    return line;
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App app{
        "Trains, renders and inspects 3D Gaussian splats on any Vulkan device, a plain CPU included."};
    app.name("ewa");
    app.set_version_flag("--version", "ewa " EWA_VERSION);
    app.require_subcommand(1);
    app.formatter(std::make_shared<HelpFormatter>());  // of the commands too

    // Without a group it stands in no help: the build calls it.
    CLI::App* manual =
        app.add_subcommand("manual", "Writes the manual pages and shell completions below DIR");
    std::string manual_folder;
    manual->group("");
    manual->add_option("DIR", manual_folder)->required();
    Command commands[] = {
        {app.add_subcommand("train", "Trains splats on images with cameras"), {}},
        {app.add_subcommand("render", "Renders a splat scene through a dataset's cameras"), {}},
        {app.add_subcommand("eval", "PSNR and SSIM of a splat scene against a dataset's images"), {}},
        {app.add_subcommand("grad", "Gradient of the training loss for one view"), {}},
        {app.add_subcommand("convert", "Converts, joins and edits splat files"), {}},
        {app.add_subcommand("info", "What a splat file or a dataset holds, and what rendering it can skip"),
         {}},
        {app.add_subcommand("devices", "The Vulkan devices of this machine"), {}},
        {app.add_subcommand("dataset", "Renders a mesh scene (glTF) into a dataset to train on"), {}},
        {app.add_subcommand("bench", "Speed of every pass, and its error against the CPU reference"), {}},
        {app.add_subcommand("compare",
                            "PSNR, SSIM and largest error of two images, folders of them, or splat scenes"),
         {}},
    };
    const Command write_pages{manual, [&] {
                                  write_manual(app, manual_folder);
                                  return 0;
                              }};
    commands[0].action = add_train(*commands[0].app, command_line(argc, argv));
    commands[1].action = add_render(*commands[1].app);
    commands[2].action = add_eval(*commands[2].app);
    commands[3].action = add_grad(*commands[3].app);
    commands[4].action = add_convert(*commands[4].app);
    commands[5].action = add_info(*commands[5].app);
    commands[6].action = add_devices(*commands[6].app);
    commands[7].action = add_dataset(*commands[7].app);
    commands[8].action = add_bench(*commands[8].app);
    commands[9].action = add_compare(*commands[9].app);

    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) return app.exit(error);
        std::string who = "ewa";
        for (const Command& command : commands)
            if (command.app->parsed()) who += " " + command.app->get_name();
        std::string what = error.what();
        // CLI11 asks for a sub-command without a word on the one it does not know.
        if (who == "ewa" && argc > 1 && argv[1][0] != '-')
            what = "there is no command " + shell_quoted(argv[1]);
        return fail(who, what + " (see " + who + " --help)", kWrongUse);
    }
    for (const Command& command : commands)
        if (command.app->parsed()) return run(command);
    return run(write_pages);
}
