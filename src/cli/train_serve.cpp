// SPDX-License-Identifier: Apache-2.0
#include "cli/train_serve.h"

#include <spdlog/fmt/fmt.h>

#include <chrono>
#include <thread>

#include "cli/interrupt.h"
#include "core/text.h"
#include "ewa/error.h"
#include "live/watcher.h"

namespace ewa::cli {
namespace {

constexpr auto kPausedLook = std::chrono::milliseconds(20);
constexpr const char* kHere = "127.0.0.1";

}  // namespace

TrainServer::TrainServer(const std::string& where, const std::filesystem::path& folder, int steps)
    : steps_(steps), folder_(folder) {
    if (where.empty()) return;
    const size_t colon = where.rfind(':');
    address_ = colon == std::string::npos ? kHere : where.substr(0, colon);
    if (address_.empty()) address_ = kHere;
    if (address_.size() > 2 && address_.front() == '[') address_ = address_.substr(1, address_.size() - 2);
    const auto port = core::parse_integer<uint16_t>(
        std::string_view(where).substr(colon == std::string::npos ? 0 : colon + 1));
    if (!port.has_value())
        throw InputError("--serve: '" + where + "' is not a port, or address:port; 0 takes any free port");
    const std::string token = live::random_token();
    server_ = std::make_unique<live::Server>(address_, *port, token);
    live::write_live_file(folder_, {server_->port(), token});
}

TrainServer::~TrainServer() {
    if (!server_) return;
    std::error_code absent;
    std::filesystem::remove(folder_ / live::kLiveFile, absent);
}

std::string TrainServer::announcement() const {
    if (!server_) return {};
    const bool v6 = address_.find(':') != std::string::npos;
    const std::string where = fmt::format("{}:{}", v6 ? "[" + address_ + "]" : address_, server_->port());
    return fmt::format("to watch: ewa-view {}, ewa-view --connect {}, or curl http://{}/status",
                       folder_.string(), where, where);
}

void TrainServer::add_metrics(const report::MetricsLine& line) {
    if (server_) server_->add_metrics(line);
}

void TrainServer::report(const StepReport& report, live::State state) {
    server_->report({.step = report.step,
                     .steps = steps_,
                     .splats = report.splats,
                     .loss = report.loss,
                     .seconds = report.seconds,
                     .state = state});
}

void TrainServer::attend(const Trainer& trainer, const StepReport& step, const std::function<void()>& save) {
    if (!server_) return;
    report(step, live::State::running);
    for (;;) {
        if (server_->wants_splats(step.step)) {
            const auto start = std::chrono::steady_clock::now();
            live::Snapshot snapshot{step.step, trainer.gaussians()};
            const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
            server_->offer(std::move(snapshot), taken.count());
        }
        if (server_->take_save()) save();
        if (!server_->paused() || interrupted()) return;
        std::this_thread::sleep_for(kPausedLook);
    }
}

void TrainServer::finish(const StepReport& step, const Gaussians& gaussians) {
    if (!server_) return;
    server_->offer({step.step, gaussians}, 0);
    report(step, live::State::done);
}

}  // namespace ewa::cli
