// SPDX-License-Identifier: Apache-2.0
// Ctrl-C and other requests to end. Long work checks for them between its steps.
#pragma once
#include <string>
#include <vector>

#include "platform/signals.h"

namespace ewa::cli {

/// While a watch exists, requests to end (platform/signals.h) only set a flag, however often they arrive; SIGHUP does nothing where
/// nohup ignores it. timeout(1) signals the program and then its group, and a second Ctrl-C must not prevent what
/// the first one saves. SIGQUIT (Ctrl-\ on a terminal) and SIGKILL still end the program at once.
/// The destructor restores the handlers. At most one watch exists at a time.
class InterruptWatch {
  public:
    InterruptWatch();

  private:
    platform::HandledRequests handled_;
};

/// Whether a signal has arrived during a watch.
bool interrupted();

/// Thrown when a signal ended work that a command needs. The exit status is then kInterruptedStatus.
struct Interrupted {};

/// Sets handlers for the signals of InterruptWatch. While no watch exists, a signal deletes the temporary files, then ends
/// the program. Ignored signals stay ignored. A write beyond the limit of a file's size fails, as on a full disk.
void remove_temporary_files_on_signals();

/// For work that saves nothing: the signals of a watch delete the temporary files and end the program at once, with
/// kInterruptedStatus.
void end_on_signals();

/// Runs a program with this process's standard output and error, and an empty standard input. The signals of a watch go to the
/// program. Returns its exit status, or 128 and the number of the signal that ended it. Throws RunError if it cannot be
/// started.
/// command: the path of the program, then its arguments.
int run_in_front(const std::vector<std::string>& command);

/// The exit status after Ctrl-C.
inline constexpr int kInterruptedStatus = 130;

}  // namespace ewa::cli
