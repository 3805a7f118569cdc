// SPDX-License-Identifier: Apache-2.0
// The rows of the table that are no options of training runs alone, and no edits.
#pragma once
#include <vector>

#include "options/option.h"

namespace ewa::options {

/// A row without a help is an option of a training run that other commands have, too. It names these.
std::vector<Option> rows();

}  // namespace ewa::options
