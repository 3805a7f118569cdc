// SPDX-License-Identifier: Apache-2.0
// The options of a training run under their names: the one table behind the command line, config.json and the
// settings in a checkpoint.
#pragma once
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "ewa/run_options.h"

namespace ewa::train {

struct RunOption {
    std::string name;   // the key in config.json, and --name on the command line
    std::string value;  // how the help shows the value, e.g. "N"; empty: a flag
    std::string help;
    bool decides_result;  // else it decides only when files are written, where it runs, or memory
    std::vector<std::string> choices = {};  // the values there are; empty: many

    std::function<nlohmann::ordered_json(const RunOptions&)> get = {};
    /// From the text on the command line. Throws InputError, which does not name the option.
    std::function<void(RunOptions&, const std::string&)> set = {};
    bool& (*flag)(RunOptions&) = nullptr;  // the member of a flag
    /// The value of runs from before the option existed, as on the command line. Empty: it has always existed.
    std::string before = {};
    std::string subject =
        {};  // the heading in the help; empty: an advanced option, which the help does not show
    std::string python = {};  // the argument of ewa.Trainer; empty: it has none
};

/// In the order of config.json.
const std::vector<RunOption>& run_options();
/// The option with this name, which must exist.
const RunOption& run_option(std::string_view name);

/// The value as the command line takes it.
std::string value_text(const RunOption& option, const RunOptions& options);

/// Whether files list the option: an advanced one only if its value is not the usual one.
bool is_listed(const RunOption& option, const RunOptions& options);
/// The options that are listed, under their names: what config.json holds.
nlohmann::ordered_json to_config(const RunOptions& options);

/// "none", "adc", "mcmc" or "auto".
std::string name_of(Strategy strategy);

}  // namespace ewa::train
