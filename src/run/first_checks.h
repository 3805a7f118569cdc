// SPDX-License-Identifier: Apache-2.0
// Problems that make a training useless, or stop it at its end. A run and `ewa info` find them before the first step.
#pragma once
#include <functional>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "ewa/dataset.h"

namespace ewa::train {

struct Finding {
    std::string text;    // one line
    bool fatal = false;  // the training would fail before its end
};

/// A text on why no training image is left, and how to keep some. Empty if there are training images.
std::string nothing_to_train_on(const Dataset& dataset, const Split& split);

/// Finds damaged images, and masks that leave no pixel. decode: decodes every held-out image, as the evaluation does. Without it,
/// only files that do not end as an image are decoded.
std::vector<Finding> check_images(const Dataset& dataset, const Split& split, bool decode);

/// The positions of the first splats.
struct FirstPlaces {
    size_t count = 0;
    std::function<glm::dvec3(size_t)> at;  // world
    std::string file = {};  // the file that --init names; empty: the positions are the dataset's points
};

/// Findings on the first splats: they are too few, or no camera of the frames sees them.
std::vector<Finding> check_start(const Dataset& dataset, const std::vector<int>& frames,
                                 const FirstPlaces& places);

}  // namespace ewa::train
