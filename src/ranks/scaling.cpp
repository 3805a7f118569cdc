// SPDX-License-Identifier: Apache-2.0
#include "ranks/scaling.h"

#include <algorithm>
#include <cmath>

namespace ewa::ranks {
namespace {

// Of a visible splat of a view that another rank draws.
constexpr double kOutBytes = 48;                       // its record
constexpr double kBackBytes = 36, kBackAbsolute = 44;  // the sums of its gradients
// Of a step: its begin, the sizes of the lists, the losses, and the counts of the update.
constexpr double kGathers = 4;

/// Between two sizes that were measured, time grows evenly. Beyond the last it grows as before it.
double transfer_ms(const Network& network, double bytes) {
    Transfer low{0, network.gather_ms}, high = low;
    for (const Transfer& next : network.transfers) {
        low = high, high = next;
        if (double(next.bytes) >= bytes) break;
    }
    if (high.bytes == low.bytes) return high.milliseconds;
    const double slope = (high.milliseconds - low.milliseconds) / double(high.bytes - low.bytes);
    return low.milliseconds + std::max(0.0, slope) * (bytes - double(low.bytes));
}

/// The expected time of the slowest of `count` views that are drawn at random.
double slowest_ms(const ViewCost& view, int count) {
    std::vector<double> sorted = view.views;
    std::sort(sorted.begin(), sorted.end());
    double expected = sorted.empty() ? view.milliseconds : 0;
    for (size_t i = 0; i < sorted.size(); ++i) {
        // That none of them is slower, less that all are faster.
        const double share = std::pow(double(i + 1) / double(sorted.size()), count) -
                             std::pow(double(i) / double(sorted.size()), count);
        expected += share * sorted[i];
    }
    return expected;
}

}  // namespace

StepCost predict_step(const ViewCost& view, const Network& network, int ranks) {
    StepCost cost{.ranks = ranks};
    if (ranks > 1) {
        const double back = view.absolute_gradients ? kBackAbsolute : kBackBytes;
        // A rank keeps what it needs of its own splats.
        const double away = view.splats * view.visible * (ranks - 1) / ranks;
        // Each further rank costs one message more.
        const double message_ms = network.gather_ms / std::max(1, network.ranks - 1);
        const double messages_ms = (ranks - network.ranks) * message_ms;
        const auto exchange_ms = [&](double bytes) {
            return std::max(message_ms, transfer_ms(network, bytes) + messages_ms);
        };
        cost.sent_bytes = away * (kOutBytes + back);
        cost.exchange_ms =
            exchange_ms(away * kOutBytes) + exchange_ms(away * back) + kGathers * (ranks - 1) * message_ms;
    }
    cost.slowest_ms = slowest_ms(view, ranks);
    cost.step_ms = cost.slowest_ms + cost.exchange_ms;
    cost.views_per_second = ranks * 1000 / cost.step_ms;
    cost.efficiency = view.milliseconds / cost.step_ms;
    return cost;
}

}  // namespace ewa::ranks
