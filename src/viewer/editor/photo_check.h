// SPDX-License-Identifier: Apache-2.0
// The splats that the photos of the opened run contradict, for the editor.
#pragma once
#include <memory>

#include "edit/filters.h"
#include "viewer/editor/edit_snapshot.h"
#include "viewer/opening.h"

namespace ewa::viewer {

/// Cameras::contradicted of the scene; empty if its run has no photos. It opens a device of its own for each comparison, and remembers
/// the last result. It throws InputError without a text once `comparing` is stopped.
decltype(edit::Cameras::contradicted) contradicted_by_photos(const OpenedScene& scene, const OpenDevice& open,
                                                             const std::shared_ptr<Comparing>& comparing);

}  // namespace ewa::viewer
