// SPDX-License-Identifier: Apache-2.0
#include "cli/train_observer.h"

#include <spdlog/fmt/fmt.h>

#include <chrono>
#include <cmath>
#include <thread>
#include <utility>

#include "cli/live_edit.h"
#include "cli/metric_arguments.h"
#include "cli/splat_statistics.h"
#include "core/messages.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "folders/run_folder.h"
#include "live/server.h"
#include "live/watcher.h"
#include "platform/terminal.h"
#include "report/summary.h"
#include "scene/splat_arrays.h"

namespace ewa::cli {

namespace {

/// What [ADDRESS:]PORT says.
struct ServedAt {
    std::string address = "127.0.0.1";
    uint16_t port = 0;
};
ServedAt served_at(const std::string& where) {
    ServedAt result;
    const size_t colon = where.rfind(':');
    if (colon != std::string::npos && colon > 0) result.address = where.substr(0, colon);
    if (result.address.size() > 2 && result.address.front() == '[')
        result.address = result.address.substr(1, result.address.size() - 2);
    const auto port = core::parse_integer<uint16_t>(std::string_view(where).substr(colon + 1));
    if (!port.has_value())
        throw InputError("--serve: '" + where + "' is not a port, or address:port; 0 takes any free port");
    result.port = *port;
    return result;
}

}  // namespace

void check_serve(const std::string& where) {
    if (where.empty()) return;
    const ServedAt at = served_at(where);
    const live::Server server(at.address, at.port, {});
}

/// The server of --serve.
class TrainObserver::Served {
  public:
    /// where: [ADDRESS:]PORT. steps: of the whole training. folder/live.json holds the token while this lives.
    /// page: see Server::describe. Throws InputError, RunError.
    Served(const std::string& where, const std::filesystem::path& folder, int steps, const SaveOptions& page)
        : steps_(steps), folder_(folder) {
        const ServedAt at = served_at(where);
        address_ = at.address;
        const std::string token = live::random_token();
        server_ = std::make_unique<live::Server>(address_, at.port, token);
        server_->describe(page);
        live::write_live_file(folder_, {server_->port(), token});
    }
    ~Served() {
        std::error_code absent;
        std::filesystem::remove(folder_ / folders::kLiveFile, absent);
    }

    /// One line that says how to watch.
    std::string announcement() const {
        const bool v6 = address_.find(':') != std::string::npos;
        const std::string where = fmt::format("{}:{}", v6 ? "[" + address_ + "]" : address_, server_->port());
        return fmt::format(
            "to watch: http://{}/ in a browser, ewa-view {}, ewa-view --connect {}, or curl http://{}/status",
            where, folder_.string(), where, where);
    }
    void add_metrics(const MetricsLine& line) { server_->add_metrics(line); }
    /// Edits, takes splats and saves if somebody asked for it. Returns late if somebody pauses the training: after the
    /// pause, or at an interruption. step: the observer's, which follows an edit.
    void attend(const Trainer& trainer, const StepReport& step, const RunCommands& commands) {
        constexpr auto kPausedLook = std::chrono::milliseconds(20);
        report(step, live::State::running);
        for (;;) {
            const auto perform = [&](const std::string& body) {
                const EditCounts counts =
                    commands.edit(live_edit(trainer.gaussians(), trainer.frozen(), body));
                return live::EditReply{step.step, step.splats, counts};
            };
            if (server_->perform_edits(perform)) report(step, live::State::running);
            if (server_->wants_splats(step.step)) {
                const auto start = std::chrono::steady_clock::now();
                live::Snapshot snapshot{step.step, trainer.gaussians(), trainer.frozen()};
                const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
                server_->offer(std::move(snapshot), taken.count());
            }
            if (server_->take_save()) commands.save();
            if (!server_->paused() || interrupted()) return;
            trainer.keep_waiting();
            std::this_thread::sleep_for(kPausedLook);
        }
    }
    /// Shows the last splats, and that the training is done.
    void finish(const StepReport& step, const Gaussians& gaussians) {
        server_->offer({step.step, gaussians}, 0);
        report(step, live::State::done);
    }

