// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace ewa::cli {

/// Parses the arguments of `ewa`, runs one command, and turns an error into one line on standard error. Returns the exit status:
/// 0 done, 1 failed, 2 wrong use.
int run_program(int argc, char** argv);

}  // namespace ewa::cli
