// SPDX-License-Identifier: Apache-2.0
// The edits of splats that clients of a training send (POST /edit of live/server.h).
#pragma once
#include <string>
#include <vector>

#include "ewa/gaussians.h"
#include "ewa/trainer.h"

namespace ewa::cli {

/// Performs the edits of a body on a copy of the splats, and returns what that comes to in the training. frozen: Trainer::frozen;
/// these splats are locked at first. body: JSON {"edits": [[NAME, VALUE], ...]} with the names and values of edit::rows(). Only edits
/// that leave the other splats as they are can be made in a training. Throws InputError for any other, and for a text that is no such
/// JSON.
SplatEdit live_edit(const Gaussians& splats, const std::vector<bool>& frozen, const std::string& body);

}  // namespace ewa::cli
