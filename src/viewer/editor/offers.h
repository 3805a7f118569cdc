// SPDX-License-Identifier: Apache-2.0
// What the window offers over the picture: a training, once the cameras of photos or of a video are found.
#pragma once
#include <array>
#include <optional>
#include <string>

#include "viewer/layout.h"
#include "viewer/opening.h"

namespace ewa::viewer {

/// What the window offers, in the order of train::kQualities.
inline constexpr std::array kQualityNames{"Quick look", "Good", "Best"};

/// The time that a training of the scene's dataset usually takes: "about 5 min". Empty where it is not known. on_cpu: whether the
/// device is a CPU; empty: not known.
std::string usual_time_text(const OpenedScene& scene, std::optional<bool> on_cpu, int steps);

/// Draws a card in the area (px of the window). Returns the steps of the chosen training, or 0 for "Not now".
std::optional<int> draw_training_offer(const OpenedScene& scene, std::optional<bool> on_cpu,
                                       const Rectangle& area);

}  // namespace ewa::viewer
