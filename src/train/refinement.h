// SPDX-License-Identifier: Apache-2.0
// Adds, moves and removes splats after a step, if the schedule says so.
#pragma once
#include <functional>
#include <vector>

#include "pipeline/strategy.h"
#include "train/training_parts.h"

namespace ewa::train {

/// A ball around the centres of all training cameras, in world units.
struct CameraBall {
    glm::dvec3 middle{0};
    double radius = 0;
};

class Refinement {
  public:
    Refinement(TrainingParts& parts, const Dataset& dataset, const std::vector<int>& frames);

    /// Does what the schedule asks for after this step. Collective.
    void after(int step);

  private:
    void control_density(int step);
    /// Removes splats down to final_splats.
    void prune(int step);
    void keep_frozen(std::vector<std::vector<float>>& weights);
    /// Runs a refinement. refine: changes the numbers of splats in the portions.
    void run(const std::function<void(const pipeline::Phase&)>& refine);

    TrainingParts& parts_;
    CameraBall cameras_;
};

}  // namespace ewa::train
