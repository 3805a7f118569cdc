// SPDX-License-Identifier: Apache-2.0
// The exit status of a command, and how it reports an error.
#pragma once
#include <string>

#include "cli/command.h"

namespace ewa::cli {

enum ExitStatus { kDone = 0, kFailed = 1, kWrongUse = 2 };

/// Prints "who: what" as one line to standard error, and returns status.
int fail(const std::string& who, const std::string& what, int status);
/// Prints the error of standard output that cannot be written, as fail() does. Returns the exit status.
int fail_to_print(const std::string& who);

/// Runs the action and prints its error, if it throws one. Returns its status, kInterruptedStatus after a signal, kWrongUse
/// for an InputError, and kFailed for any other exception or for output that cannot be written.
int status_of(const std::string& who, const Action& action);

}  // namespace ewa::cli
