// SPDX-License-Identifier: Apache-2.0
// Motions of the training cameras, learned beside the splats by the gradient of the loss.
//
// A rotation and a shift that compensate each other hardly change the image. Adam's step along each value would take very long to
// separate them. Each camera therefore has a basis in which a unit of every coordinate moves the image equally far (CamP, Park et
// al. 2023). Let J be the derivative of a point's direction in the image by the motion, and A the mean of J^T J over the points
// that the camera sees. The basis B has B B^T = A^-1.
#pragma once
#include <array>
#include <vector>

#include "ewa/camera_motion.h"
#include "ewa/gaussians.h"
#include "pipeline/frame_buffers.h"
#include "pipeline/frame_inputs.h"
#include "pipeline/learned_table.h"

namespace ewa::pipeline {

using MotionBasis = std::array<float, shared::MOTION_BASIS_FLOATS>;

/// The basis B of a camera. focal: also learns a factor of the focal lengths. extent: of the scene, world units.
MotionBasis motion_basis(const Camera& camera, const Gaussians& gaussians, bool focal, double extent);
/// The basis for the learned motion during a readout, which is proportional to a point's time from the middle of the readout.
MotionBasis readout_basis(const Camera& camera, const Gaussians& gaussians, double extent);

/// The bases of the training images' cameras.
struct MotionBases {
    std::vector<MotionBasis> poses;
    std::vector<MotionBasis> readouts;  // empty, or as many
    std::vector<bool> rolling;          // with readouts: whether the image has a rolling shutter
};
MotionBases motion_bases(const std::vector<Camera>& cameras, const Gaussians& gaussians, bool focal,
                         double extent);

/// Motions of all training cameras: first a row for each camera's pose, then a row for each camera's readout.
struct Motions : LearnedTable {
    uint32_t photos = 0;
    /// Whether an image's camera learns a motion during its readout. Its row is `photos` rows after that of the pose.
    std::vector<bool> rolling;
    gpu::Buffer bases;
    gpu::Buffer camera;  // the moved camera of the frame

    Motions() = default;
    Motions(gpu::Device& device, const MotionBases& bases);
    bool readouts() const { return !rolling.empty(); }
    bool has_readout(uint32_t photo) const { return readouts() && rolling[photo]; }
    uint64_t count() const { return readouts() ? 2ull * photos : photos; }
    std::vector<CameraMotion> download() const;
    std::vector<Array> arrays();  // with the bases
};

/// An optimisation step of one training camera's motion.
struct MotionUse {
    const Motions* motions = nullptr;
    uint32_t photo = 0;
    float rate = 0;      // radians by which a step moves the points of the image
    float extent = 1;    // of the scene, world units
    uint32_t visit = 1;  // number of this camera's step, from 1
};

/// Records the computation of the moved camera. base: the camera of the dataset. Returns the moved camera, for the frame's inputs.
CameraUse record_move_camera(const passes::Recorder& on, const Motions& motions, uint32_t photo,
                             const CameraUse& base);

/// Records the sum of the partial gradients that the update pass has written to frame.motion_sums. Sums of blocks go to
/// frame.motion_reduced. readout: the camera has LENSES_ROLLING.
void record_motion_sums(const passes::Recorder& on, const FrameBuffers& frame, bool readout);

/// Records Adam's step of the motion, after record_motion_sums.
void record_motion_update(const passes::Recorder& on, const FrameBuffers& frame, const MotionUse& use);

/// Reads back the gradient of the last frame with record_motion_sums, with respect to the motion at zero motion.
CameraMotion download_motion_gradient(const FrameBuffers& frame, bool readout);

}  // namespace ewa::pipeline
