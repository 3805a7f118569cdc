// SPDX-License-Identifier: Apache-2.0
#include "cli/train_run.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <chrono>

#include "cli/accuracy.h"
#include "cli/dataset_argument.h"
#include "cli/interrupt.h"
#include "cli/output.h"
#include "cli/photograph_scene.h"
#include "cli/progress.h"
#include "cli/text.h"
#include "cli/train_files.h"
#include "cli/train_resume.h"
#include "cli/train_serve.h"
#include "core/atomic_file.h"
#include "core/folder_lock.h"
#include "core/text.h"
#include "ewa/error.h"
#include "ewa/splat_files.h"
#include "image/openimageio.h"
#include "pipeline/model.h"
#include "train/checkpoint.h"
#include "train/initialise.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;

// Splats to start from with --init random.
constexpr uint32_t kRandomSplats = 50000;
// Training views evaluated at the end; their mean says enough, and a large set would take longer than the
// training.
constexpr size_t kTrainViewsEvaluated = 40;

constexpr std::array<std::pair<const char*, Strategy>, 3> kStrategies{
    {{"none", Strategy::none}, {"adc", Strategy::adc}, {"mcmc", Strategy::mcmc}}};

/// What `auto` stands for: the options of adc ask for adc.
Strategy strategy_of(const TrainArguments& arguments) {
    for (const auto& [name, strategy] : kStrategies)
        if (arguments.strategy == name) return strategy;
    return arguments.absgrad || arguments.revised_opacity ? Strategy::adc : strategy_for(arguments.steps);
}

std::string strategy_name(const TrainArguments& arguments) {
    for (const auto& [name, strategy] : kStrategies)
        if (strategy_of(arguments) == strategy) return name;
    return {};
}

TrainOptions train_options(const TrainArguments& arguments) {
    TrainOptions options;
    options.steps = arguments.steps;
    options.strategy = strategy_of(arguments);
    if (options.strategy != Strategy::adc && (arguments.absgrad || arguments.revised_opacity))
        throw InputError("--absgrad and --revised-opacity are options of --strategy adc");
    options.max_splats = arguments.max_splats;
    options.sh_degree = arguments.draw.sh_degree;
    options.absolute_gradients = arguments.absgrad;
    options.revised_opacity = arguments.revised_opacity;
    options.exposure = arguments.exposure;
    options.halvings = arguments.resolution_schedule;
    options.seed = arguments.seed;
    options.image_cache_bytes = arguments.image_cache << 20;
    options.random_background = arguments.draw.random_background();
    options.render = arguments.draw.options();
    return options;
}

Gaussians start_splats(const TrainArguments& arguments, const Dataset& dataset,
                       const std::vector<int>& frames) {
    const int degree = arguments.draw.sh_degree;
    Gaussians start;
    if (arguments.init == "sfm") {
        if (dataset.dropped_points > 0)
            throw InputError(
                fmt::format("{}: a coordinate is not finite ({} such points in all); remove them, or start "
                            "from --init random",
                            dataset.first_dropped_point, dataset.dropped_points));
        if (!dataset.points.positions.empty()) start = gaussians_from_points(dataset.points, degree);
    }
    if (arguments.init == "random" || (arguments.init == "sfm" && start.size() == 0)) {
        const uint32_t count = std::min(kRandomSplats, arguments.max_splats);
        start = train::random_gaussians(dataset, frames, static_cast<int>(count), arguments.seed, degree);
    } else if (arguments.init != "sfm") {
        start = train::with_sh_degree(load_splats(arguments.init), degree);
    }
    if (start.size() > arguments.max_splats)
        throw InputError(fmt::format("there are {} splats to start from, more than --max-splats {}",
                                     start.size(), arguments.max_splats));
    return start;
}

using Clock = std::chrono::steady_clock;

/// What the run is called: the scene's file, else the dataset's folder.
std::string run_name(const TrainArguments& arguments) {
    return arguments.scene.empty() ? dataset_name(arguments.dataset) : arguments.scene.stem().string();
}

class TrainRun {
  public:
    TrainRun(const TrainArguments& arguments, Clock::time_point begin, std::unique_ptr<core::FolderLock> lock)
        : arguments_(arguments), begin_(begin), pace_(arguments.save_every), lock_(std::move(lock)) {}
    int run();

