// SPDX-License-Identifier: Apache-2.0
// The evaluation after a run's last step, and the views of its report.
#pragma once
#include <filesystem>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "ewa/camera_motion.h"
#include "ewa/run_observer.h"
#include "report/html.h"
#include "run/evaluation.h"
#include "run/run_cameras.h"
#include "run/run_files.h"
#include "run/run_input.h"

namespace ewa::train {

/// The number of views that the evaluation renders.
size_t evaluated_views(const Split& split);

/// The files of the renders that the evaluation saves, by index of the frame.
std::map<int, std::filesystem::path> saved_renders(const RunInput& input);

/// The trained scene of a run, and how to draw it.
struct TrainedScene {
    std::shared_ptr<gpu::Device> device;
    Gaussians gaussians;
    std::vector<Appearance> appearances;  // of the training frames, or empty
    std::shared_ptr<const SkyMap> sky;    // null: none
    ViewRenderer renderer;
};

/// Evaluates a scene and adds figures and views to the report. evaluate and add_full_size return false if RunObserver::should_stop
/// has ended them early.
class FinalEvaluation {
  public:
    /// The references must outlive this object. keep_waiting: called before each frame.
    FinalEvaluation(RunObserver& observer, const RunInput& input, const Measures& measures,
                    const TrainedScene& scene, std::function<void()> keep_waiting, report::ReportData& report)
        : observer_(observer),
          input_(input),
          measures_(measures),
          scene_(scene),
          keep_waiting_(std::move(keep_waiting)),
          report_(report),
          saved_(saved_renders(input)) {}

    /// Computes the figures and adds small views to the report. cameras: the refined cameras are in use. If this aligns the test
    /// cameras, it saves the cameras in `folder` again.
    bool evaluate(RunCameras& cameras, const RunWriter& folder);
    /// Adds images at full size to the report, as many as the report may hold.
    bool add_full_size();

    /// The figures of the test views. Empty before evaluate.
    const std::optional<Evaluation>& of_test_views() const { return of_test_views_; }
    /// The first of the report's images; empty if there is none.
    const std::filesystem::path& first_render() const { return first_render_; }

  private:
    bool done_unless_stopped(const std::function<void()>& work) const;
    void evaluate_test_views();
    /// Adds a remark on test views whose cameras may be wrong. train_psnr: PSNR of the training views, dB.
    void check_test_cameras(double train_psnr);
    /// Whether align_cameras can move cameras to where the splats fit the images best.
    bool can_align() const;
    /// The motions that align_cameras finds for these frames, or zero motions if it cannot run. extent: of the scene, world units.
    std::vector<CameraMotion> motions_of(const std::vector<int>& frames, double extent) const;
    /// The frame's image, and the render of the scene through this camera.
    RenderedView rendered_through(const Camera& camera, int index);
    Evaluation evaluated(const std::vector<int>& frames, const std::vector<Appearance>& appearances,
                         bool shown, const Measures& measures);
    void add_view(int index, const RenderedView& view, const EvalFrame& figures);
    void keep(int index, const RenderedView& view);
    const NewViewAppearance& of_new_views();
    RenderedView drawn_again(int index);
    size_t add_full_size(report::ReportView& view);

    RunObserver& observer_;
    const RunInput& input_;
    const Measures& measures_;
    const TrainedScene& scene_;
    std::function<void()> keep_waiting_;
    report::ReportData& report_;
    const std::map<int, std::filesystem::path> saved_;  // renders
    size_t done_ = 0;                                   // views
    std::optional<Evaluation> of_test_views_;
    std::filesystem::path first_render_;
    std::optional<NewViewAppearance> of_new_views_;
    std::map<int, RenderedView> kept_;       // views that the report gets at full size
    uint64_t kept_values_ = 0;               // floats in the images of kept_
    std::vector<std::future<void>> saving_;  // renders
};

}  // namespace ewa::train
