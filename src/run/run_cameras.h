// SPDX-License-Identifier: Apache-2.0
// The cameras of a run that refines them.
#pragma once
#include <functional>
#include <memory>
#include <vector>

#include "report/html.h"
#include "run/run_files.h"
#include "run/run_input.h"

namespace ewa::train {

/// Sets the cameras of the frames of a run's input: those of the dataset, or for a while those that a trainer refined.
class RunCameras {
  public:
    /// input: must outlive this.
    explicit RunCameras(RunInput& input) : input_(input) {}

    bool refine() const { return input_.options.train.refine_poses; }
    void use_refined(const Trainer& trainer);
    void use_given();
    /// Aligns the refined test cameras to their images, with fixed splats. before_frame: see align_cameras.
    void align_test(const std::shared_ptr<gpu::Device>& device, const Gaussians& gaussians,
                    const std::function<void()>& before_frame);

    // While the refined cameras are in use:
    CameraMoves moves() const;
    /// aligned: align_test has moved the test cameras. Throws RunError.
    void save(const RunWriter& folder, bool aligned) const;

  private:
    RunInput& input_;
    std::vector<Camera> given_;  // of the dataset, while its frames have the refined ones
    Similarity world_;           // of the refined cameras
    double extent_ = 1;          // Trainer::extent
};

/// Points and errors of each image by the reconstruction, for the report: the largest error first. Empty: unknown.
std::vector<report::CameraRow> camera_rows(const Dataset& dataset);

}  // namespace ewa::train