  private:
    double wall_seconds() const {
        return earlier_wall_ + std::chrono::duration<double>(Clock::now() - begin_).count();
    }
    void say(const std::string& line) const {
        if (!arguments_.quiet) fmt::print("{}\n", core::one_line(line));
    }
    void load();
    void settle_degree();
    void describe() const;
    void describe_plan(const std::vector<PlanLine>& plan);
    void resume(Trainer& trainer);
    void save_checkpoint(const Trainer& trainer);
    void train(Trainer& trainer, Progress& progress);
    void log(const StepReport& report, const std::optional<Evaluation>& evaluation);
    Evaluation judge_frames(const Gaussians& gaussians, const std::vector<int>& frames,
                            const std::vector<Exposure>& exposures = {}) const;
    double train_psnr(const Trainer& trainer, const Gaussians& gaussians) const;
    void save(const Gaussians& gaussians) const;
    void judge(const Trainer& trainer, const Gaussians& gaussians);
    void draw(const Gaussians& gaussians);
    int finish(const Trainer& trainer);
    void print_result() const;

    TrainArguments arguments_;
    TrainOptions options_;
    Clock::time_point begin_;
    double earlier_wall_ = 0;  // of the run that this one goes on from
    SavePace pace_;
    report::Json settings_;  // for the checkpoint
    std::optional<train::Checkpoint> earlier_;
    fs::path folder_, checkpoint_;
    std::unique_ptr<core::FolderLock> lock_;
    Dataset dataset_;
    Split split_;
    Gaussians start_;
    std::shared_ptr<gpu::Device> device_;
    std::optional<report::MetricsLog> log_file_;
    std::optional<TrainServer> server_;
    StepReport last_;
    std::optional<Evaluation> last_evaluation_;
    report::ReportData report_;
    fs::path first_picture_;
};

void TrainRun::load() {
    dataset_ =
        load_dataset(arguments_.dataset, {.downscale = arguments_.downscale, .masks = arguments_.masks});
    split_ = split_frames(dataset_, arguments_.test_every);
    if (split_.train.empty())
        throw InputError(fmt::format("{}: of {} images ({} missing) none is left to train on",
                                     arguments_.dataset.string(), dataset_.frames.size(),
                                     dataset_.missing_images));
    settle_degree();
    start_ = start_splats(arguments_, dataset_, split_.train);

    folder_ = arguments_.output.empty() ? fs::path("out") / run_name(arguments_) : arguments_.output;
    checkpoint_ = folder_ / "checkpoint.ewa";
    make_folder(folder_);
    if (!lock_) lock_ = std::make_unique<core::FolderLock>(folder_);
    core::remove_abandoned_files(folder_);
    settings_ = checkpoint_settings(arguments_, train::dataset_fingerprint(dataset_, split_));
    if (arguments_.resume && fs::exists(checkpoint_)) {
        earlier_ = train::read_checkpoint(checkpoint_);
        check_resumable(checkpoint_, earlier_->settings, settings_);
    }
    image::openimageio();  // the pictures at the end need it, even where the photographs do not
    // The first file written tells before the training whether the folder takes any.
    const report::Json config = to_config(arguments_);
    write_json(folder_ / "config.json", config);
    // An earlier run's figures must not stand beside this run's log if it fails.
    std::error_code absent;
    fs::remove(folder_ / "summary.json", absent);
    fs::remove(folder_ / "report.html", absent);
    fs::remove(folder_ / "exposures.json", absent);
    for (const auto& [name, value] : config.items())
        report_.settings.emplace_back(name, value.is_string() ? value.get<std::string>() : value.dump());

    report_.title = run_name(arguments_);
    if (arguments_.init == "sfm" && dataset_.points.positions.empty())
        report_.remarks.push_back("there are no points: random splats where the cameras look are the start");
    if (dataset_.missing_images > 0)
        report_.remarks.push_back(fmt::format("{} images are missing and left out", dataset_.missing_images));
    if (dataset_.dropped_points > 0)
        report_.remarks.push_back(fmt::format(
            "{} points have a coordinate that is not finite and are left out", dataset_.dropped_points));
}

/// What "auto" comes to.
void TrainRun::settle_degree() {
    int& degree = arguments_.draw.sh_degree;
    if (degree < 0) degree = sh_degree_for(dataset_);
    options_ = train_options(arguments_);
    if (degree == 0 && !dataset_.color_depends_on_view)
        report_.remarks.push_back("no colour depends on the view, says the dataset: SH degree 0");
}

