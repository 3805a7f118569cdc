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
    bool decides_result;  // false: it only affects when files are written, the device, or memory
    std::vector<std::string> choices = {};  // the allowed values; empty: not a fixed list

    std::function<nlohmann::ordered_json(const RunOptions&)> get = {};
    /// Sets the option from its text on the command line. Throws InputError, whose message does not name the option.
    std::function<void(RunOptions&, const std::string&)> set = {};
    bool& (*flag)(RunOptions&) = nullptr;  // the member of a flag
    /// The value, as on the command line, for runs of versions of ewa without the option. Empty: every version has it.
    std::string before = {};
    /// The heading in the help. Empty: an advanced option, which the help does not show.
    std::string subject = {};
    std::string brief = {};   // in the short help; empty: only the whole help has the option
    std::string python = {};  // the argument of ewa.Trainer; empty: it has none
};

}  // namespace ewa::train
