// SPDX-License-Identifier: Apache-2.0
// The options of ewa.Trainer: those rows of a run's options that have a name in Python.
#pragma once
#include <nanobind/nanobind.h>

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "ewa/run_options.h"

namespace ewa::python {

/// Throws TypeError for an unknown name, with a suggestion, or another type. Throws InputError for a value out of its range.
void set_option(RunOptions& options, const std::string& name, nanobind::handle value);

/// ", *, steps: int = 30000, ...": the options as parameters in a signature.
std::string option_parameters();

/// The arguments whose names are not those of the command line, under the names there.
nanobind::dict argument_names();

/// The usual options, but without an appearance, since ewa.evaluate can apply none.
RunOptions usual_options();

/// The words that are values of options of the command line.
nanobind::set value_words();

/// All options under their names.
nanobind::dict options_dict(const RunOptions& options);

nlohmann::ordered_json options_json(const RunOptions& options);
/// Throws InputError if a value is missing or no value of its option. Options that checkpoints of earlier versions lack
/// get the value that those had.
void read_options(const nlohmann::ordered_json& json, RunOptions& options);

}  // namespace ewa::python
