// SPDX-License-Identifier: Apache-2.0
// What the window knows of the scene that is edited.
#pragma once
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "edit/history.h"
#include "viewer/render_thread.h"

namespace ewa::viewer {

/// A comparison with photos, which the thread of the editor does for the selection `contradicted`.
struct Comparing {
    std::atomic<size_t> photo = 0, photos = 0;  // photo: from 1 on; 0: there is no comparison
    std::atomic<uint64_t> task = 0,
                          cancelled =
                              0;  // numbers of the editor's tasks: in progress, and the last that is to end
    bool stopped() const { return task <= cancelled; }
};

/// What the window shows of a scene after the last finished edit. It never changes.
struct EditSnapshot {
    uint64_t scene = 0;  // EditedScene::id
    std::shared_ptr<const Gaussians> splats;
    std::shared_ptr<const std::vector<uint8_t>> states;
    edit::Cameras cameras;  // of the splats' run, while no splat has moved
    size_t left = 0, selected = 0, locked = 0, hidden = 0;
    /// The bounds of the selection, and of all splats that can be selected: the lowest and the highest corner, world.
    std::optional<std::array<glm::dvec3, 2>> bounds, bounds_of_all;
    /// The mean of the means of what a move changes: the selection, or all that can be selected.
    glm::dvec3 middle{0};
    std::vector<edit::Step> steps;
    size_t done = 0;
    uint64_t version = 0, values_version = 0, history_bytes = 0;
    double milliseconds = 0;                            // of the last edit
    std::shared_ptr<const Gaussians> drawn;             // the splats of all scenes that are shown, joined
    std::shared_ptr<const std::vector<uint8_t>> marks;  // ewa::Mark bits of these
    Draft draft;  // of these; without splats if there are no more than the budget
};

}  // namespace ewa::viewer