  private:
    void report(const StepReport& report, live::State state) {
        server_->report({.step = report.step,
                         .steps = steps_,
                         .splats = report.splats,
                         .loss = report.loss,
                         .seconds = report.seconds,
                         .state = state});
    }

    int steps_;
    std::filesystem::path folder_;
    std::string address_;
    std::unique_ptr<live::Server> server_;
};

TrainObserver::TrainObserver(const TrainOutput& output, int steps, std::unique_ptr<Progress> progress)
    : output_(output), steps_(steps), progress_(std::move(progress)) {}

TrainObserver::~TrainObserver() = default;

void TrainObserver::on_note(const std::string& line) {
    if (progress_)
        progress_->note(line);
    else if (!output_.quiet)
        fmt::print("{}\n", core::one_line(line));
}

void TrainObserver::on_start(const RunStart& start) {
    on_note(fmt::format("{}: {} to train on, {} held out, {}x{}; {} to start from", start.name,
                        core::counted(start.train_views, "view"), start.test_views, start.width, start.height,
                        core::counted(start.splats, "splat")));
    for (const std::string& remark : start.remarks) on_note(remark);
    if (!output_.serve.empty()) {
        cameras_.frames = start.dataset->frames;
        page_.antialiased = start.train.render.kernel == Footprint::antialias;
        page_.page = {.title = start.name, .cameras = &cameras_, .background = start.train.render.background};
    }
    on_note("device: " + start.device.name);
    const MemoryEstimate& memory = start.memory;
    on_note(fmt::format("memory: up to {} for {} splats ({} model, {} frame, {} training images)",
                        core::bytes_text(memory.total()), memory.splats, core::bytes_text(memory.model),
                        core::bytes_text(memory.frame), core::bytes_text(memory.images)));
    if (memory.total() > start.device.memory_bytes)
        on_note(
            fmt::format("the device has {}: if memory runs out, a smaller --max-splats or --image-cache, or "
                        "a larger --downscale, takes less; --device-memory keeps splats in host memory",
                        core::bytes_text(start.device.memory_bytes)));
    forecast_.emplace(train::ForecastScene{.pixels = double(start.width) * start.height,
                                           .photos = start.train_views,
                                           .splats = uint32_t(start.splats),
                                           .evaluated = start.evaluated,
                                           .max_splats = start.max_splats},
                      start.train);
    watch_.emplace();
}

void TrainObserver::on_plan(const std::vector<PlanLine>& plan) {
    if (!output_.verbose) return;
    for (const PlanLine& line : plan)
        on_note(fmt::format("left out: {} ({}{})", line.what, line.why,
                            line.bytes_saved > 0 ? ", saves " + core::bytes_text(line.bytes_saved) : ""));
}

void TrainObserver::on_begin(const std::filesystem::path& folder, const std::vector<MetricsLine>& metrics) {
    if (!output_.serve.empty()) {
        served_ = std::make_unique<Served>(output_.serve, folder, steps_, page_);
        for (const MetricsLine& line : metrics) served_->add_metrics(line);
        on_note(served_->announcement());
    }
    if (progress_)
        progress_->begin("trained", steps_, "steps");
    else
        progress_ = std::make_unique<Progress>("trained", steps_, "steps", output_.quiet);
}

/// Says early how long the run takes, and what would be shorter.
void TrainObserver::forecast(const StepReport& step) {
    constexpr double kLong = 60, kVeryLong = 600;  // s
    constexpr int kShortRun = 2000;                // steps of --quality low
    forecast_->add(step.step, step.seconds, step.splats);
    if (first_step_ == 0) {
        first_step_ = step.step;
        progress_->skip(step.step);
    }
    if (!forecast_->known()) return;
    const double left = forecast_->left();
    progress_->set_left(left);
    if (std::exchange(printed_time_, true) || left < kLong || step.step >= steps_) return;
    const double whole = left + progress_->seconds();
    std::string line = fmt::format("the training takes about {} on this device", core::duration_text(whole));
    if (whole > kVeryLong && steps_ > kShortRun && first_step_ < kShortRun)
        line +=
            fmt::format(", with --quality low about {}", core::duration_text(forecast_->of_steps(kShortRun)));
    on_note(line);
}

void TrainObserver::on_step(const StepReport& step) {
    if (std::isfinite(step.psnr)) {
        psnr_sum_ += step.psnr;
        ++psnr_steps_;
    }
    const bool due = progress_->due(step.step);
    if (due || !printed_time_)
        forecast(step);
    else
        forecast_->add(step.step, step.seconds, step.splats);
    if (!due) return;
    const std::string psnr =
        psnr_steps_ > 0 ? fmt::format(", PSNR {:.1f} dB", psnr_sum_ / psnr_steps_) : std::string();
    progress_->update(step.step, fmt::format("loss {:.4f}{}, {} splats", step.loss, psnr, step.splats));
    psnr_sum_ = psnr_steps_ = 0;
}

void TrainObserver::on_evaluation(int step, const Evaluation& evaluation) {
    if (!evaluation.frames.empty())
        on_note(fmt::format("step {}: held-out PSNR {:.2f} dB, SSIM {:.4f}", step, evaluation.psnr,
                            evaluation.ssim));
}

void TrainObserver::on_metrics(const MetricsLine& line) {
    if (served_) served_->add_metrics(line);
}

void TrainObserver::between_steps(const StepReport& step, const Trainer& trainer,
                                  const RunCommands& commands) {
    if (served_) served_->attend(trainer, step, commands);
}

void TrainObserver::on_saved(const StepReport&) {
    progress_.reset();
}

void TrainObserver::on_view(size_t done, size_t views) {
    // A file gets the note that comes before.
    if (!platform::redraws()) return;
    if (!progress_) progress_ = std::make_unique<Progress>("evaluated", int(views), "views", output_.quiet);
    progress_->update(int(done));
}

void TrainObserver::on_evaluated(const StepReport& step, const Gaussians& gaussians) {
    if (progress_) progress_->clear();
    progress_.reset();
    undrawable_ = scene::undrawable_text(gaussians);
    if (served_) served_->finish(step, gaussians);
}

void TrainObserver::print(const RunResult& result) {
    const Summary& s = result.summary;
    const bool all_steps = s.steps >= steps_;
    on_note(fmt::format("{} {} in {} of training ({} in all), {}",
                        s.interrupted && !all_steps ? "interrupted after" : "trained",
                        core::counted(uint64_t(s.steps), "step"), core::duration_text(s.seconds),
                        core::duration_text(s.wall_seconds), core::counted(s.splats, "splat")));
    if (s.test_psnr)
        on_note(fmt::format(
            "held-out PSNR {:.2f} dB, SSIM {:.4f}{}", *s.test_psnr, *s.test_ssim,
            s.cameras && s.cameras->test_aligned ? ", with cameras aligned to their images" : ""));
    if (const std::string text = figures_text(s.test_figures); !text.empty()) on_note("held-out " + text);
    if (s.train_psnr) on_note(fmt::format("training PSNR {:.2f} dB", *s.train_psnr));
    if (s.cameras) on_note(report::cameras_text(*s.cameras));
    if (s.skipped_nonfinite > 0) on_note(skipped_text(s.skipped_nonfinite, undrawable_));
    if (s.dropped_updates > 0)
        on_note("dropped " + core::counted(s.dropped_updates, "update") + " that were not finite");
    if (report::shortens_many(s))
        on_note("shortened " + core::counted(s.limited_steps, "update") +
                " that were too long for their splat");
    on_note("splats:  " + (result.folder / folders::kSplatsFile).string());
    on_note("report:  " + (result.folder / folders::kReportFile).string());
    if (!result.first_render.empty()) on_note("render:  " + result.first_render.string());
    if (s.interrupted)
        on_note(fmt::format("{}: ewa train {} --resume",
                            all_steps ? "the evaluation was interrupted; to complete it" : "to continue",
                            result.folder.string()));
}

}  // namespace ewa::cli
