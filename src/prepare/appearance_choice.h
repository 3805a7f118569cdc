// SPDX-License-Identifier: Apache-2.0
// The exposures of training images, estimated before training: from the images' colours at the dataset's points, or from EXIF.
#pragma once
#include <string>
#include <vector>

#include "ewa/appearance.h"
#include "ewa/dataset.h"
#include "ewa/train_options.h"

namespace ewa::train {

/// How much images differ in the colours of the points that they show, minus the difference that is expected by chance.
struct Disagreement {
    int images = 0;       // number of compared images; 0: neither points nor EXIF
    double exposure = 0;  // root mean square over the images, stops of the stored values
    double color = 0;     // the same for red and blue relative to green
    bool by_exif = false;
};

/// Compares each image with the colours of the dataset's points. An image's value is the median over the points that it shows;
/// a point behind others does not count. Without points, EXIF's time, f-number and ISO count. frames: indices into
/// dataset.frames; at most 64 of them are compared. Throws InputError (an image that cannot be read).
Disagreement disagreement_of(const Dataset& dataset, const std::vector<int>& frames);

/// The frames whose images disagreement_of reads.
std::vector<int> compared_frames(const std::vector<int>& frames);

/// The first exposures of PPISP: for each frame, its image's exposure in stops of the stored values, relative to the mean. 0 where
/// neither points nor EXIF give it. Throws as disagreement_of.
std::vector<float> first_exposures(const Dataset& dataset, const std::vector<int>& frames);

struct AppearanceChoice {
    AppearanceModel model = AppearanceModel::none;
    std::string reason;  // with figures, for the user
};
/// The model that replaces AppearanceModel::automatic in these options.
AppearanceChoice choose_appearance(const TrainOptions& options, const Dataset& dataset,
                                   const std::vector<int>& frames);

}  // namespace ewa::train