void TrainRun::describe() const {
    const Camera& camera = dataset_.frames[split_.train.front()].camera;
    say(fmt::format("{}: {} views to train on, {} held out, {}x{}; {} splats to start from", report_.title,
                    split_.train.size(), split_.test.size(), camera.width, camera.height, start_.size()));
    for (const std::string& remark : report_.remarks) say(remark);
    say("device: " + report_.summary.device);
    const MemoryForecast memory = forecast_memory(*device_, dataset_, split_.train, start_, options_);
    say(fmt::format("memory: up to {} for {} splats ({} model, {} frame, {} photographs)",
                    bytes_text(memory.total()), memory.splats, bytes_text(memory.model),
                    bytes_text(memory.frame), bytes_text(memory.photographs)));
    const uint64_t there = device_info(*device_).memory_bytes;
    if (memory.total() > there)
        say(fmt::format(
            "the device has {}: if memory runs out, a smaller --max-splats, --image-cache or a larger "
            "--downscale takes less",
            bytes_text(there)));
}

void TrainRun::describe_plan(const std::vector<PlanLine>& plan) {
    std::vector<report::LeftOut> lines;
    for (const PlanLine& line : plan) lines.push_back({line.what, line.why, line.bytes_saved});
    report_.plan.insert(report_.plan.begin(), lines.begin(), lines.end());
    if (!arguments_.verbose) return;
    for (const report::LeftOut& line : report_.plan)
        say(fmt::format("left out: {} ({}{})", line.what, line.why,
                        line.bytes_saved > 0 ? ", saves " + bytes_text(line.bytes_saved) : ""));
}

/// Interrupted is thrown out of it.
Evaluation TrainRun::judge_frames(const Gaussians& gaussians, const std::vector<int>& frames,
                                  const std::vector<Exposure>& exposures) const {
    return evaluate(device_, gaussians, dataset_, frames, options_.render, exposures, stop_if_interrupted);
}

/// Of training views spread over the capture, each through its exposure where these were learned.
double TrainRun::train_psnr(const Trainer& trainer, const Gaussians& gaussians) const {
    const std::vector<int> frames = spread_out(split_.train, kTrainViewsEvaluated);
    const std::vector<Exposure> learned = trainer.exposures();
    std::vector<Exposure> exposures;
    for (size_t i = 0; i < split_.train.size() && !learned.empty(); ++i)
        if (std::find(frames.begin(), frames.end(), split_.train[i]) != frames.end())
            exposures.push_back(learned[i]);
    return judge_frames(gaussians, frames, exposures).psnr;
}

void TrainRun::log(const StepReport& step, const std::optional<Evaluation>& evaluation) {
    report::MetricsLine line;
    line.step = step.step;
    line.seconds = step.seconds;
    line.wall_seconds = wall_seconds();
    line.loss = step.loss;
    line.splats = step.splats;
    if (evaluation) {
        line.test_psnr = evaluation->psnr;
        line.test_ssim = evaluation->ssim;
    }
    log_file_->append(line);
    server_->add_metrics(line);
    report_.metrics.push_back(line);
}

void TrainRun::save(const Gaussians& gaussians) const {
    save_splats(folder_ / "splats.ply", gaussians,
                {fmt::format("Generated by ewa " EWA_VERSION " at step {}", last_.step),
                 fmt::format("SplatRenderMode: {}",
                             options_.render.kernel == Footprint::antialias ? "mip" : "default")});
}

void TrainRun::resume(Trainer& trainer) {
    settings_["device"] = report_.summary.device;
    if (earlier_) {
        const std::string remark = resume_remark(earlier_->settings, settings_);
        if (!remark.empty()) {
            report_.remarks.push_back(remark);
            say(remark);
        }
        try {
            trainer.restore(earlier_->state);
            report_.metrics = report::parse_metrics(earlier_->metrics);
        } catch (const InputError& error) {
            throw InputError(checkpoint_.string() + ": " + error.what() +
                             "; without --resume the training starts anew");
        }
        earlier_wall_ = earlier_->wall_seconds;
        last_ = earlier_->state.report;
        say(fmt::format("resumed after step {} of {}", last_.step, arguments_.steps));
        earlier_.reset();
    }
    log_file_.emplace(folder_ / "metrics.jsonl", report_.metrics);
    server_.emplace(arguments_.serve, folder_, arguments_.steps);
    for (const report::MetricsLine& line : report_.metrics) server_->add_metrics(line);
    if (const std::string line = server_->announcement(); !line.empty()) say(line);
}

void TrainRun::save_checkpoint(const Trainer& trainer) {
    const auto start = Clock::now();
    train::write_checkpoint(checkpoint_,
                            {settings_.dump(-1, ' ', false, report::Json::error_handler_t::replace),
                             report::metrics_text(report_.metrics), wall_seconds(), trainer.state()});
    pace_.saved(std::chrono::duration<double>(Clock::now() - start).count());
}

