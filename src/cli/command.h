// SPDX-License-Identifier: Apache-2.0
// The commands of ewa, one file each.
#pragma once
#include <functional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace ewa::cli {

/// Runs a command after its options are parsed. Returns the exit status; InputError gives 2, any other
/// exception 1.
using Action = std::function<int()>;

/// Each function adds the options of its command to `app`, and returns the command's action.
Action add_train(CLI::App& app, const std::string& command_line);
Action add_render(CLI::App& app);
Action add_eval(CLI::App& app);
Action add_grad(CLI::App& app);
Action add_convert(CLI::App& app);
Action add_info(CLI::App& app);
Action add_dataset(CLI::App& app);
Action add_cameras(CLI::App& app);
Action add_devices(CLI::App& app);
Action add_doctor(CLI::App& app);
Action add_bench(CLI::App& app);
Action add_compare(CLI::App& app);
Action add_mesh(CLI::App& app);

struct Command {
    std::string name;
    CLI::App* app;  // its parser
    Action action;
};

/// Adds all commands to the parser of `ewa`. command_line: what was typed.
std::vector<Command> add_commands(CLI::App& app, const std::string& command_line);

}  // namespace ewa::cli
