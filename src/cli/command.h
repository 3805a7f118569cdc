// SPDX-License-Identifier: Apache-2.0
// The commands of the program, one file each.
#pragma once
#include <functional>
#include <string>

namespace CLI {
class App;
}

namespace ewa::cli {

/// What a command does once its options are read; returns the exit status. InputError ends with 2, anything
/// else thrown with 1.
using Action = std::function<int()>;

/// Each adds its options to its own sub-command.
Action add_train(CLI::App& app, const std::string& command_line);
Action add_render(CLI::App& app);
Action add_eval(CLI::App& app);
Action add_grad(CLI::App& app);
Action add_convert(CLI::App& app);
Action add_info(CLI::App& app);
Action add_dataset(CLI::App& app);
Action add_devices(CLI::App& app);
Action add_bench(CLI::App& app);
Action add_compare(CLI::App& app);

}  // namespace ewa::cli
