// SPDX-License-Identifier: Apache-2.0
#include "live/watcher.h"

#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/atomic_file.h"
#include "core/json.h"
#include "ewa/error.h"
#include "ewa/splat_files.h"

namespace ewa::live {
namespace {

namespace fs = std::filesystem;
using report::Json;

constexpr auto kPause = std::chrono::milliseconds(250);  // between looks
constexpr std::uintmax_t kLargestMetrics = 256u << 20;   // bytes
constexpr size_t kLargestLiveFile = 4096;                // bytes
constexpr std::uintmax_t kLargestConfig = 1u << 20;      // bytes

std::string start_of(const fs::path& path, size_t most) {
    std::ifstream file(path, std::ios::binary);
    std::string text(most, '\0');
    file.read(text.data(), std::streamsize(most));
    text.resize(size_t(std::max<std::streamsize>(0, file.gcount())));
    return text;
}

/// How many steps the run's settings ask for; 0 where that cannot be read.
int steps_of(const fs::path& folder) {
    try {
        const Json json =
            core::parse_json<Json>(start_of(folder / "config.json", kLargestConfig), "config.json");
        return int(report::whole_number(json, "steps", INT32_MAX));
    } catch (const InputError&) {
        return 0;
    }
}

}  // namespace

std::optional<LiveFile> read_live_file(const fs::path& folder) {
    Json json;
    try {
        json = core::parse_json<Json>(start_of(folder / kLiveFile, kLargestLiveFile), kLiveFile);
    } catch (const InputError&) {
        return std::nullopt;  // none, half a one, or no longer one
    }
    if (!json.is_object() || !json.contains("port") || !json["port"].is_number_unsigned() ||
        !json.contains("token") || !json["token"].is_string())
        return std::nullopt;
    const auto port = json["port"].get<uint64_t>();
    if (port == 0 || port > 65535) return std::nullopt;
    return LiveFile{uint16_t(port), json["token"].get<std::string>()};
}

void write_live_file(const fs::path& folder, const LiveFile& live) {
    const std::string text = Json{{"port", live.port}, {"token", live.token}}.dump() + "\n";
    core::write_text_file(folder / kLiveFile, text, core::AtomicFile::Readers::owner);
}

Watcher::Watcher(WhatToWatch what, std::function<void()> on_news)
    : what_(std::move(what)),
      on_news_(std::move(on_news)),
      splats_time_(what_.splats_after),
      thread_([this] { work(); }) {}

Watcher::~Watcher() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    wake_.notify_one();
    thread_.join();
}

Update Watcher::update() const {
    const std::lock_guard lock(mutex_);
    return update_;
}

uint64_t Watcher::number() const {
    const std::lock_guard lock(mutex_);
    return update_.number;
}

void Watcher::command(const std::string& name) {
    const std::lock_guard lock(mutex_);
    commands_.push_back(name);
    wake_.notify_one();
}

void Watcher::change(const std::function<void(Update&)>& change) {
    {
        const std::lock_guard lock(mutex_);
        change(update_);
        ++update_.number;
    }
    on_news_();
}

std::optional<std::string> Watcher::next_command() {
    const std::lock_guard lock(mutex_);
    if (commands_.empty()) return std::nullopt;
    std::string name = commands_.front();
    commands_.erase(commands_.begin());
    return name;
}

void Watcher::work() {
    for (;;) {
        std::string problem;
        try {
            look();
        } catch (const std::exception& error) {
            client_.reset();
            run_.clear();
            tag_.clear();
            problem = error.what();
        }
        if (update().problem != problem || update().connected != bool(client_))
            change([&](Update& update) {
                update.problem = problem;
                update.connected = bool(client_);
            });
        std::unique_lock lock(mutex_);
        wake_.wait_for(lock, kPause, [this] { return stop_ || !commands_.empty(); });
        if (stop_) return;
    }
}

void Watcher::look() {
    if (!client_ && what_.address) client_ = std::make_unique<Client>(*what_.address, what_.token, &stop_);
    if (!client_ && !what_.folder.empty()) {
        try {
            if (const auto live = read_live_file(what_.folder)) {
                auto client = std::make_unique<Client>(Address{"127.0.0.1", live->port}, live->token, &stop_);
                client->status(UINT32_MAX);
                client_ = std::move(client);
            }
        } catch (const std::exception&) {
            // The trainer that wrote the file has gone, or belongs to another user. The run's files remain.
        }
    }
    if (client_) return look_by_connection();
    if (!what_.folder.empty()) look_at_files();
    if (next_command()) throw InputError("the training cannot be reached; start it with --serve");
}

void Watcher::look_by_connection() {
    while (const auto name = next_command()) client_->command(*name);
    const Update before = update();
    Status status = client_->status(run_.empty() ? 0 : before.status.metrics.size());
    const bool fresh = status.run != run_;
    if (fresh && !run_.empty()) status = client_->status(0);
    run_ = status.run;
    if (fresh) tag_.clear();
    std::optional<TaggedSplats> splats = client_->splats(tag_);
    if (splats) tag_ = splats->tag;
    const bool same = !splats && status.metrics.empty() && status.step == before.status.step &&
                      status.state == before.status.state && before.connected;
    if (same) return;
    change([&](Update& update) {
        if (fresh) {
            update.status.metrics.clear();
            update.splats_step = -1;
        }
        auto metrics = std::move(update.status.metrics);
        metrics.insert(metrics.end(), status.metrics.begin(), status.metrics.end());
        update.status = std::move(status);
        update.status.metrics = std::move(metrics);
        update.connected = true;
        if (!splats) return;
        update.splats = std::make_shared<const Gaussians>(std::move(splats->gaussians));
        update.splats_step = splats->step;
    });
}

void Watcher::read_metrics() {
    const fs::path path = what_.folder / "metrics.jsonl";
    std::error_code error;
    const std::uintmax_t bytes = fs::file_size(path, error);
    if (error || bytes == metrics_read_ || fs::last_write_time(path, error) <= what_.metrics_after) return;
    if (bytes > kLargestMetrics) throw InputError(path.string() + ": too large");
    std::string text = start_of(path, size_t(bytes));
    text.resize(text.rfind('\n') == std::string::npos ? 0
                                                      : text.rfind('\n') + 1);  // a line may be half written
    std::vector<report::MetricsLine> lines;
    try {
        lines = report::parse_metrics(text);
    } catch (const InputError& bad) {
        throw InputError(path.string() + ": " + bad.what());
    }
    metrics_read_ = bytes;
    if (lines.empty()) return;
    change([&](Update& update) {
        const report::MetricsLine& last = lines.back();
        update.status.step = last.step;
        update.status.steps = steps_of(what_.folder);
        update.status.splats = last.splats;
        update.status.loss = last.loss;
        update.status.seconds = last.seconds;
        std::error_code absent;
        update.status.state =
            fs::exists(what_.folder / "summary.json", absent) ? State::done : State::running;
        update.status.commands = false;
        update.status.metrics = std::move(lines);
    });
}

void Watcher::look_at_files() {
    read_metrics();
    const fs::path path = what_.folder / "splats.ply";
    std::error_code error;
    const auto time = fs::last_write_time(path, error);
    if (error || time <= splats_time_) return;
    auto splats = std::make_shared<const Gaussians>(load_splats(path));
    splats_time_ = time;
    change([&](Update& update) {
        update.splats = std::move(splats);
        update.splats_step = update.status.step;
    });
}

}  // namespace ewa::live
