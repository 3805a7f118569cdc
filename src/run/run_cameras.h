// SPDX-License-Identifier: Apache-2.0
// The cameras of a run, which --refine-poses refines.
#pragma once
#include <functional>
#include <memory>
#include <vector>

#include "report/html.h"
#include "run/run_files.h"
#include "run/run_input.h"

namespace ewa::train {

/// Switches the cameras in a run's input between the dataset's and those that a trainer has refined.
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

    // Call the next two only between use_refined and use_given.
    CameraMoves moves() const;
    /// Writes the refined cameras. aligned: align_test has moved the test cameras. Throws RunError.
    void save(const RunWriter& folder, bool aligned) const;

  private:
    RunInput& input_;
    std::vector<Camera> given_;  // of the dataset, while its frames have the refined ones
    Similarity world_;           // of the refined cameras
    double extent_ = 1;          // Trainer::extent
};

/// Rows of the report: for each image, its reconstructed points and their reprojection error, the largest error first. Empty if the
/// dataset has none.
std::vector<report::CameraRow> camera_rows(const Dataset& dataset);

}  // namespace ewa::train
