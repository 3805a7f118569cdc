// SPDX-License-Identifier: Apache-2.0
// Where the camera of the window is, and the places that it returns to. Independent of the window.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "io/datasets/view_list.h"
#include "viewer/byte_image.h"
#include "viewer/view_camera.h"

namespace ewa::viewer {

/// A film that is being written: frames along the path through saved views, one file each.
struct Film {
    static constexpr int kRate = 30;  // frames per second

    std::filesystem::path folder;
    std::vector<Camera> keys;  // at least one
    Size size;                 // of every frame, also if the window changes
    int frames = 0, next = 0;
    uint64_t waits_for = 0;  // serial of the frame that is being written; 0: none

    /// The keys are kRate * seconds frames apart; the first and last key are frames.
    Film(const std::vector<io::NamedView>& views, const std::filesystem::path& folder, Size size,
         double seconds);
    bool finished() const { return next >= frames; }
    Camera camera() const;
    std::filesystem::path file() const;
};

struct Navigation {
    ViewCamera view;
    std::vector<io::NamedView> views{};   // saved under a number, which is the name
    std::optional<int> at_camera{};       // the frame of the dataset whose camera the view is at
    std::optional<int> start_frame{};     // the frame that reset() returns to
    std::optional<int> pointed_camera{};  // the frame whose camera is under the pointer
    double camera_size = 1;               // of a drawn camera, world units
    bool framed = false;                  // the first view was chosen when there were splats
    std::optional<Film> film{};

    void leave_camera() { at_camera.reset(); }
    void reset();
    /// Moves to this camera, and keeps what is up.
    void go_to(const Camera& camera, const glm::dvec3& pivot);
    std::vector<io::NamedView>::iterator find(size_t number);
};

}  // namespace ewa::viewer
