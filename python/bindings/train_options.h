// SPDX-License-Identifier: Apache-2.0
// The options of ewa.Trainer: the members of TrainOptions under their names.
#pragma once
#include <nanobind/nanobind.h>

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "ewa/train_options.h"

namespace ewa::python {

/// What ewa train has without options: strategy and SH degree are automatic.
TrainOptions usual_options();

/// Sets a member. Throws TypeError for an unknown name, with a suggestion, or another type. Throws InputError for a value out of its range.
void set_option(TrainOptions& options, const std::string& name, nanobind::handle value);

/// ", *, steps: int = 30000, ...": the options as parameters in a signature.
std::string option_parameters();

/// All options under their names.
nanobind::dict options_dict(const TrainOptions& options);

nlohmann::ordered_json options_json(const TrainOptions& options);
/// Throws InputError if a value is missing or no value of its option.
void read_options(const nlohmann::ordered_json& json, TrainOptions& options);

}  // namespace ewa::python
