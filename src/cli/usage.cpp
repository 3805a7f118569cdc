// SPDX-License-Identifier: Apache-2.0
#include "cli/usage.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <string_view>
#include <vector>

#include "core/typing.h"
#include "options/command_options.h"

namespace ewa::cli {
namespace {

std::vector<std::string> command_names(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
    return names;
}

/// CLI11 says "--steps: 1 required N missing", and "FILES: At least 2 required but received 1".
std::string missing_value(const std::string& text) {
    const std::string few = ": At least ", received = " required but received ";
    if (const size_t at = text.find(few), given = text.find(received); at < given && given < text.size())
        return text.substr(0, at) + ": at least " + text.substr(at + few.size(), given - at - few.size()) +
               " are needed, and there is only " + text.substr(given + received.size());
    const size_t colon = text.find(": "), required = text.find(" required "), end = text.rfind(" missing");
    if (colon == std::string::npos || required == std::string::npos || end == std::string::npos ||
        end < required)
        return text;
    constexpr size_t kRequired = 10;
    return text.substr(0, colon) +
           " needs a value: " + text.substr(required + kRequired, end - required - kRequired);
}

/// Where -o was forgotten: what one would type.
std::string output_hint(const CLI::App& command, const std::vector<std::string>& unknown) {
    const CLI::Option* output = command.get_option_no_throw("--output");
    return output && output->count() == 0 && unknown.size() == 1 ? "; -o " + unknown[0] + " names the output"
                                                                 : std::string();
}

}  // namespace

std::string usage_error(const CLI::App& app, const CLI::App& command, const CLI::Error& error, int argc,
                        char** argv) {
    const std::vector<std::string> unknown = app.remaining(true);
    const bool options = std::any_of(unknown.begin(), unknown.end(),
                                     [](const std::string& word) { return word.starts_with('-'); });
    const std::vector<std::string> commands = command_names(app);
    if (&app == &command && argc > 1 && argv[1][0] != '-') {
        const std::string text = std::string("unknown command '") + argv[1] + "'";
        for (const char* window : {"view", "viewer", "gui", "ui", "window", "open", "show"})
            if (argv[1] == std::string_view(window))
                return text + "; the window is the program ewa-view" +
                       (argc > 2 ? ": ewa-view " + std::string(argv[2]) : "");
        return text + core::did_you_mean(argv[1], commands);
    }
    if (options || dynamic_cast<const CLI::ExtrasError*>(&error))
        return core::unexpected_arguments(argc, argv, unknown, options::option_names(command)) +
               (options ? std::string() : output_hint(command, unknown));
    if (&app == &command && error.get_name() == "RequiredError") {
        std::string all;
        for (const std::string& name : commands) all += (all.empty() ? "" : ", ") + name;
        return "a subcommand is required: " + all;
    }
    if (error.get_name() == "ArgumentMismatch") return missing_value(error.what());
    return error.what();
}

}  // namespace ewa::cli
