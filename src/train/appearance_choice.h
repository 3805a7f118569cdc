// SPDX-License-Identifier: Apache-2.0
// Whether the training images disagree so far that their appearance is to be learned.
#pragma once
#include <string>
#include <vector>

#include "ewa/appearance.h"
#include "ewa/dataset.h"

namespace ewa::train {

/// How far images disagree on the colours of the points that they show.
struct Disagreement {
    int images = 0;       // that were compared; 0: there are no points
    double exposure = 0;  // root mean square over the images, stops
    double color = 0;     // the same of red and blue against green
};

/// Compares each image with the colours of the dataset's points. An image's value is the median over the points in its
/// frustum, so the few that are hidden do not count. frames: indices into dataset.frames; at most 64 of them are read.
/// Throws InputError (an image that cannot be read).
Disagreement disagreement_of(const Dataset& dataset, const std::vector<int>& frames);

struct AppearanceChoice {
    AppearanceModel model = AppearanceModel::none;
    std::string reason;  // with figures, for the user
};
/// The model that AppearanceModel::automatic stands for.
AppearanceChoice choose_appearance(const Disagreement& found);

}  // namespace ewa::train
