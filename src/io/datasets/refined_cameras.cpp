// SPDX-License-Identifier: Apache-2.0
#include "io/datasets/refined_cameras.h"

#include <map>
#include <nlohmann/json.hpp>

#include "core/json.h"
#include "core/text.h"
#include "ewa/error.h"
#include "io/datasets/view_list.h"
#include "scene/readout.h"

namespace ewa::io {

void write_refined_cameras(const std::filesystem::path& path, const std::vector<RefinedCamera>& cameras,
                           double extent) {
    nlohmann::ordered_json views = nlohmann::ordered_json::array();
    for (const RefinedCamera& refined : cameras) {
        nlohmann::ordered_json& view = views.emplace_back(camera_json(refined.name, refined.camera));
        view["split"] = refined.split;
        if (refined.split == "test") view["aligned"] = refined.aligned;
        view["degrees"] = refined.moved.degrees;
        view["moved"] = refined.moved.length;
        view["percent_of_extent"] = 100 * refined.moved.length / extent;
        view["focal_factor"] = refined.moved.focal;
    }
    core::write_json(path, {{"extent", extent}, {"views", views}});
}

RefinedUse use_refined_cameras(Dataset& dataset, const std::filesystem::path& path) {
    std::map<std::string, NamedView> cameras;
    for (const NamedView& view : read_views(path, kMostCameras)) cameras[view.name] = view;
    RefinedUse use;
    for (Frame& frame : dataset.frames) {
        const auto found = cameras.find(frame.name);
        if (found == cameras.end()) continue;
        use.used = true;
        use.aligned = use.aligned || found->second.aligned;
        const Camera& refined = found->second.camera;
        Camera& camera = frame.camera;
        if (scene::moves(camera) && !refined.readout)
            throw InputError(core::one_line(path.string()) + ": has no rolling shutter for frame \"" +
                             core::one_line(frame.name) +
                             "\", and the dataset has one; name the run that was trained on it");
        camera.rotation = refined.rotation;
        camera.translation = refined.translation;
        camera.readout = refined.readout;
        camera.fx = refined.fx * (double(camera.width) / refined.width);
        camera.fy = refined.fy * (double(camera.height) / refined.height);
    }
    if (!use.used && !dataset.frames.empty())
        throw InputError(core::one_line(path.string()) + ": has no camera of an image of " +
                         core::one_line(dataset.root.string()));
    return use;
}

}  // namespace ewa::io
