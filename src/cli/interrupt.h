// SPDX-License-Identifier: Apache-2.0
// Ctrl-C and termination asked for politely: long work looks here between its steps.
#pragma once

namespace ewa::cli {

/// From now on the first SIGINT or SIGTERM is only noted; a second one ends the program at once.
void watch_for_interrupt();
bool interrupted();

/// What a program ended by Ctrl-C exits with.
inline constexpr int kInterruptedStatus = 130;

}  // namespace ewa::cli
