// SPDX-License-Identifier: Apache-2.0
// A row of the table of a run's options.
#pragma once
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
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
    /// The heading in the help. Empty: an advanced option, which the help does not show.
    std::string subject = {};
    std::string brief = {};   // in the short help; empty: only the whole help has the option
    std::string python = {};  // the argument of ewa.Trainer; empty: it has none
};

}  // namespace ewa::train
