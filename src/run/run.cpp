// SPDX-License-Identifier: Apache-2.0
// A training run: load, open the device, resume, train, evaluate, report.
#include "ewa/run.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <future>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "core/atomic_file.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "folders/run_folder.h"
#include "gpu/device.h"
#include "pipeline/model.h"
#include "report/step_time.h"
#include "run/agreement.h"
#include "run/disk_room.h"
#include "run/earlier_run.h"
#include "run/evaluation.h"
#include "run/final_evaluation.h"
#include "run/first_kernels.h"
#include "run/inria_files.h"
#include "run/option_table.h"
#include "run/resume.h"
#include "run/run_cameras.h"
#include "run/run_files.h"
#include "run/run_input.h"
#include "run/run_log.h"
#include "run/run_outputs.h"
#include "run/run_saves.h"
#include "run/run_times.h"
#include "run/scout.h"
#include "train/checkpoint.h"
#include "train/needs.h"

namespace ewa {
namespace {

using Json = nlohmann::ordered_json;

/// What the trainer skips, and what the choice of the SH degree saved before.
std::vector<PlanLine> plan_of(const Trainer& trainer, const train::RunInput& input) {
    std::vector<PlanLine> plan = trainer.plan();
    if (!input.without_view_dependence()) return plan;
    const auto bytes = [&](int degree) { return pipeline::parameter_bytes(trainer.splats(), degree); };
    // The parameters and both of Adam's moments.
    const uint64_t copies = 1 + 2 * uint64_t(input.options.train.moment_bits) / 32;
    plan.push_back({fmt::format("SH degrees 1 to {}", kMaxShDegree),
                    "the dataset says that no colour depends on the view",
                    copies * (bytes(kMaxShDegree) - bytes(0))});
    return plan;
}

/// The checkpoint that a run continues from.
struct EarlierRun {
    std::unique_ptr<train::CheckpointReader> reader;  // until the trainer has it
    int steps = 0;                                    // that its run was asked for
};

class Run {
  public:
    Run(const RunOptions& options, RunObserver& observer)
        : observer_(observer),
          opening_(std::async(open_device, options.device)),
          progress_{.seconds_before = options.seconds_before, .last = {}, .metrics = {}},
          input_(train::load_run(options, [&](const train::RunInput& input) { compile_ahead(input); })),
          measures_(train::measures_of(options)),
          folder_(train::checked_folder(input_)),
          cameras_(input_),
          saves_(folder_, input_.options, cameras_, progress_) {
        read_checkpoint(options);
    }

    RunResult run();

  private:
    const RunOptions& options() const { return input_.options; }
    void compile_ahead(const train::RunInput& input);
    void read_checkpoint(const RunOptions& asked);
    void begin_files();
    void leave_out_passers_by();
    MemoryEstimate choose_cap();
    TrainOptions capped_options() const;
    void start();
    void list_settings();
    std::unique_ptr<Trainer> make_trainer();
    void restore(Trainer& trainer);
    train::TimesAt restored_times();
    void train(Trainer& trainer);
    void after_step(Trainer& trainer, int before);
    Evaluation evaluate(Trainer& trainer);
    EditCounts edit(Trainer& trainer, const SplatEdit& edit);
    bool draws_with_ranks() const { return options().ranks->size() > 1; }
    train::ViewRenderer view_renderer(const Gaussians& gaussians, std::shared_ptr<const SkyMap> sky,
                                      const Trainer* trainer) const;
    train::TrainedScene save_last(std::unique_ptr<Trainer>& trainer);
    void finish(std::unique_ptr<Trainer> trainer);
    void fill_summary();