void TrainRun::train(Trainer& trainer, Progress& progress) {
    const int report_every = std::max(1, arguments_.steps / 100);
    auto at = [](int step, int every) { return every > 0 && step % every == 0; };
    while (trainer.steps_done() < arguments_.steps && !interrupted()) {
        last_ = trainer.step();
        const int step = last_.step;
        if (progress.due(step))
            progress.update(step, fmt::format("loss {:.4f}, {} splats", last_.loss, last_.splats));
        if (step == arguments_.steps) break;  // finish() evaluates and saves

        std::optional<Evaluation> evaluation;
        if (at(step, arguments_.eval_every) && !split_.test.empty()) {
            // To its end: a run that is resumed would not come back to it.
            evaluation = evaluate(device_, trainer.gaussians(), dataset_, split_.test, options_.render);
            progress.note(fmt::format("step {}: held-out PSNR {:.2f} dB, SSIM {:.4f}", step, evaluation->psnr,
                                      evaluation->ssim));
        }
        if (evaluation || step == 1 || at(step, report_every)) log(last_, evaluation);
        if (pace_.due(step)) save_checkpoint(trainer);
        if (at(step, arguments_.save_every)) save(trainer.gaussians());
        server_->attend(trainer, last_, [&] {
            save(trainer.gaussians());
            save_checkpoint(trainer);
        });
    }
}

/// The figures of a training that ran to its end.
void TrainRun::judge(const Trainer& trainer, const Gaussians& gaussians) {
    say("evaluating");
    if (!split_.test.empty()) {
        last_evaluation_ = judge_frames(gaussians, split_.test);
        report_.summary.test_psnr = last_evaluation_->psnr;
        report_.summary.test_ssim = last_evaluation_->ssim;
    }
    report_.summary.train_psnr = train_psnr(trainer, gaussians);
}

/// What the report shows of it.
void TrainRun::draw(const Gaussians& gaussians) {
    const auto frames = spread_out(report_.held_out ? split_.test : split_.train, kReportPictures);
    const fs::path subfolder = folder_ / (report_.held_out ? "test" : "train");
    report_.pictures =
        draw_report_pictures({device_, gaussians, dataset_, frames, options_.render}, subfolder);
    first_picture_ = subfolder / (report::picture_names(dataset_.frames)[frames.front()].string() + ".png");
    if (!arguments_.accuracy) return;
    stop_if_interrupted();
    const auto view = report_.held_out ? split_.test.front() : split_.train.front();
    report_.work_precision.push_back(
        rendering_diagram(device_, gaussians, dataset_.frames[view].camera, options_.render));
}

int TrainRun::finish(const Trainer& trainer) {
    const Gaussians gaussians = trainer.gaussians();
    save(gaussians);
    if (options_.exposure)
        write_json(folder_ / "exposures.json", exposures_json(dataset_, split_.train, trainer.exposures()));
    save_checkpoint(trainer);  // a kill from here on costs no training

    const bool judged = done_uninterrupted([&] { judge(trainer, gaussians); });
    if (last_.step > 0) log(last_, last_evaluation_);
    server_->finish(last_, gaussians);
    report_.held_out = !split_.test.empty();
    const bool cut_short = !judged || !done_uninterrupted([&] { draw(gaussians); });

    for (const PassTime& time : trainer.pass_times())
        report_.pass_times.push_back({time.pass, time.milliseconds});
    report::Summary& summary = report_.summary;
    summary.steps = last_.step;
    summary.seconds = last_.seconds;
    summary.splats = static_cast<uint32_t>(gaussians.size());
    summary.skipped_nonfinite = last_.skipped_nonfinite;
    summary.dropped_updates = last_.dropped_updates;
    summary.limited_steps = last_.limited_steps;
    summary.interrupted = cut_short;
    summary.peak_device_bytes = peak_device_bytes(*device_);
    summary.peak_host_bytes = peak_host_bytes(*device_);
    summary.wall_seconds = wall_seconds();
    write_json(folder_ / "summary.json", report::to_json(summary));
    write_report(folder_ / "report.html", report_);
    print_result();
    return cut_short ? kInterruptedStatus : 0;
}

