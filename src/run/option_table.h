// SPDX-License-Identifier: Apache-2.0
// The options of a training run under their names: the one table behind the command line, config.json and the
// settings in a checkpoint.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "core/words.h"
#include "run/run_option.h"

namespace ewa::train {

/// All options of a training run, in the order of config.json.
const std::vector<RunOption>& run_options();
/// The option with this name, which must exist.
const RunOption& run_option(std::string_view name);

/// The option's value in these options, as the command line takes it.
std::string value_text(const RunOption& option, const RunOptions& options);

/// Whether files list the option: an advanced one only if its value is not the usual one.
bool is_listed(const RunOption& option, const RunOptions& options);
/// The contents of config.json: the listed options with their values, by name.
nlohmann::ordered_json to_config(const RunOptions& options);

/// The steps that --quality stands for.
inline const core::Words<int> kQualities{{"low", 2000}, {"medium", 7000}, {"high", 30000}};

/// "none", "adc", "mcmc" or "auto".
std::string name_of(Strategy strategy);

}  // namespace ewa::train
