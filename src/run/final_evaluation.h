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

/// The views that the evaluation draws.
size_t evaluated_views(const Split& split);

/// The files of the renders that it saves, by frame.
std::map<int, std::filesystem::path> saved_renders(const RunInput& input);

/// The trained scene of a run, and how to draw it.
struct TrainedScene {
    std::shared_ptr<gpu::Device> device;
    Gaussians gaussians;
    std::vector<Appearance> appearances;  // of the training frames, or empty
    std::shared_ptr<const SkyMap> sky;    // null: none
    ViewRenderer renderer;
};

/// Evaluates a scene and fills the report with it. Each part returns whether it was done: RunObserver::should_stop ends it
/// early.
class FinalEvaluation {
  public:
    /// What is passed must outlive this. keep_waiting: called before each frame.
    FinalEvaluation(RunObserver& observer, const RunInput& input, const Measures& measures,
                    const TrainedScene& scene, std::function<void()> keep_waiting, report::ReportData& report)
        : observer_(observer),
          input_(input),
          measures_(measures),
          scene_(scene),
          keep_waiting_(std::move(keep_waiting)),
          report_(report),
          saved_(saved_renders(input)) {}

    /// The figures and the small views. cameras: refined ones are in use. They are saved again in `folder` after an
    /// alignment of the test cameras.
    bool evaluate(RunCameras& cameras, const RunWriter& folder);
    /// The images at full size, as many as the report may hold.
    bool add_full_size();

    /// The figures of the test views, once they are evaluated.
    const std::optional<Evaluation>& of_test_views() const { return of_test_views_; }
    /// The first of the report's images; empty if there is none.
    const std::filesystem::path& first_render() const { return first_render_; }

  private:
    bool done_unless_stopped(const std::function<void()>& work) const;
    void evaluate_test_views();
    /// Adds a remark on held-out views whose cameras may be wrong. train_psnr: of the training views.
    void check_test_cameras(double train_psnr);
    /// Whether the cameras of views can be moved to where the splats fit their images best.
    bool can_align() const;
    /// Those that do so; none where they cannot be moved. extent: of the scene.
    std::vector<CameraMotion> motions_of(const std::vector<int>& frames, double extent) const;
    /// The image of a frame through a camera, and the render.
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
    std::map<int, RenderedView> kept_;       // for their full size
    uint64_t kept_values_ = 0;               // of their images
    std::vector<std::future<void>> saving_;  // renders
};

}  // namespace ewa::train
