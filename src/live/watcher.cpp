// SPDX-License-Identifier: Apache-2.0
#include "live/watcher.h"

#include <httplib.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/atomic_file.h"
#include "core/json.h"
#include "core/json_field.h"
#include "core/text.h"
#include "ewa/error.h"
#include "ewa/splat_files.h"
#include "folders/run_folder.h"
#include "io/splats/formats.h"
#include "io/splats/ply_table.h"
#include "live/wire.h"
#include "platform/file.h"
#include "platform/file_facts.h"

namespace ewa::live {
namespace {

namespace fs = std::filesystem;
using report::Json;

constexpr int kConnectSeconds = 3;
constexpr uint64_t kMostHeader = 8192;                   // bytes of an answer before its body
constexpr uint64_t kMostText = 16u << 20;                // bytes of a body that is text
constexpr uint64_t kMostSplats = uint64_t(1) << 33;      // bytes of a body that is splats
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

/// Which splats of a trainer's PLY are frozen. Empty: none is.
std::vector<bool> frozen_in(const std::string& path) {
    io::PlyTable table(path);
    const io::PlyElement& vertex = table.go_to("vertex");
    std::vector<bool> frozen;
    if (const auto column = vertex.find_number(kFrozenProperty))
        table.read({*column}, [&](size_t, const double* row) { frozen.push_back(row[0] != 0); });
    if (std::ranges::find(frozen, true) == frozen.end()) frozen.clear();
    return frozen;
}

/// How many steps the run's settings ask for. 0 if they cannot be read.
int steps_of(const fs::path& folder) {
    try {
        const auto config = core::JsonField::of_text(start_of(folder / folders::kConfigFile, kLargestConfig),
                                                     folders::kConfigFile);
        return int(config.whole("steps", INT32_MAX));
    } catch (const InputError&) {
        return 0;
    }
}

/// A run that continues a finished one leaves that one's summary until it ends itself.
bool is_done(const fs::path& folder) {
    std::error_code absent, none;
    const auto summary = platform::write_time(folder / folders::kSummaryFile, absent);
    const auto config = platform::write_time(folder / folders::kConfigFile, none);
    return !absent && (none || summary >= config);
}

}  // namespace

/// cpp-httplib's client on a Wire. By itself it reads a status line of any length, and crashes on a long one.
class Client::Http final : public httplib::ClientImpl {
  public:
    Http(const Address& address, const std::string& token, const std::atomic<bool>* stop,
         std::chrono::milliseconds patience)
        : ClientImpl(address.host, address.port),
          name_(address.host + ":" + std::to_string(address.port)),
          stop_(stop),
          patience_(patience) {
        set_connection_timeout(kConnectSeconds);
        set_tcp_nodelay(true);
        set_decompress(false);
        // The server refuses names because of browsers. This client is none.
        // Newer versions of cpp-httplib ask for compressed answers by themselves, even where they leave these packed.
        httplib::Headers headers{{"Host", "localhost"}, {"Accept-Encoding", "identity"}};
        if (!token.empty()) headers.emplace("Authorization", "Bearer " + token);
        set_default_headers(std::move(headers));
    }

    /// Returns the answer. If its status is 200, `take` receives its body piece by piece.
    httplib::Response get(const std::string& path, const httplib::Headers& headers, uint64_t most,
                          const httplib::ContentReceiver& take) {
        std::string text;  // of another status
        bool good = false;
        const auto begin = [&](const httplib::Response& response) {
            good = response.status == 200;
            wire_->allow(good ? most : kMostHeader);
            return true;
        };
        const auto receive = [&](const char* bytes, size_t count) {
            if (good) return take(bytes, count);
            text.append(bytes, count);
            return true;
        };
        return checked(Get(path, headers, begin, receive), text);
    }

    /// Returns the body of the answer.
    std::string post(const std::string& path, const std::string& body = "") {
        const auto result = body.empty() ? Post(path) : Post(path, body, "application/json");
        return checked(result, result ? result->body : "").body;
    }

    const std::string& name() const { return name_; }

