// SPDX-License-Identifier: Apache-2.0
// --robust: a short training on small images, the scout, finds what single training images show and the others do not. The run then
// masks these objects.
#pragma once
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ewa/device.h"
#include "ewa/run_observer.h"
#include "report/views.h"
#include "run/run_input.h"

namespace ewa::train {

/// A mask for each training frame, as passers_by makes them.
using Masks = std::vector<Image>;

/// Sets the masks of the training frames: `known`, or the masks that the scout finds. If the observer stops the scout, no frame
/// gets a mask. Collective. known: rank 0's masks from an earlier part of the run. observer: null on ranks other than 0. Returns
/// how much is masked, for the user. Throws InputError (an image that cannot be read), RunError.
std::string leave_out_passers_by(const std::shared_ptr<gpu::Device>& device, RunInput& input,
                                 const std::optional<Masks>& known, RunObserver* observer);

/// A text for the checkpoint that differs if a mask differs.
std::string fingerprint_of(const Masks& masks);
/// The frames' masks.
Masks masks_of(const RunInput& input);

/// The file of a training frame's mask below the run's folder. A frame without a mask has none.
std::vector<std::filesystem::path> mask_files(const RunInput& input);
/// Writes the masks, and removes those of an earlier run. Throws RunError.
void save_masks(const RunInput& input);
/// The masks that save_masks wrote. Throws InputError (a mask that cannot be read).
Masks saved_masks(const RunInput& input);

/// The views with the largest masks, for the report. Throws InputError.
std::vector<report::LeftOutView> left_out_views(const RunInput& input);

}  // namespace ewa::train