void TrainRun::print_result() const {
    const report::Summary& s = report_.summary;
    say(fmt::format("{} {} steps in {} of training ({} in all), {} splats",
                    s.interrupted ? "interrupted after" : "trained", s.steps, duration_text(s.seconds),
                    duration_text(s.wall_seconds), s.splats));
    if (s.test_psnr) say(fmt::format("held-out PSNR {:.2f} dB, SSIM {:.4f}", *s.test_psnr, *s.test_ssim));
    if (s.train_psnr) say(fmt::format("training PSNR {:.2f} dB", *s.train_psnr));
    if (s.skipped_nonfinite > 0)
        say(fmt::format("{} splats are not finite and not drawn", s.skipped_nonfinite));
    if (s.dropped_updates > 0) say(fmt::format("{} updates were not finite and dropped", s.dropped_updates));
    if (s.limited_steps > 0)
        say(fmt::format("{} steps were too long for their splat and shortened", s.limited_steps));
    say("splats:  " + (folder_ / "splats.ply").string());
    say("report:  " + (folder_ / "report.html").string());
    if (!first_picture_.empty()) say("picture: " + first_picture_.string());
}

int TrainRun::run() {
    load();
    device_ = open_device(arguments_.device);
    report::Summary& summary = report_.summary;
    summary.device = device_info(*device_).name;
    summary.seed = arguments_.seed;
    summary.version = EWA_VERSION;
    summary.command = arguments_.command_line;
    summary.strategy = strategy_name(arguments_);
    if (arguments_.draw.sh_degree == 0 && !dataset_.color_depends_on_view) {
        // Parameters and both of Adam's moments.
        const auto splats = uint32_t(start_.size());
        report_.plan.push_back(
            {fmt::format("SH degrees 1 to {}", kMaxShDegree),
             "the dataset says that no colour depends on the view",
             3 * (pipeline::parameter_bytes(splats, kMaxShDegree) - pipeline::parameter_bytes(splats, 0))});
    }
    describe();

    const InterruptWatch watch;
    Trainer trainer(device_, dataset_, split_.train, start_, options_);
    start_ = {};
    describe_plan(trainer.plan());
    if (trainer.photographs_on_disk() > 0)
        say(fmt::format("{} photographs do not fit in --image-cache {} and are read again for each step",
                        trainer.photographs_on_disk(), arguments_.image_cache));
    last_.splats = trainer.splats();
    resume(trainer);
    {
        Progress progress("trained", arguments_.steps, "steps", arguments_.quiet);
        try {
            train(trainer, progress);
        } catch (const InputError&) {
            // A photograph that is gone is met before the step begins: what was trained is whole.
            save_checkpoint(trainer);
            throw;
        }
    }
    return finish(trainer);
}

}  // namespace

report::Json to_config(const TrainArguments& a) {
    report::Json json;
    json["dataset"] = (a.scene.empty() ? a.dataset : a.scene).string();
    json["steps"] = a.steps;
    json["strategy"] = strategy_name(a);
    json["max-splats"] = a.max_splats;
    json["sh-degree"] = a.draw.sh_degree;
    json["absgrad"] = a.absgrad;
    json["revised-opacity"] = a.revised_opacity;
    json["exposure"] = a.exposure;
    json["resolution-schedule"] = a.resolution_schedule;
    json["init"] = a.init;
    json["downscale"] = a.downscale;
    json["masks"] = masks_text(a.masks);
    json["test-every"] = a.test_every;
    json["seed"] = a.seed;
    json["image-cache"] = a.image_cache;
    json["background"] = a.draw.background;
    json["kernel"] = a.draw.antialias ? "antialias" : a.draw.kernel;
    json["eval-every"] = a.eval_every;
    json["save-every"] = a.save_every;
    json["device"] = a.device.selector;
    return json;
}

int run_train(const TrainArguments& given) {
    const Clock::time_point begin = Clock::now();
    TrainArguments arguments = given;
    train_options(arguments);  // what is wrong with them is said before any work
    std::unique_ptr<core::FolderLock> lock;
    const std::string extension = core::lower(arguments.dataset.extension().string());
    if (extension == ".gltf" || extension == ".glb") {
        arguments.scene = arguments.dataset;
        if (arguments.output.empty()) arguments.output = fs::path("out") / run_name(arguments);
        arguments.dataset = arguments.output / "dataset";
        // Another training may be reading the photographs that are there.
        if (fs::is_directory(arguments.output)) lock = std::make_unique<core::FolderLock>(arguments.output);
        const Photographs made = photograph_with_progress(arguments.device, arguments.scene,
                                                          arguments.dataset, {}, arguments.quiet);
        if (made.interrupted || interrupted()) return kInterruptedStatus;
    }
    return TrainRun(arguments, begin, std::move(lock)).run();
}

}  // namespace ewa::cli
