// SPDX-License-Identifier: Apache-2.0
#include "cli/camera_groups.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <map>
#include <tuple>

#include "scene/readout.h"

namespace ewa::cli {

LensName lens_name(const Distortion& lens) {
    if (lens.none()) return {"pinhole", "a pinhole"};
    switch (lens.lens) {
        case Lens::brown:
            return {"opencv", "a lens with OpenCV's distortion"};
        case Lens::radial4:
            return {"radial4", "a lens with four radial terms"};
        case Lens::fisheye:
            return {"fisheye", "a fisheye"};
        case Lens::fisheye624:
            return {"fisheye624", "a fisheye with Project Aria's terms"};
        case Lens::fov:
            return {"fov", "a lens with the field-of-view model"};
        case Lens::division:
            return {"division", "a lens with the division model"};
        case Lens::unified:
            return {"eucm", "a lens with the unified model"};
        case Lens::equirectangular:
            return {"equirectangular", "360 degrees"};
        case Lens::orthographic:
            return {"orthographic", "parallel rays"};
    }
    return {"pinhole", "a pinhole"};
}

std::vector<CameraGroup> camera_groups(const Dataset& dataset) {
    std::map<std::tuple<int, int, double, double, double, double, std::string, bool>, CameraGroup> groups;
    for (const Frame& frame : dataset.frames) {
        const Camera& c = frame.camera;
        const bool distorted = !frame.distortion.none();
        const Distortion& lens = distorted ? frame.distortion : c.distortion;
        CameraGroup& group =
            groups[{c.width, c.height, c.fx, c.fy, c.cx, c.cy, lens_name(lens).word, distorted}];
        group.camera = c;
        group.lens = lens;
        group.distorted = distorted;
        ++group.frames;
    }
    std::vector<CameraGroup> list;
    for (const auto& [key, group] : groups) list.push_back(group);
    std::stable_sort(list.begin(), list.end(), [](auto& a, auto& b) { return a.frames > b.frames; });
    return list;
}

std::optional<Rolling> rolling_of(const Dataset& dataset) {
    Rolling rolling;
    std::vector<double> degrees, distances;
    for (const Frame& frame : dataset.frames) {
        if (!frame.camera.readout) continue;
        const scene::ReadoutMotion motion = scene::readout_motion(frame.camera);
        if (rolling.frames++ == 0)
            rolling.order = core::word_for(scene::kReadoutWords, frame.camera.readout->from);
        degrees.push_back(glm::degrees(glm::length(motion.turn)));
        distances.push_back(glm::length(motion.shift));
    }
    if (rolling.frames == 0) return std::nullopt;
    const auto median = [](std::vector<double>& values) {
        const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
        std::nth_element(values.begin(), middle, values.end());
        return *middle;
    };
    rolling.degrees = median(degrees);
    rolling.distance = median(distances);
    return rolling;
}

}  // namespace ewa::cli
