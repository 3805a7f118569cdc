// SPDX-License-Identifier: Apache-2.0
// A training run: load, open the device, resume, train, evaluate, report.
#include "ewa/run.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "core/atomic_file.h"
#include "core/folders.h"
#include "core/outputs.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "ewa/renderer.h"
#include "gpu/device.h"
#include "io/datasets/dataset_folders.h"
#include "pipeline/model.h"
#include "report/pictures.h"
#include "report/run_file_names.h"
#include "report/step_time.h"
#include "report/tensorboard.h"
#include "report/views.h"
#include "run/agreement.h"
#include "run/disk_room.h"
#include "run/earlier_run.h"
#include "run/evaluation.h"
#include "run/inria_files.h"
#include "run/refined_cameras.h"
#include "run/resume.h"
#include "run/run_files.h"
#include "run/run_input.h"
#include "run/run_options.h"
#include "run/run_times.h"
#include "scene/dataset_files.h"
#include "train/checkpoint.h"

namespace ewa {
namespace {

using Clock = std::chrono::steady_clock;
using Json = nlohmann::ordered_json;

// Their mean says enough. All views of a large set would take longer than its training.
constexpr size_t kTrainViewsEvaluated = 40;
constexpr size_t kSavedRenders = 4;

double seconds_since(Clock::time_point begin) {
    return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// Whether the steps after `before`, up to `step`, have a multiple of `every` among them.
bool passes_multiple(int before, int step, int every) {
    return every > 0 && step / every > before / every;
}

/// `count` of the values, evenly spread, with the first among them. All of them if there are fewer.
template <class T>
std::vector<T> spread_out(const std::vector<T>& values, size_t count) {
    if (values.size() <= count) return values;
    std::vector<T> some;
    for (size_t i = 0; i < count; ++i) some.push_back(values[i * values.size() / count]);
    return some;
}

/// Thrown out of an evaluation that the observer stops.
struct Stopped {};

/// What training a scene without view-dependent colour skips, besides what its plan says.
PlanLine skipped_sh_degrees(uint32_t splats, int moment_bits) {
    // Parameters and both of Adam's moments.
    const uint64_t bytes =
        (1 + 2 * uint64_t(moment_bits) / 32) *
        (pipeline::parameter_bytes(splats, kMaxShDegree) - pipeline::parameter_bytes(splats, 0));
    return {fmt::format("SH degrees 1 to {}", kMaxShDegree),
            "the dataset says that no colour depends on the view", bytes};
}

/// What the trainer skips, and what the choice of the SH degree saved before.
std::vector<PlanLine> plan_of(const Trainer& trainer, const train::RunInput& input) {
    std::vector<PlanLine> plan = trainer.plan();
    if (input.without_view_dependence())
        plan.push_back(skipped_sh_degrees(trainer.splats(), input.options.train.moment_bits));
    return plan;
}

/// The views whose renders are saved.
std::vector<int> saved_frames(const Split& split) {
    return spread_out(split.test.empty() ? split.train : split.test, kSavedRenders);
}

/// The file of a view's render, for each frame.
std::vector<std::filesystem::path> render_files(const train::RunInput& input) {
    std::vector<std::filesystem::path> files;
    for (const std::filesystem::path& name : report::picture_names(input.dataset.frames))
        files.push_back(input.options.output / (input.split.test.empty() ? "train" : "test") /
                        (name.string() + ".png"));
    return files;
}

/// The run's folder, after a check that no file in it is an input. --config may be the config.json that the run
/// writes, since that has the same options.
const std::filesystem::path& checked_folder(const train::RunInput& input) {
    const std::filesystem::path& folder = input.options.output;
    if (!input.options.resume || !core::is_file(folder / report::kCheckpointFile))
        io::check_output_folder("-o", folder, input.dataset);
    std::vector<core::NamedFile> written, read = scene::files_of(input.dataset, "DATASET");
    for (const char* name : report::kRunFiles) written.push_back({"the run's file", folder / name});
    for (const char* name : report::kCameraModelFiles) written.push_back({"the run's file", folder / name});
    const auto renders = render_files(input);
    for (const int index : saved_frames(input.split))
        written.push_back({"the run's render", renders[size_t(index)]});
    if (input.options.init != "sfm" && input.options.init != "random")
        read.push_back({"--init", input.options.init_folder / input.options.init});
    read.push_back({"DATASET", input.options.scene});
    read.push_back({"--lpips-weights", input.options.lpips_weights});
    core::check_outputs(written, read);
    return folder;
}

report::StepTime report_times(const StepTimes& times) {
    report::StepTime result{times.steps, times.step, times.refinement, {}};
    for (const PassTime& time : times.passes) result.passes.push_back({time.pass, time.milliseconds});
    return result;
}

class Run {
  public:
    Run(const RunOptions& options, RunObserver& observer)
        : observer_(observer),
          begin_(Clock::now()),
          asked_strategy_(options.train.strategy),
          input_(train::load_run(options)),
          measures_(train::measures_of(options)),
          folder_(checked_folder(input_)) {}

    RunResult run();

  private:
    const RunOptions& options() const { return input_.options; }
    double wall_seconds() const { return earlier_wall_ + options().seconds_before + seconds_since(begin_); }
    void read_checkpoint();
    void begin_files();
    void choose_cap();
    void start();
    void list_settings();
    void restore(Trainer& trainer);
    void restore_times();
    void save_splats(const Gaussians& gaussians) const;
    void keep_splats(const Gaussians& gaussians) const;
    void save_result(const Trainer& trainer, bool kept);
    bool refines() const { return options().train.refine_poses; }
    void use_refined_cameras(const Trainer& trainer);
    void use_given_cameras();
    void align_test_cameras(const Gaussians& gaussians, const std::function<void()>& before_frame);
    void save_cameras(bool aligned) const;
    void save_checkpoint(const Trainer& trainer);
    void save_what_fits(const Trainer& trainer);
    void train(Trainer& trainer);
    void after_step(Trainer& trainer, int before);
    void log(const std::optional<Evaluation>& evaluation);
    void stop_if_asked() const;
    template <class Work>
    bool done_unless_stopped(Work&& work) const;
    bool draws_with_ranks() const { return options().ranks->size() > 1; }
    train::Drawing drawing(const Gaussians& gaussians, const Trainer* trainer) const;
    size_t evaluated_views() const {
        return input_.split.test.size() + std::min(input_.split.train.size(), kTrainViewsEvaluated);
    }
    void evaluate_result(const train::Drawing& drawing, const Gaussians& gaussians,
                         const std::vector<Exposure>& exposures, const std::function<void()>& before_frame);
    void add_view(int index, const train::RenderedView& view, const EvalFrame& figures);
    void add_full_size(const train::Drawing& drawing, const std::vector<Exposure>& exposures);
    void add_section(const Gaussians& gaussians);
    void finish(std::unique_ptr<Trainer> trainer);
    void fill_summary();

    RunObserver& observer_;
    Clock::time_point begin_;
    double earlier_wall_ = 0;  // of the run that this one continues
    Strategy asked_strategy_;
    train::RunInput input_;
    Measures measures_;
    train::RunFolder folder_;
    train::SavePace pace_;
    Json settings_;  // of the checkpoint
    std::unique_ptr<train::CheckpointReader> earlier_;
    train::RunTimes times_;              // of the checkpoints
    bool continues_ = false;             // from a checkpoint
    int earlier_steps_ = 0;              // that the checkpoint's run was asked for
    std::vector<Camera> given_cameras_;  // of the dataset, while its frames have the refined ones
    train::Similarity world_;            // of the refined cameras
    double extent_ = 1;                  // Trainer::extent
    std::shared_ptr<gpu::Device> device_;
    std::optional<report::MetricsLog> log_file_;
    std::optional<report::EventsLog> events_;
    StepReport last_;
    std::optional<Evaluation> last_evaluation_;
    report::ReportData report_;
    std::filesystem::path first_render_;
    int checkpoint_step_ = -1;      // of checkpoint.ewa; -1: there is none
    mutable int splats_step_ = -1;  // of splats.ply, if this run wrote it
};

void Run::read_checkpoint() {
    train::check_free(folder_.path(), options());  // again, now that no other run writes here
    continues_ = options().resume && std::filesystem::exists(folder_.checkpoint());
    if (continues_) {
        earlier_ = std::make_unique<train::CheckpointReader>(folder_.checkpoint());
        earlier_steps_ = train::continue_from(folder_.checkpoint(), earlier_->checkpoint(), asked_strategy_,
                                              input_.options);
    }
    settings_ =
        train::checkpoint_settings(options(), train::dataset_fingerprint(input_.dataset, input_.split));
    if (continues_) train::check_resumable(folder_.checkpoint(), earlier_->checkpoint().settings, settings_);
}

/// Called as late as possible, since it ends an earlier run that is replaced.
void Run::begin_files() {
    folder_.begin(train::to_config(options()), continues_);
    log_file_.emplace(folder_.metrics(), report_.metrics);
    if (options().tensorboard)
        events_.emplace(
            folder_.path() / report::kEventsFile, report_.metrics,
            std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count() -
                wall_seconds());
}

void Run::list_settings() {
    for (const train::RunOption& option : train::run_options())
        if (const std::string value = train::value_text(option, options());
            !option.subject.empty() || value != train::value_text(option, RunOptions()))
            report_.settings.emplace_back(option.name, value);
    for (auto& [name, value] : report_.settings)
        if (name == "device" && value.empty()) value = report_.summary.device + " (chosen by ewa)";
}

/// Notes the largest number of splats, which is automatic unless the options name it. A checkpoint keeps it.
void Run::choose_cap() {
    const TrainOptions& train = options().train;
    const SplatCap cap = splat_cap(*device_, input_.dataset, input_.split.train, input_.start, train);
    report_.summary.max_splats = cap.splats;
    settings_["cap"] = cap.splats;
    if (train.max_splats == kAutomaticMaxSplats && train.strategy != Strategy::none)
        input_.notes.push_back(fmt::format("at most {}: {}; --max-splats N sets another limit",
                                           core::counted(cap.splats, "splat"), cap.reason));
    const std::string full = train::check_disk_room(folder_.path(), input_.start.size(), cap.splats, train);
    if (!full.empty()) input_.remarks.push_back(full);
}

/// Opens the device and tells the observer what the run begins with.
void Run::start() {
    device_ = open_device(options().device);
    choose_cap();
    report_.title = input_.name;
    report_.notes = input_.notes;
    report_.remarks = input_.remarks;
    report::Summary& summary = report_.summary;
    summary.device = device_info(*device_).name;
    summary.seed = options().train.seed;
    summary.version = EWA_VERSION;
    summary.command = options().command;
    summary.strategy = train::name_of(options().train.strategy);
    settings_["device"] = summary.device;

    const Camera& camera = input_.dataset.frames[size_t(input_.split.train.front())].camera;
    RunStart start;
    start.name = input_.name;
    start.train_views = input_.split.train.size();
    start.test_views = input_.split.test.size();
    start.width = camera.width;
    start.height = camera.height;
    start.splats = input_.start.size();
    start.train = options().train;
    start.max_splats = report_.summary.max_splats;
    start.evaluated = evaluated_views();
    start.remarks = input_.notes;
    start.remarks.insert(start.remarks.end(), input_.remarks.begin(), input_.remarks.end());
    start.device = device_info(*device_);
    start.memory =
        estimate_memory(*device_, input_.dataset, input_.split.train, input_.start, options().train);
    observer_.on_start(start);
}

/// Continues from the checkpoint, if there is one.
void Run::restore(Trainer& trainer) {
    if (!earlier_) return;
    const std::string remark = train::resume_remark(earlier_->checkpoint().settings, settings_);
    if (!remark.empty()) {
        report_.remarks.push_back(remark);
        observer_.on_note(remark);
    }
    try {
        report_.metrics = report::parse_metrics(earlier_->checkpoint().metrics);
        restore_times();
        trainer.restore(*earlier_);
    } catch (const InputError& error) {
        throw InputError(folder_.checkpoint().string() + ": " + error.what() + "; --force starts anew");
    }
    last_ = earlier_->head().report;
    checkpoint_step_ = report_.earlier_steps = last_.step;
    const int steps = options().train.steps;
    // The checkpoint of a finished run lacks the line of its last evaluation.
    if (steps > earlier_steps_ && last_.step == earlier_steps_)
        if (const auto line = folder_.logged(last_.step))
            if (report_.metrics.empty() || report_.metrics.back().step < line->step)
                report_.metrics.push_back(*line);
    observer_.on_note(fmt::format(
        "resumed after step {} of {}{}", last_.step, steps,
        steps == earlier_steps_ ? "" : fmt::format(", before which the run had --steps {}", earlier_steps_)));
    earlier_.reset();
}

/// The times of the checkpoint, from times.json. One of an earlier version has them itself.
void Run::restore_times() {
    const StepReport& report = earlier_->head().report;
    train::TimesAt own{report.step, report.seconds, earlier_->checkpoint().wall_seconds};
    if (own.wall_seconds == 0) try {
            train::RunTimes known = train::read_times(folder_.times());
            for (const train::TimesAt& time : known.checkpoints)
                if (time.step == own.step) own = time;
            train::take_times(report_.metrics, known);
        } catch (const InputError&) {
            // What was trained matters more than how long it took.
        }
    if (own.wall_seconds == 0) {
        report_.remarks.push_back("resumed without its earlier times, since times.json lacks them");
        observer_.on_note(report_.remarks.back());
    }
    earlier_->set_seconds(own.seconds);
    earlier_wall_ = own.wall_seconds;
    train::add_checkpoint(times_, own);
}

void Run::save_splats(const Gaussians& gaussians) const {
    folder_.save_splats(gaussians, last_.step, options().train.render);
    splats_step_ = last_.step;
}

void Run::keep_splats(const Gaussians& gaussians) const {
    if (options().keep > 0)
        folder_.keep_splats(gaussians, last_.step, options().train.render, options().keep);
}

/// The splats, and the cameras that belong to them. kept: of a step that --keep counts.
void Run::save_result(const Trainer& trainer, bool kept) {
    const Gaussians gaussians = trainer.gaussians();
    save_splats(gaussians);
    if (kept) keep_splats(gaussians);
    if (!refines()) return;
    use_refined_cameras(trainer);
    save_cameras(false);
    use_given_cameras();
}

/// Gives the frames the cameras that belong to the trainer's splats.
void Run::use_refined_cameras(const Trainer& trainer) {
    extent_ = trainer.extent();
    auto [cameras, world] =
        train::refined_cameras(input_.dataset, input_.split.train, trainer.camera_motions());
    world_ = world;
    for (size_t i = 0; i < cameras.size(); ++i) std::swap(input_.dataset.frames[i].camera, cameras[i]);
    given_cameras_ = std::move(cameras);
}

void Run::use_given_cameras() {
    for (size_t i = 0; i < given_cameras_.size(); ++i) input_.dataset.frames[i].camera = given_cameras_[i];
    given_cameras_.clear();
}

void Run::align_test_cameras(const Gaussians& gaussians, const std::function<void()>& before_frame) {
    const std::vector<int>& frames = input_.split.test;
    const auto motions = train::align_cameras(device_, gaussians, input_.dataset, frames, options().train,
                                              extent_, before_frame);
    for (size_t i = 0; i < frames.size(); ++i) {
        Camera& camera = input_.dataset.frames[size_t(frames[i])].camera;
        camera = moved(camera, motions[i]);
    }
}

void Run::save_cameras(bool aligned) const {
    folder_.save_cameras(input_.dataset, input_.split, given_cameras_, world_, extent_, aligned);
}

void Run::save_checkpoint(const Trainer& trainer) {
    const auto start = Clock::now();
    times_.metrics = train::times_of(report_.metrics);
    train::add_checkpoint(times_, {last_.step, last_.seconds, wall_seconds()});
    train::write_times(folder_.times(), times_);
    train::CheckpointWriter writer(folder_.checkpoint(),
                                   settings_.dump(-1, ' ', false, Json::error_handler_t::replace),
                                   report::metrics_text(train::without_times(report_.metrics)));
    trainer.save(writer);
    writer.commit();
    checkpoint_step_ = last_.step;
    pace_.saved(seconds_since(start));
}

/// After a write that found the disk full: the checkpoint, or the smaller splats.
void Run::save_what_fits(const Trainer& trainer) {
    // Other ranks may be in the middle of a step or of a checkpoint.
    if (draws_with_ranks() || checkpoint_step_ == last_.step) return;
    try {
        save_checkpoint(trainer);
    } catch (const core::FullDisk&) {
        try {
            if (splats_step_ != last_.step) save_splats(trainer.gaussians());
        } catch (const core::FullDisk&) {
            // The error that the user sees says what is left.
        }
    }
}

void Run::log(const std::optional<Evaluation>& evaluation) {
    MetricsLine line{last_.step, last_.seconds, wall_seconds(), last_.loss, last_.splats, {}, {}, {}};
    if (last_.step > 0) line.train_psnr = last_.psnr;
    if (evaluation) {
        line.test_psnr = evaluation->psnr;
        line.test_ssim = evaluation->ssim;
        line.test_figures = evaluation->figures;
    }
    log_file_->append(line);
    if (events_) events_->append(line);
    report_.metrics.push_back(line);
    observer_.on_metrics(line);
}

/// Evaluates, logs and saves as far as this step is due for it. before: steps done before it.
void Run::after_step(Trainer& trainer, int before) {
    const int step = last_.step;
    const auto at = [&](int every) { return passes_multiple(before, step, every); };
    std::optional<Evaluation> evaluation;
    if (at(options().eval_every) && !input_.split.test.empty()) {
        // Cannot be stopped: a run that is resumed would not repeat it.
        const Gaussians gaussians = draws_with_ranks() ? Gaussians() : trainer.gaussians();
        if (refines()) use_refined_cameras(trainer);
        if (refines()) align_test_cameras(gaussians, {});
        evaluation = train::evaluate_views(
            drawing(gaussians, &trainer), input_.dataset, input_.split.test, options().train.render, {},
            [&] { trainer.keep_waiting(); }, [](size_t, const train::RenderedView&, const EvalFrame&) {},
            measures_);
        use_given_cameras();
        observer_.on_evaluation(step, *evaluation);
    }
    const int log_every = std::max(1, options().train.steps / 100);
    if (evaluation || before == 0 || at(log_every)) {
        last_ = trainer.report();  // the step's own, also where steps overlap
        log(evaluation);
    }
    // The checkpoint comes first: with it alone, no step is lost where the disk is full.
    if (options().save_every > 0 ? at(options().save_every) : pace_.due()) save_checkpoint(trainer);
    if (at(options().save_every)) save_result(trainer, true);
    observer_.between_steps(last_, trainer, [&] {
        save_checkpoint(trainer);
        save_result(trainer, false);
    });
}

void Run::train(Trainer& trainer) {
    const int steps = options().train.steps;
    try {
        while (trainer.steps_done() < steps && !observer_.should_stop()) {
            const int before = trainer.steps_done();
            last_ = trainer.step();
            observer_.on_step(last_);
            if (last_.step < steps) after_step(trainer, before);  // finish() does so after the last step
        }
    } catch (const InputError&) {
        // An image that vanished is found before the step changes the splats. Other ranks may be in the middle of it.
        if (options().ranks->size() == 1) save_checkpoint(trainer);
        throw;
    } catch (const core::FullDisk&) {
        save_what_fits(trainer);
        throw;
    }
}

void Run::stop_if_asked() const {
    if (observer_.should_stop()) throw Stopped();
}

/// Whether the work was done to its end.
template <class Work>
bool Run::done_unless_stopped(Work&& work) const {
    try {
        stop_if_asked();
        work();
        return true;
    } catch (const Stopped&) {
        return false;
    }
}

/// By all ranks from their shares; or by a renderer, without the trainer.
train::Drawing Run::drawing(const Gaussians& gaussians, const Trainer* trainer) const {
    if (!draws_with_ranks()) return train::drawing_of(device_, gaussians, options().train.render);
    return {size_t(options().ranks->size()),
            [trainer](std::span<const Camera> cameras) { return trainer->render(cameras); }};
}

void Run::evaluate_result(const train::Drawing& drawing, const Gaussians& gaussians,
                          const std::vector<Exposure>& exposures, const std::function<void()>& before_frame) {
    observer_.on_note("evaluating");
    const bool held_out = !input_.split.test.empty();
    size_t done = 0;
    // The report shows the held-out views, or the training views without a test set.
    const auto evaluated = [&](const std::vector<int>& frames, const std::vector<Exposure>& of_frames,
                               bool shown, const Measures& measures) {
        return train::evaluate_views(
            drawing, input_.dataset, frames, options().train.render, of_frames, before_frame,
            [&](size_t i, const train::RenderedView& view, const EvalFrame& figures) {
                if (shown) add_view(frames[i], view, figures);
                observer_.on_view(++done, evaluated_views());
            },
            measures);
    };
    if (held_out) {
        if (refines()) {
            align_test_cameras(gaussians, before_frame);
            report_.summary.cameras->test_aligned = true;
            save_cameras(true);
        }
        last_evaluation_ = evaluated(input_.split.test, {}, true, measures_);
        report_.summary.test_figures = last_evaluation_->figures;
        report_.summary.test_psnr = last_evaluation_->psnr;
        report_.summary.test_ssim = last_evaluation_->ssim;
    }
    report_.summary.train_psnr = evaluated(spread_out(input_.split.train, kTrainViewsEvaluated),
                                           spread_out(exposures, kTrainViewsEvaluated), !held_out, {})
                                     .psnr;
}

/// Adds a view to the report. Saves its render if it is one of those.
void Run::add_view(int index, const train::RenderedView& view, const EvalFrame& figures) {
    report_.views.push_back(
        report::small_view(figures.name, view.photo, view.rendering, figures.psnr, figures.ssim));
    report_.views.back().frame = index;
    const std::vector<int> saved = saved_frames(input_.split);
    if (std::find(saved.begin(), saved.end(), index) == saved.end()) return;
    const std::filesystem::path file = render_files(input_)[size_t(index)];
    core::make_folder(file.parent_path());
    save_image(train::without_link(file), view.rendering);
    if (first_render_.empty()) first_render_ = file;
}

/// Gives views of the report their images at full size, as many as the report may hold.
void Run::add_full_size(const train::Drawing& drawing, const std::vector<Exposure>& exposures) {
    report::sort_views(report_.views);
    size_t bytes = 0;
    for (const size_t i : report::full_size_order(report_.views.size())) {
        if (bytes >= report::kFullSizeBytes) break;
        stop_if_asked();
        report::ReportView& view = report_.views[i];
        const auto place = std::find(input_.split.train.begin(), input_.split.train.end(), view.frame);
        const bool exposed = !exposures.empty() && place != input_.split.train.end();
        const Frame& frame = input_.dataset.frames[size_t(view.frame)];
        const train::RenderedView rendered = train::with_photo(
            std::move(drawing.images(std::span(&frame.camera, 1)).front()), frame, options().train.render,
            exposed ? &exposures[size_t(place - input_.split.train.begin())] : nullptr);
        bytes += report::add_full_size(view, rendered.photo, rendered.rendering);
    }
}

void Run::add_section(const Gaussians& gaussians) {
    if (!options().report_section) return;
    stop_if_asked();
    const int first = saved_frames(input_.split).front();
    report_.section = options().report_section(
        {device_, gaussians, input_.dataset.frames[size_t(first)].camera, options().train.render});
}

void Run::fill_summary() {
    report::Summary& summary = report_.summary;
    summary.steps = last_.step;
    summary.seconds = last_.seconds;
    summary.splats = last_.splats;
    summary.skipped_nonfinite = last_.skipped_nonfinite;
    summary.dropped_updates = last_.dropped_updates;
    summary.limited_steps = last_.limited_steps;
    summary.peak_device_bytes = peak_device_bytes(*device_);
    summary.peak_host_bytes = train::peak_host_bytes(*device_);
    summary.wall_seconds = wall_seconds();
}

void Run::finish(std::unique_ptr<Trainer> trainer) {
    const Gaussians gaussians = trainer->gaussians();
    const std::vector<Exposure> exposures = trainer->exposures();
    try {
        save_checkpoint(*trainer);  // from here on, neither a kill nor a full disk costs training
    } catch (const core::FullDisk&) {
        save_what_fits(*trainer);
        throw;
    }
    save_splats(gaussians);
    if (options().save_every > 0 && last_.step % options().save_every == 0) keep_splats(gaussians);
    if (refines()) {
        use_refined_cameras(*trainer);
        save_cameras(false);
        report_.summary.cameras =
            train::moves_of(input_.dataset, input_.split.train, given_cameras_, extent_);
    }
    if (options().inria) train::save_inria(folder_.path(), input_, gaussians, last_.step);
    if (options().train.exposure) folder_.save_exposures(input_.dataset, input_.split.train, exposures);
    report_.times = report_times(trainer->step_times());
    report_.summary.ranks = trainer->rank_figures();
    report_.summary.chunks = trainer->chunk_figures();
    if (!draws_with_ranks()) trainer.reset();  // the renderer takes its memory
    if (options().train.device_memory_bytes > 0)
        device_->limit_memory(options().train.device_memory_bytes, {});
    observer_.on_saved(last_);

    const train::Drawing draw = drawing(gaussians, trainer.get());
    const auto before_frame = [&] {
        stop_if_asked();
        if (trainer) trainer->keep_waiting();
    };
    const bool evaluated =
        done_unless_stopped([&] { evaluate_result(draw, gaussians, exposures, before_frame); });
    if (last_.step > 0) log(last_evaluation_);
    observer_.on_evaluated(last_, gaussians);
    report_.held_out = !input_.split.test.empty();
    const auto fill_report = [&] {
        add_full_size(draw, exposures);
        trainer.reset();  // ends the other ranks
        add_section(gaussians);
    };
    if (!evaluated) report_.views.clear();
    report_.summary.interrupted = !evaluated || !done_unless_stopped(fill_report);
    trainer.reset();
    fill_summary();
    folder_.save_report(report_);
}

RunResult Run::run() {
    read_checkpoint();
    start();
    list_settings();
    train::agree(input_.options, settings_, settings_.at("dataset").get<std::string>(), input_.start,
                 *device_);
    auto owned = std::make_unique<Trainer>(device_, input_.dataset, input_.split.train,
                                           std::exchange(input_.start, {}), options().train, options().ranks);
    Trainer& trainer = *owned;
    report_.plan = plan_of(trainer, input_);
    observer_.on_plan(report_.plan);
    const auto chunks = trainer.chunk_figures();
    if (trainer.images_on_disk() > 0)
        observer_.on_note(fmt::format(
            "{} training images exceed {} and are read again for each step", trainer.images_on_disk(),
            chunks ? "--image-cache or a quarter of --device-memory"
                   : fmt::format("--image-cache {} MiB", options().train.image_cache_bytes >> 20)));
    if (chunks)
        observer_.on_note(fmt::format(
            "larger than --device-memory: the splats are in {} chunks, most of which wait in host memory",
            chunks->chunks));
    last_.splats = trainer.splats();
    restore(trainer);
    begin_files();
    observer_.on_begin(folder_.path(), report_.metrics);
    try {
        train(trainer);
        finish(std::move(owned));
    } catch (const core::FullDisk& error) {
        throw RunError(error.what() + train::after_full_disk(last_.step, checkpoint_step_, splats_step_));
    }
    return {report_.summary, folder_.path(), first_render_};
}

/// The part of a rank other than 0: it reads the dataset, and writes nothing.
RunResult follow_training(const RunOptions& asked) {
    train::RunInput input = train::load_run(asked);
    const std::shared_ptr<gpu::Device> device = open_device(asked.device);
    train::agree(input.options, {}, train::dataset_fingerprint(input.dataset, input.split), input.start,
                 *device);
    Trainer trainer(device, input.dataset, input.split.train, std::exchange(input.start, {}),
                    input.options.train, asked.ranks);
    trainer.follow();
    return {};
}

}  // namespace

RunResult run_training(const RunOptions& asked, RunObserver& observer) {
    check_options(asked);
    RunOptions options = asked;
    train::agree_on_options(options);
    if (options.ranks->rank() != 0) return follow_training(options);
    train::check_free(output_folder(options), options);  // before the dataset is loaded
    return Run(options, observer).run();
}

RunResult run_training(const RunOptions& options) {
    RunObserver nobody;
    return run_training(options, nobody);
}

}  // namespace ewa