    RunObserver& observer_;
    std::future<std::shared_ptr<gpu::Device>> opening_;  // while the dataset is read
    train::RunProgress progress_;
    train::RunInput input_;
    Measures measures_;
    train::RunWriter folder_;
    train::RunCameras cameras_;
    train::RunSaves saves_;
    std::optional<EarlierRun> earlier_;
    std::optional<train::Masks> masks_;  // of --robust, once they are known
    std::shared_ptr<gpu::Device> device_;
    std::optional<train::RunLog> log_;
    report::ReportData report_;
    uint32_t final_splats_ = 0;
    std::filesystem::path first_render_;
};

/// Compiles the kernels of the first step once the device is open, while images are decoded.
void Run::compile_ahead(const train::RunInput& input) try {
    if (!train::has_plain_step(input.options)) return;
    train::FirstStep step = train::first_step(input);  // it may throw: before opening_ is moved
    opening_ = std::async([step = std::move(step), opening = std::move(opening_)]() mutable {
        std::shared_ptr<gpu::Device> device = opening.get();
        train::compile_kernels(*device, step);
        return device;
    });
} catch (const InputError&) {
    // Who reads on finds the same fault.
}

void Run::read_checkpoint(const RunOptions& asked) {
    train::check_free(folder_.path(), options());  // again, now that no other run writes here
    if (options().resume && std::filesystem::exists(folder_.checkpoint())) {
        earlier_.emplace(EarlierRun{std::make_unique<train::CheckpointReader>(folder_.checkpoint()), 0});
        earlier_->steps =
            train::continue_from(folder_.checkpoint(), earlier_->reader->checkpoint(), asked, input_.options);
    }
    const bool points = options().train.loss.sfm_depth > 0;
    saves_.settings() = train::checkpoint_settings(
        options(), train::dataset_fingerprint(input_.dataset, input_.split, points));
    if (!earlier_) return;
    Json settings = saves_.settings();
    if (options().robust && earlier_->reader->checkpoint().state.report.step > 0) {
        masks_ = train::saved_masks(input_);
        settings[train::kMasksSetting] = train::fingerprint_of(*masks_);
    }
    train::check_resumable(folder_.checkpoint(), earlier_->reader->checkpoint().settings, settings);
}

/// Called as late as possible, since it ends an earlier run that is replaced.
void Run::begin_files() {
    folder_.begin(train::to_config(options()), earlier_.has_value());
    folder_.set_place(train::place_of(input_));
    if (options().robust) train::save_masks(input_);
    if (!earlier_) train::remove_inria_splats(folder_.path());
    log_.emplace(folder_, options().tensorboard, progress_);
}

void Run::list_settings() {
    for (const train::RunOption& option : train::run_options())
        if (train::is_listed(option, options()))
            report_.settings.emplace_back(option.name, train::value_text(option, options()));
    for (auto& [name, value] : report_.settings)
        if (name == "device" && value.empty()) value = report_.summary.device + " (chosen by ewa)";
}

/// Thins new points that are too many for the device. Notes the largest number of splats, automatic unless options name it, and
/// returns its memory. A checkpoint keeps it.
MemoryEstimate Run::choose_cap() {
    const TrainOptions train = resolve(options().train, input_.dataset, input_.split.train);
    const auto needed = [&] {
        return std::make_unique<train::Needs>(*device_, input_.dataset, input_.split.train, input_.start,
                                              train);
    };
    std::unique_ptr<train::Needs> needs = needed();
    if (!earlier_ && train::thin_for_device(input_, *needs)) needs = needed();
    const SplatCap cap = needs->cap();
    report_.summary.max_splats = cap.splats;
    final_splats_ = needs->final_splats(cap.splats);
    saves_.settings()["cap"] = cap.splats;
    if (train.max_splats == kAutomaticMaxSplats && train.strategy != Strategy::none)
        input_.notes.push_back(fmt::format("at most {}: {}; --max-splats N sets another limit",
                                           core::counted(cap.splats, "splat"), cap.reason));
    if (train.final_splats == kAutomaticFinalSplats && final_splats_ > 0)
        input_.notes.push_back(
            fmt::format("at most {} in the last quarter: those that show most; --final-splats 0 keeps all",
                        core::counted(final_splats_, "splat")));
    const std::string full = train::check_disk_room(folder_.path(), input_.start.size(), cap.splats, train);
    if (!full.empty()) input_.remarks.push_back(full);
    return needs->memory(cap.splats);
}

/// The options with that number: the rule of the automatic one takes time on a large dataset.
TrainOptions Run::capped_options() const {
    TrainOptions capped = options().train;
    capped.max_splats = report_.summary.max_splats;
    capped.final_splats = final_splats_;
    return capped;
}

/// Opens the device and tells the observer what the run begins with.
void Run::start() {
    device_ = opening_.get();
    RunStart start;
    start.memory = choose_cap();
    report_.title = input_.name;
    report_.notes = input_.notes;
    report_.remarks = input_.remarks;
    report::Summary& summary = report_.summary;
    summary.device = device_info(*device_).name;
    summary.seed = options().train.seed;
    summary.version = EWA_VERSION;
    summary.command = options().command;
    summary.strategy = train::name_of(options().train.strategy);
    saves_.settings()["device"] = summary.device;

    const Camera& camera = input_.dataset.frames[size_t(input_.split.train.front())].camera;
    start.name = input_.name;
    start.dataset = &input_.dataset;
    start.train_views = input_.split.train.size();
    start.test_views = input_.split.test.size();
    start.width = camera.width;
    start.height = camera.height;
    start.splats = input_.start.size();
    start.train = options().train;
    start.max_splats = report_.summary.max_splats;
    start.evaluated = train::evaluated_views(input_.split);
    start.remarks = input_.notes;
    start.remarks.insert(start.remarks.end(), input_.remarks.begin(), input_.remarks.end());
    start.device = device_info(*device_);
    observer_.on_start(start);
}

/// A run that was stopped before its first step looks for them again.
void Run::leave_out_passers_by() {
    if (!options().robust) return;
    const std::string note = train::leave_out_passers_by(device_, input_, masks_, &observer_);
    saves_.settings()[train::kMasksSetting] = train::fingerprint_of(train::masks_of(input_));
    if (note.empty()) return;
    report_.notes.push_back(note);
    observer_.on_note(note);
}

/// Continues from the checkpoint, if there is one.
void Run::restore(Trainer& trainer) {
    if (!earlier_) return;
    train::CheckpointReader& reader = *earlier_->reader;
    const std::string remark = train::resume_remark(reader.checkpoint().settings, saves_.settings());
    if (!remark.empty()) {
        report_.remarks.push_back(remark);
        observer_.on_note(remark);
    }
    std::vector<MetricsLine>& metrics = progress_.metrics;
    train::TimesAt times;
    try {
        metrics = report::parse_metrics(reader.checkpoint().metrics);
        times = restored_times();
        reader.set_seconds(times.seconds);
        progress_.seconds_before += times.wall_seconds;
        saves_.continue_from(times);
        trainer.restore(reader);
    } catch (const InputError& error) {
        throw InputError(folder_.checkpoint().string() + ": " + error.what() + "; --force starts anew");
    }
    const StepReport& last = progress_.last = reader.head().report;
    report_.earlier_steps = last.step;
    const int steps = options().train.steps, before = earlier_->steps;
    // The checkpoint of a finished run lacks the line of its last evaluation, and the time that this took.
    if (steps > before && last.step == before)
        if (const auto line = folder_.logged(last.step)) progress_.take_later(*line, times.wall_seconds);
    observer_.on_note(
        fmt::format("resumed after step {} of {}{}", last.step, steps,
                    steps == before ? "" : fmt::format(", before which the run had --steps {}", before)));
    earlier_->reader.reset();
}

train::TimesAt Run::restored_times() {
    const train::CheckpointReader& reader = *earlier_->reader;
    const StepReport& report = reader.head().report;
    const train::TimesAt own = train::restored_times(
        folder_.times(), {report.step, report.seconds, reader.checkpoint().wall_seconds}, progress_.metrics);
    if (own.wall_seconds == 0) {
        report_.remarks.push_back("resumed without its earlier times, since times.json lacks them");
        observer_.on_note(report_.remarks.back());
    }
    return own;
}

/// The held-out views while the run trains. Cannot be stopped: a run that is resumed would not repeat it.
Evaluation Run::evaluate(Trainer& trainer) {
    const Gaussians gaussians = draws_with_ranks() ? Gaussians() : trainer.gaussians();
    if (cameras_.refine()) {
        cameras_.use_refined(trainer);
        cameras_.align_test(device_, gaussians, {});
    }
    const NewViewAppearance appearance =
        train::new_view_appearance(trainer.appearances(), input_.dataset, input_.split.train);
    Evaluation evaluation = train::evaluate_views(
        view_renderer(gaussians, trainer.sky(), &trainer), input_.dataset, input_.split.test,
        options().train.render, train::for_new_views(appearance, input_.dataset, input_.split.test),
        [&] { trainer.keep_waiting(); }, [](size_t, const train::RenderedView&, const EvalFrame&) {},
        measures_);
    cameras_.use_given();
    observer_.on_evaluation(progress_.last.step, evaluation);
    return evaluation;
}

/// Edits the splats for the observer, and notes it.
EditCounts Run::edit(Trainer& trainer, const SplatEdit& edit) {
    const EditCounts counts = trainer.edit(edit);
    progress_.last = trainer.report();
    observer_.on_metrics(log_->add({}, counts));
    observer_.on_note(train::edit_text(progress_.last.step, counts));
    return counts;
}

/// Evaluates, logs and saves as far as this step is due for it. before: steps done before it.
void Run::after_step(Trainer& trainer, int before) {
    const int step = progress_.last.step;
    // Whether the steps after `before` have a multiple of `every` among them.
    const auto at = [&](int every) { return every > 0 && step / every > before / every; };
    std::optional<Evaluation> evaluation;
    if (at(options().eval_every) && !input_.split.test.empty()) evaluation = evaluate(trainer);
    const int log_every = std::max(1, options().train.steps / 100);
    if (evaluation || before == 0 || at(log_every)) {
        progress_.last = trainer.report();  // the step's own, also where steps overlap
        observer_.on_metrics(log_->add(evaluation));
    }
    // The checkpoint comes first: with it alone, no step is lost where the disk is full.
    if (options().save_every == 0)
        saves_.checkpoint_if_due(trainer);
    else if (at(options().save_every)) {
        saves_.checkpoint(trainer);
        saves_.result(trainer, true);
    }
    observer_.between_steps(progress_.last, trainer,
                            {.save =
                                 [&] {
                                     saves_.checkpoint(trainer);
                                     saves_.result(trainer, false);
                                 },
                             .edit = [&](const SplatEdit& asked) { return edit(trainer, asked); }});
}

void Run::train(Trainer& trainer) {
    const int steps = options().train.steps;
    try {
        while (trainer.steps_done() < steps && !observer_.should_stop()) {
            const int before = trainer.steps_done();
            progress_.last = trainer.step();
            observer_.on_step(progress_.last);
            if (progress_.last.step < steps)
                after_step(trainer, before);  // finish() does so after the last step
        }
    } catch (const InputError&) {
        // An image that vanished is found before the step changes the splats. Other ranks may be in the middle of it.
        if (options().ranks->size() == 1) saves_.checkpoint(trainer);
        throw;
    } catch (const core::FullDisk&) {
        saves_.what_fits(trainer);
        throw;
    }
}

/// By all ranks from their shares; or by a renderer, without the trainer.
train::ViewRenderer Run::view_renderer(const Gaussians& gaussians, std::shared_ptr<const SkyMap> sky,
                                       const Trainer* trainer) const {
    RenderOptions look = options().train.render;
    look.sky = std::move(sky);
    if (!draws_with_ranks()) return train::view_renderer_of(device_, gaussians, look);
    return {size_t(options().ranks->size()),
            [trainer](std::span<const Camera> cameras) { return trainer->render(cameras); }};
}

void Run::fill_summary() {
    report::Summary& summary = report_.summary;
    summary.steps = progress_.last.step;
    summary.seconds = progress_.last.seconds;
    summary.splats = progress_.last.splats;
    summary.skipped_nonfinite = progress_.last.skipped_nonfinite;
    summary.dropped_updates = progress_.last.dropped_updates;
    summary.limited_steps = progress_.last.limited_steps;
    summary.peak_device_bytes = peak_device_bytes(*device_);
    summary.peak_host_bytes = train::peak_host_bytes(*device_);
    summary.wall_seconds = progress_.wall_seconds();
}

/// Saves the result. Gives back the trainer's memory if no rank draws with it.
train::TrainedScene Run::save_last(std::unique_ptr<Trainer>& trainer) {
    const StepReport& last = progress_.last;
    train::TrainedScene scene{device_, trainer->gaussians(), trainer->appearances(), trainer->sky(), {}};
    saves_.last_checkpoint(*trainer);  // from here on, neither a kill nor a full disk costs training
    saves_.splats(scene.gaussians);
    if (options().save_every > 0 && last.step % options().save_every == 0)
        saves_.kept_splats(scene.gaussians);
    if (cameras_.refine()) {
        cameras_.use_refined(*trainer);
        cameras_.save(folder_, false);
        report_.summary.cameras = cameras_.moves();
    }
    if (options().inria) train::save_inria(folder_.path(), input_, scene.gaussians, last.step);
    folder_.save_appearances(input_.dataset, input_.split.train, scene.appearances);
    folder_.save_sky(scene.sky);
    report_.times = train::report_times(trainer->step_times());
    report_.summary.ranks = trainer->rank_figures();
    report_.summary.chunks = trainer->chunk_figures();
    if (!draws_with_ranks()) trainer.reset();  // the renderer takes its memory
    if (options().train.device_memory_bytes > 0)
        device_->limit_memory(options().train.device_memory_bytes, {});
    observer_.on_saved(last);
    scene.renderer = view_renderer(scene.gaussians, scene.sky, trainer.get());
    return scene;
}

void Run::finish(std::unique_ptr<Trainer> trainer) {
    const train::TrainedScene scene = save_last(trainer);
    const auto keep_waiting = [&] {
        if (trainer) trainer->keep_waiting();
    };
    train::FinalEvaluation evaluation(observer_, input_, measures_, scene, keep_waiting, report_);
    const bool evaluated = evaluation.evaluate(cameras_, folder_);
    if (progress_.last.step > 0) observer_.on_metrics(log_->add(evaluation.of_test_views()));
    observer_.on_evaluated(progress_.last, scene.gaussians);
    const bool shown = evaluated && evaluation.add_full_size();
    trainer.reset();  // ends the other ranks
    report_.summary.interrupted = !shown;
    first_render_ = evaluation.first_render();
    fill_summary();
    if (options().robust) report_.left_out = train::left_out_views(input_);
    report_.cameras = train::camera_rows(input_.dataset);
    report_.metrics = progress_.metrics;
    for (std::string& text : train::edit_texts(progress_.metrics)) report_.notes.push_back(std::move(text));
    folder_.save_report(report_);
}

/// Tells the observer what the trainer skips, and what does not fit in its memory.
std::unique_ptr<Trainer> Run::make_trainer() {
    auto trainer =
        std::make_unique<Trainer>(device_, input_.dataset, input_.split.train,
                                  std::exchange(input_.start, {}), capped_options(), options().ranks);
    report_.plan = plan_of(*trainer, input_);
    observer_.on_plan(report_.plan);
    const auto chunks = trainer->chunk_figures();
    if (trainer->images_on_disk() > 0)
        observer_.on_note(fmt::format(
            "{} training images exceed {} and are read again for each step", trainer->images_on_disk(),
            chunks ? "--image-cache or a quarter of --device-memory"
                   : fmt::format("--image-cache {} MiB", options().train.image_cache_bytes >> 20)));
    if (chunks)
        observer_.on_note(fmt::format(
            "larger than --device-memory: the splats are in {} chunks, most of which wait in host memory",
            chunks->chunks));
    return trainer;
}

RunResult Run::run() {
    start();
    list_settings();
    train::agree(input_.options, saves_.settings(), saves_.settings().at("dataset").get<std::string>(),
                 input_.start, *device_);
    leave_out_passers_by();
    std::unique_ptr<Trainer> trainer = make_trainer();
    input_.images.clear();  // the trainer has them
    progress_.last.splats = trainer->splats();
    restore(*trainer);
    begin_files();
    observer_.on_begin(folder_.path(), progress_.metrics);
    try {
        train(*trainer);
        finish(std::move(trainer));
    } catch (const core::FullDisk& error) {
        throw RunError(error.what() + saves_.after_full_disk());
    }
    return {report_.summary, folder_.path(), first_render_};
}

/// The part of a rank other than 0: it reads the dataset, and writes nothing.
RunResult follow_training(const RunOptions& asked) {
    train::RunInput input = train::load_run(asked);
    const std::shared_ptr<gpu::Device> device = open_device(asked.device);
    train::agree(input.options, {}, train::dataset_fingerprint(input.dataset, input.split), input.start,
                 *device);
    if (input.options.robust) train::leave_out_passers_by(device, input, {}, nullptr);
    Trainer trainer(device, input.dataset, input.split.train, std::exchange(input.start, {}),
                    input.options.train, asked.ranks);
    input.images.clear();  // the trainer has them
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