  private:
    bool process_socket(const Socket& socket, std::function<bool(httplib::Stream&)> exchange) override {
        Wire wire(socket.sock, kMostHeader, patience_, stop_);
        wire_ = &wire;
        return exchange(wire);
    }

    httplib::Response checked(const httplib::Result& result, const std::string& text) const {
        if (result.error() == httplib::Error::Connection)
            throw RunError("cannot reach " + name_ + ": nobody answers there");
        if (!result) throw RunError("the connection to " + name_ + " has ended");
        if (!result->get_header_value("Server").starts_with("ewa/"))
            throw InputError("what answers at " + name_ + " is not a training of ewa");
        if (result->status >= 400)
            throw InputError("the trainer refuses: " + core::one_line(core::trim(text)));
        return *result;
    }

    const std::string name_;
    const std::atomic<bool>* const stop_;
    const std::chrono::milliseconds patience_;
    Wire* wire_ = nullptr;  // of the present exchange
};

Client::Client(const Address& address, const std::string& token, const std::atomic<bool>* stop,
               std::chrono::milliseconds patience)
    : http_(std::make_unique<Http>(address, token, stop, patience)) {}

Client::~Client() = default;

Status Client::status(size_t first_line) {
    std::string text;
    http_->get("/status?metrics=" + std::to_string(first_line), {}, kMostText,
               [&](const char* bytes, size_t count) {
                   text.append(bytes, count);
                   return text.size() <= kMostText;
               });
    return decode_status(text);
}

std::optional<TaggedSplats> Client::splats(const std::string& tag) {
    platform::PassingFile passing;
    if (passing.error()) throw RunError("out of memory for the trainer's splats");
    const auto answer =
        http_->get("/splats", {{"If-None-Match", tag.empty() ? "\"none\"" : tag}}, kMostSplats,
                   [&](const char* bytes, size_t count) { return !passing.file().write(bytes, count); });
    if (answer.status == 304) return std::nullopt;
    TaggedSplats splats;
    splats.step = std::max(0, core::parse_integer<int>(answer.get_header_value("Ewa-Step")).value_or(0));
    splats.tag = answer.get_header_value("ETag");
    try {
        splats.gaussians = io::read_ply(passing.path()).gaussians;
        splats.frozen = frozen_in(passing.path().string());
    } catch (const InputError& error) {
        throw InputError("the trainer's splats cannot be read: " + std::string(error.what()));
    }
    return splats;
}

void Client::command(const std::string& name) {
    http_->post("/" + name);
}

EditReply Client::edit(const std::string& body) {
    return decode_edit_reply(http_->post("/edit", body));
}

Address parse_address(const std::string& text) {
    const size_t colon = text.rfind(':');
    const std::string_view digits =
        colon == std::string::npos ? "" : std::string_view(text).substr(colon + 1);
    const uint16_t port = core::parse_integer<uint16_t>(digits).value_or(0);
    std::string host = text.substr(0, colon == std::string::npos ? 0 : colon);
    if (host.size() >= 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
    if (port == 0) throw InputError("'" + text + "' is not an address such as localhost:7000");
    return {host.empty() ? "localhost" : host, port};
}

std::optional<LiveFile> read_live_file(const fs::path& folder) try {
    const auto field =
        core::JsonField::of_text(start_of(folder / folders::kLiveFile, kLargestLiveFile), folders::kLiveFile);
    return LiveFile{uint16_t(field.whole("port", UINT16_MAX, 1)), field.text("token")};
} catch (const InputError&) {
    return std::nullopt;  // absent, half written, or damaged
}

std::string find_token(const std::string& given, const fs::path& file) {
    if (!given.empty()) return given;
    if (file.empty()) {
        const char* variable = std::getenv("EWA_TOKEN");
        return variable ? variable : "";
    }
    std::string token(core::trim(start_of(file, kLargestLiveFile)));
    if (token.starts_with('{')) token = core::text_in(core::parse_json<Json>(token, file.string()), "token");
    const auto plain = [](char c) { return c > ' ' && c < 0x7f; };
    if (token.empty() || !std::all_of(token.begin(), token.end(), plain))
        throw InputError(core::one_line(file.string()) +
                         ": holds no token; it is in live.json in the folder of the run");
    return token;
}

void write_live_file(const fs::path& folder, const LiveFile& live) {
    const std::string text = Json{{"port", live.port}, {"token", live.token}}.dump() + "\n";
    core::write_text_file(folder / folders::kLiveFile, text, core::AtomicFile::Readers::owner);
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

void Watcher::add(Command command) {
    const std::lock_guard lock(mutex_);
    commands_.push_back(std::move(command));
    wake_.notify_one();
}

void Watcher::command(const std::string& name) {
    add({name});
}

void Watcher::edit(const std::string& body) {
    add({{}, body});
}

void Watcher::change(const std::function<void(Update&)>& change) {
    {
        const std::lock_guard lock(mutex_);
        change(update_);
        ++update_.number;
    }
    on_news_();
}

std::optional<Watcher::Command> Watcher::next_command() {
    const std::lock_guard lock(mutex_);
    if (commands_.empty()) return std::nullopt;
    Command command = std::move(commands_.front());
    commands_.erase(commands_.begin());
    return command;
}

void Watcher::note_edit(const std::optional<EditReply>& reply, const std::string& refusal) {
    change([&](Update& update) {
        ++update.edits;
        update.last_edit = reply;
        update.edit_refusal = refusal;
    });
}

void Watcher::send(const Command& command) {
    if (!command.edit) return client_->command(command.name);
    try {
        note_edit(client_->edit(*command.edit), {});
    } catch (const std::exception& error) {
        note_edit({}, error.what());  // whether the connection has ended shows with the next request
    }
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
    if (!client_ && what_.address)
        client_ = std::make_unique<Client>(*what_.address, what_.token, &stop_, what_.patience);
    if (!client_ && !what_.folder.empty()) {
        try {
            if (const auto live = read_live_file(what_.folder)) {
                auto client = std::make_unique<Client>(Address{"127.0.0.1", live->port}, live->token, &stop_,
                                                       what_.patience);
                client->status(UINT32_MAX);
                client_ = std::move(client);
            }
        } catch (const std::exception&) {
            // The trainer that wrote the file has ended, or belongs to another user. The run's files remain.
        }
    }
    if (client_) return look_by_connection();
    if (!what_.folder.empty()) look_at_files();
    if (const auto command = next_command()) {
        const std::string why = "the training cannot be reached; start it with --serve";
        if (command->edit) note_edit({}, why);
        throw InputError(why);
    }
}

void Watcher::look_by_connection() {
    while (const auto command = next_command()) send(*command);
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
        update.frozen = std::move(splats->frozen);
        update.splats_step = splats->step;
    });
}

void Watcher::read_metrics() {
    const fs::path path = what_.folder / folders::kMetricsFile;
    std::error_code error;
    const std::uintmax_t bytes = fs::file_size(path, error);
    if (error || bytes == metrics_read_ || platform::write_time(path, error) <= what_.metrics_after) return;
    if (bytes > kLargestMetrics) throw InputError(path.string() + ": too large");
    std::string text = start_of(path, size_t(bytes));
    text.resize(text.rfind('\n') + 1);  // the last line may be half written; npos + 1 is 0
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
        update.status.state = is_done(what_.folder) ? State::done : State::running;
        update.status.commands = false;
        update.status.metrics = std::move(lines);
    });
}

void Watcher::look_at_files() {
    read_metrics();
    const fs::path path = what_.folder / folders::kSplatsFile;
    std::error_code error;
    const auto time = platform::write_time(path, error);
    if (error || time <= splats_time_) return;
    auto splats = std::make_shared<const Gaussians>(load_splats(path));
    splats_time_ = time;
    change([&](Update& update) {
        update.splats = std::move(splats);
        update.frozen.clear();
        update.splats_step = update.status.step;
    });
}

}  // namespace ewa::live
