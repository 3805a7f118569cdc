// SPDX-License-Identifier: Apache-2.0
#include "run/final_evaluation.h"

#include <algorithm>
#include <cmath>
#include <future>
#include <span>
#include <utility>

#include "core/folders.h"
#include "ewa/error.h"
#include "folders/run_folder.h"
#include "image/metric.h"
#include "report/pictures.h"
#include "report/views.h"
#include "run/refined_cameras.h"
#include "run/wrong_cameras.h"
#include "scene/methods.h"
#include "scene/statistics.h"

namespace ewa::train {
namespace {

// Their mean says enough. All views of a large set would take longer than its training.
constexpr size_t kTrainViewsEvaluated = 40;
constexpr size_t kSavedRenders = 4;
constexpr uint64_t kMostKept = 1 << 25;  // float32 values of views that are kept: 128 MiB

/// Thrown out of a part that the observer stops.
struct Stopped {};

void stop_if_asked(RunObserver& observer) {
    if (observer.should_stop()) throw Stopped();
}

/// `count` of the values, evenly spread, with the first among them. All of them if there are fewer.
template <class T>
std::vector<T> spread_out(const std::vector<T>& values, size_t count) {
    if (values.size() <= count) return values;
    std::vector<T> some;
    for (size_t i = 0; i < count; ++i) some.push_back(values[i * values.size() / count]);
    return some;
}

/// The views whose renders are saved.
std::vector<int> saved_frames(const Split& split) {
    return spread_out(split.test.empty() ? split.train : split.test, kSavedRenders);
}

}  // namespace

size_t evaluated_views(const Split& split) {
    return split.test.size() + std::min(split.train.size(), kTrainViewsEvaluated);
}

std::map<int, std::filesystem::path> saved_renders(const RunInput& input) {
    const auto names = report::picture_names(input.dataset.frames);
    const auto folder =
        input.options.output / (input.split.test.empty() ? folders::kTrainFolder : folders::kTestFolder);
    std::map<int, std::filesystem::path> files;
    for (const int index : saved_frames(input.split))
        files[index] = folder / (names[size_t(index)].string() + ".png");
    return files;
}

bool FinalEvaluation::done_unless_stopped(const std::function<void()>& work) const {
    try {
        stop_if_asked(observer_);
        work();
        return true;
    } catch (const Stopped&) {
        return false;
    }
}

bool FinalEvaluation::evaluate(RunCameras& cameras, const RunWriter& folder) {
    const bool held_out = !input_.split.test.empty();
    const auto align = [&] {
        cameras.align_test(scene_.device, scene_.gaussians, [&] {
            stop_if_asked(observer_);
            keep_waiting_();
        });
        report_.summary.cameras->test_aligned = true;
        cameras.save(folder, true);
    };
    report_.held_out = held_out;
    const bool done = done_unless_stopped([&] {
        observer_.on_note("evaluating");
        if (held_out && cameras.refine()) align();
        if (held_out) evaluate_test_views();
        const double train_psnr =
            evaluated(spread_out(input_.split.train, kTrainViewsEvaluated),
                      spread_out(scene_.appearances, kTrainViewsEvaluated), !held_out, {})
                .psnr;
        if (!std::isnan(train_psnr)) report_.summary.train_psnr = train_psnr;
    });
    for (std::future<void>& saved : saving_) saved.get();
    if (!done) report_.views.clear();
    if (done && held_out && !cameras.refine() && report_.summary.train_psnr)
        done_unless_stopped([&] { check_test_cameras(*report_.summary.train_psnr); });
    return done;
}

void FinalEvaluation::evaluate_test_views() {
    of_test_views_ = evaluated(
        input_.split.test, for_new_views(of_new_views(), input_.dataset, input_.split.test), true, measures_);
    report_.summary.test_figures = of_test_views_->figures;
    if (of_test_views_->frames.empty()) return;  // no pixel counts
    report_.summary.test_psnr = of_test_views_->psnr;
    report_.summary.test_ssim = of_test_views_->ssim;
}

bool FinalEvaluation::can_align() const {
    const RunOptions& options = input_.options;
    // What --refine-poses cannot do either, and what may not fit on the device beside the renderer.
    return !scene::method_of(options.train.render).no_camera_gradient && !scene_.sky &&
           options.train.device_memory_bytes == 0 && options.ranks->size() == 1;
}

std::vector<CameraMotion> FinalEvaluation::motions_of(const std::vector<int>& frames, double extent) const {
    std::vector<CameraMotion> still(frames.size());
    if (!can_align()) return still;
    try {
        return align_cameras(scene_.device, scene_.gaussians, input_.dataset, frames, input_.options.train,
                             extent, [&] {
                                 stop_if_asked(observer_);
                                 keep_waiting_();
                             });
    } catch (const RunError&) {
        return still;  // too little memory ends no run that is trained
    }
}

void FinalEvaluation::check_test_cameras(double train_psnr) {
    std::vector<ViewFigure> views;
    std::vector<double> usual;
    for (const report::ReportView& view : report_.views) {
        views.push_back({view.frame, view.psnr});
        usual.push_back(view.psnr);
    }
    const auto fitted = [&](const Camera& camera, int index) {
        const RenderedView view = rendered_through(camera, index);
        return psnr(image::affine_fitted(view.rendering, view.photo, view.weights), view.photo, view.weights);
    };
    // Only views that stay far below with their colours fitted: an exposure is no fault of a camera.
    for (const ViewFigure& view : far_below(views, train_psnr)) {
        const auto listed = std::ranges::find(views, view.frame, &ViewFigure::frame);
        listed->psnr = fitted(input_.dataset.frames[size_t(view.frame)].camera, view.frame);
    }
    std::vector<int> frames;
    const std::vector<ViewFigure> low = far_below(views, train_psnr);
    for (const ViewFigure& view : low) frames.push_back(view.frame);
    if (frames.empty()) return;
    const double extent = scene_extent(input_.dataset, input_.split.train);
    const std::vector<CameraMotion> motions = motions_of(frames, extent);
    std::vector<DoubtfulView> doubtful;
    for (size_t i = 0; i < frames.size(); ++i) {
        const Frame& frame = input_.dataset.frames[size_t(frames[i])];
        const Camera better = moved(frame.camera, motions[i]);
        const CameraDistance distance = distance_between(frame.camera, better);
        doubtful.push_back({.name = frame.name,
                            .psnr = low[i].psnr,
                            .moved_psnr = fitted(better, frames[i]),
                            .degrees = distance.degrees,
                            .share = distance.length / extent});
    }
    report_.remarks.push_back(wrong_cameras_text(doubtful, scene::quantile(usual, 0.5)));
    observer_.on_note(report_.remarks.back());
}

/// shown: the report shows these views. They are the held-out ones, or the training views without a test set.
Evaluation FinalEvaluation::evaluated(const std::vector<int>& frames,
                                      const std::vector<Appearance>& appearances, bool shown,
                                      const Measures& measures) {
    const auto before_frame = [&] {
        stop_if_asked(observer_);
        keep_waiting_();
    };
    return evaluate_views(
        scene_.renderer, input_.dataset, frames, input_.options.train.render, appearances, before_frame,
        [&](size_t i, const RenderedView& view, const EvalFrame& figures) {
            if (shown) add_view(frames[i], view, figures);
            observer_.on_view(++done_, evaluated_views(input_.split));
        },
        measures, !shown);
}

/// Adds a view to the report. Saves its render if it is one of those.
void FinalEvaluation::add_view(int index, const RenderedView& view, const EvalFrame& figures) {
    report_.views.push_back(
        report::small_view(figures.name, view.photo, view.rendering, figures.psnr, figures.ssim));
    report_.views.back().frame = index;
    keep(index, view);
    const auto file = saved_.find(index);
    if (file == saved_.end()) return;
    core::make_folder(file->second.parent_path());
    // Packing a PNG takes longer than drawing the next view.
    saving_.push_back(
        std::async([path = without_link(file->second), image = view.rendering] { save_image(path, image); }));
    if (first_render_.empty()) first_render_ = file->second;
}

/// Keeps a view for its full size, if it is the one that this shows. Other protocols than ewa's round it.
void FinalEvaluation::keep(int index, const RenderedView& view) {
    const uint64_t values = view.photo.pixels.size() + view.rendering.pixels.size();
    if (measures_.protocol != Protocol::ewa || kept_values_ + values > kMostKept) return;
    kept_values_ += values;
    kept_.emplace(index, RenderedView{view.photo, {}, view.rendering});
}

bool FinalEvaluation::add_full_size() {
    return done_unless_stopped([&] {
        report::sort_views(report_.views);
        size_t bytes = 0;
        for (const size_t i : report::full_size_order(report_.views.size())) {
            if (bytes >= report::kFullSizeBytes) break;
            stop_if_asked(observer_);
            bytes += add_full_size(report_.views[i]);
        }
    });
}

const NewViewAppearance& FinalEvaluation::of_new_views() {
    if (!of_new_views_)
        of_new_views_ = new_view_appearance(scene_.appearances, input_.dataset, input_.split.train);
    return *of_new_views_;
}

RenderedView FinalEvaluation::rendered_through(const Camera& camera, int index) {
    const auto appearance = of_new_views().at(camera.position());
    return with_photo(std::move(scene_.renderer.images(std::span(&camera, 1)).front()),
                      input_.dataset.frames[size_t(index)], input_.options.train.render,
                      appearance ? &*appearance : nullptr);
}

RenderedView FinalEvaluation::drawn_again(int index) {
    const std::vector<int>& train = input_.split.train;
    const auto place = std::find(train.begin(), train.end(), index);
    const bool known = !scene_.appearances.empty() && place != train.end();
    if (!known) return rendered_through(input_.dataset.frames[size_t(index)].camera, index);
    const Frame& frame = input_.dataset.frames[size_t(index)];
    return with_photo(std::move(scene_.renderer.images(std::span(&frame.camera, 1)).front()), frame,
                      input_.options.train.render, &scene_.appearances[size_t(place - train.begin())]);
}

/// Returns the bytes that it adds.
size_t FinalEvaluation::add_full_size(report::ReportView& view) {
    const auto kept = kept_.find(view.frame);
    if (kept != kept_.end()) return report::add_full_size(view, kept->second.photo, kept->second.rendering);
    const RenderedView rendered = drawn_again(view.frame);
    return report::add_full_size(view, rendered.photo, rendered.rendering);
}

}  // namespace ewa::train
