// SPDX-License-Identifier: Apache-2.0
// What the schedule does after a step: splats are added, moved and removed.
#pragma once
#include <functional>
#include <vector>

#include "pipeline/strategy.h"
#include "train/training_parts.h"

namespace ewa::train {

/// A ball that has all cameras of the training in it, world units.
struct CameraBall {
    glm::dvec3 middle{0};
    double radius = 0;
};

class Refinement {
  public:
    Refinement(TrainingParts& parts, const Dataset& dataset, const std::vector<int>& frames);

    /// Collective.
    void after(int step);

  private:
    void control_density(int step);
    /// Removes splats down to final_splats.
    void prune(int step);
    /// refine: changes the numbers of the portions' splats.
    void run(const std::function<void(const pipeline::Phase&)>& refine);

    TrainingParts& parts_;
    CameraBall cameras_;
};

}  // namespace ewa::train
