// SPDX-License-Identifier: Apache-2.0
#include "run/run_cameras.h"

#include <algorithm>
#include <functional>
#include <utility>

#include "run/refined_cameras.h"

namespace ewa::train {

void RunCameras::use_refined(const Trainer& trainer) {
    extent_ = trainer.extent();
    auto [cameras, world] = refined_cameras(input_.dataset, input_.split.train, trainer.camera_motions());
    world_ = world;
    for (size_t i = 0; i < cameras.size(); ++i) std::swap(input_.dataset.frames[i].camera, cameras[i]);
    given_ = std::move(cameras);
}

void RunCameras::use_given() {
    for (size_t i = 0; i < given_.size(); ++i) input_.dataset.frames[i].camera = given_[i];
    given_.clear();
}

void RunCameras::align_test(const std::shared_ptr<gpu::Device>& device, const Gaussians& gaussians,
                            const std::function<void()>& before_frame) {
    const std::vector<int>& frames = input_.split.test;
    const auto motions =
        align_cameras(device, gaussians, input_.dataset, frames, input_.options.train, extent_, before_frame);
    for (size_t i = 0; i < frames.size(); ++i) {
        Camera& camera = input_.dataset.frames[size_t(frames[i])].camera;
        camera = moved(camera, motions[i]);
    }
}

CameraMoves RunCameras::moves() const {
    return moves_of(input_.dataset, input_.split.train, given_, extent_);
}

void RunCameras::save(const RunWriter& folder, bool aligned) const {
    folder.save_cameras(input_.dataset, input_.split, given_, world_, extent_, aligned);
}

std::vector<report::CameraRow> camera_rows(const Dataset& dataset) {
    std::vector<report::CameraRow> rows;
    const std::vector<CameraSupport> supports = camera_support(dataset);
    for (size_t i = 0; i < supports.size(); ++i)
        rows.push_back({.name = dataset.frames[i].name,
                        .points = supports[i].points,
                        .error = supports[i].error,
                        .together = neighbors_text(dataset, supports[i])});
    std::ranges::stable_sort(rows, std::greater<>(), &report::CameraRow::error);
    return rows;
}

}  // namespace ewa::train
