// SPDX-License-Identifier: Apache-2.0
// Films that a command line asks for, and screenshots where no window can be opened.
#pragma once
#include "viewer/view_state.h"

namespace ewa::viewer {

/// Writes the screenshot or the film that the command line asks for, as the window would. Throws InputError for
/// --compare, which the window alone shows, and RunError.
void write_without_window(const Startup& startup);

}  // namespace ewa::viewer
