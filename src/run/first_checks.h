// SPDX-License-Identifier: Apache-2.0
// Problems that make a training useless, or stop it at its end. They are found before its first step, and by ewa info.
#pragma once
#include <functional>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "ewa/dataset.h"

namespace ewa::train {

struct Finding {
    std::string text;    // one line
    bool fatal = false;  // the training could not come to its end
};

/// Why no image is left to train on, and what leaves some. Empty if there are any.
std::string nothing_to_train_on(const Dataset& dataset, const Split& split);

/// Damaged images, and masks that leave no pixel. decode: reads every held-out image, as the evaluation does; else only those
/// whose file does not end as an image.
std::vector<Finding> check_images(const Dataset& dataset, const Split& split, bool decode);

/// Where the first splats are.
struct FirstPlaces {
    size_t count = 0;
    std::function<glm::dvec3(size_t)> at;  // world
    std::string file = {};                 // that --init names; empty: the dataset's points
};

/// First splats that are too few, or that no camera of the frames sees.
std::vector<Finding> check_start(const Dataset& dataset, const std::vector<int>& frames,
                                 const FirstPlaces& places);

}  // namespace ewa::train
