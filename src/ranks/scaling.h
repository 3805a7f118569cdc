// SPDX-License-Identifier: Apache-2.0
// What training on several ranks will cost, from the cost of one view and of the network (docs/scale.md).
#pragma once
#include <vector>

#include "ranks/network.h"

namespace ewa::ranks {

/// The work of a training step on one view.
struct ViewCost {
    double splats = 0;        // of the scene
    double visible = 0;       // share of them that reach a pixel, 0..1
    double milliseconds = 0;  // on one rank's device, alone; a mean over views
    bool absolute_gradients = false;
    std::vector<double> views{};  // ms of some views. Empty: all take as long
};

/// A step of as many views as ranks, one each.
struct StepCost {
    int ranks = 1;
    double sent_bytes = 0;  // by each rank, both ways
    double slowest_ms = 0;  // of the step's views, which the others wait for
    double exchange_ms = 0, step_ms = 0;
    double views_per_second = 0;
    double efficiency = 1;  // of the views per second of as many independent ranks
};

StepCost predict_step(const ViewCost& view, const Network& network, int ranks);

}  // namespace ewa::ranks
