// SPDX-License-Identifier: Apache-2.0
// The cameras of all frames after a training that refined those of the training images.
#pragma once
#include <functional>
#include <memory>
#include <vector>

#include "ewa/camera_motion.h"
#include "ewa/dataset.h"
#include "ewa/device.h"
#include "ewa/summary.h"
#include "ewa/trainer.h"

namespace ewa::train {

/// A similarity of the world: x becomes scale * rotation * x + shift.
struct Similarity {
    double scale = 1;
    glm::dmat3 rotation{1.0};
    glm::dvec3 shift{0.0};
    glm::dvec3 operator()(const glm::dvec3& x) const { return scale * (rotation * x) + shift; }
};

/// The similarity that maps the cameras `from` to the same cameras in `to` with the least error. Umeyama (1991) gives it for the
/// cameras' centres. The rotation also uses the cameras' axes, so it is defined even if all centres coincide.
Similarity similarity_between(const std::vector<Camera>& from, const std::vector<Camera>& to);
Camera transformed(const Camera& camera, const Similarity& similarity);

/// The cameras after a training.
struct RefinedCameras {
    std::vector<Camera> cameras;  // of all frames
    Similarity world;             // from the dataset's world to that of the splats
};
/// Applies the learned motions to the training cameras. All other cameras get the similarity from the given training cameras to the
/// moved ones. motions: one for each of the frames `train`.
RefinedCameras refined_cameras(const Dataset& dataset, const std::vector<int>& train,
                               const std::vector<CameraMotion>& motions);

/// Aligns these frames' cameras to their images with fixed splats, by the gradient of the training's loss. Returns the motions.
/// extent: Trainer::extent. before_frame: called before each frame; an exception from it ends the work. Throws InputError (an image
/// that cannot be read), RunError (device).
std::vector<CameraMotion> align_cameras(const std::shared_ptr<gpu::Device>& device,
                                        const Gaussians& gaussians, const Dataset& dataset,
                                        const std::vector<int>& frames, const TrainOptions& options,
                                        double extent, const std::function<void()>& before_frame);

/// How far training has moved the cameras of these frames. given: the cameras of all frames before training.
CameraMoves moves_of(const Dataset& dataset, const std::vector<int>& frames, const std::vector<Camera>& given,
                     double extent);

}  // namespace ewa::train
