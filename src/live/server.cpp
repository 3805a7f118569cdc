// SPDX-License-Identifier: Apache-2.0
#include "live/server.h"

#include <arpa/inet.h>
#include <sys/random.h>

#include <algorithm>
#include <utility>

#include "core/text.h"
#include "ewa/error.h"
#include "io/splats/formats.h"
#include "live/http_server.h"

namespace ewa::live {
namespace {

using httplib::Request;
using httplib::Response;

constexpr double kShare = 0.05;      // of the time that taking splats may cost
constexpr double kLeastPause = 0.2;  // seconds between splats
constexpr std::chrono::seconds kFreshWait(5);
constexpr size_t kRowsAtOnce = 4096;

/// The time does not depend on where the first difference is.
bool same_secret(const std::string& a, const std::string& b) {
    if (a.size() != b.size()) return false;
    unsigned difference = 0;
    for (size_t i = 0; i < a.size(); ++i) difference |= unsigned(a[i] ^ b[i]);
    return difference == 0;
}

/// Whether "HOST[:PORT]" is an address in numbers or localhost. A page whose name was made to lead here has
/// its own name there.
bool own_host(const std::string& text) {
    unsigned char address[16];
    if (text.starts_with('[')) {
        const size_t end = text.find(']');
        return end != std::string::npos && inet_pton(AF_INET6, text.substr(1, end - 1).c_str(), address) == 1;
    }
    const std::string host = core::lower(text.substr(0, text.find(':')));
    return host == "localhost" || inet_pton(AF_INET, host.c_str(), address) == 1;
}

bool of_a_web_page(const Request& request) {
    const std::string site = request.get_header_value("Sec-Fetch-Site");  // "none": typed by the user
    return request.has_header("Origin") || (!site.empty() && site != "none" && site != "same-origin");
}

bool has_body(const Request& request) {
    const std::string length = request.get_header_value("Content-Length");
    return request.has_header("Transfer-Encoding") || (!length.empty() && length != "0");
}

void refuse(Response& response, int status, const std::string& why) {
    response.status = status;
    response.set_content(why + "\n", "text/plain");
}

/// guest: lives until the answer has been sent.
void give_text(Response& response, std::string text, const char* type, std::shared_ptr<void> guest) {
    const size_t size = text.size();
    response.set_content_provider(size, type,
                                  [text = std::move(text), guest = std::move(guest)](
                                      size_t from, size_t count, httplib::DataSink& sink) {
                                      return sink.write(text.data() + from, count);
                                  });
}

/// As PLY, a few rows at a time: there is no second copy of the splats.
void give_ply(Response& response, std::shared_ptr<const Snapshot> splats, std::shared_ptr<void> guest) {
    const std::string header = io::ply_header(splats->gaussians, {});
    const size_t row = io::ply_row_bytes(splats->gaussians);
    const size_t size = header.size() + row * splats->gaussians.size();
    response.set_content_provider(
        size, "application/octet-stream",
        [header, row, splats = std::move(splats), guest = std::move(guest)](size_t from, size_t,
                                                                            httplib::DataSink& sink) {
            if (from < header.size()) return sink.write(header.data() + from, header.size() - from);
            const size_t first = (from - header.size()) / row;
            const size_t end = std::min(first + kRowsAtOnce, splats->gaussians.size());
            std::vector<float> rows;
            rows.reserve(row / sizeof(float) * (end - first));
            for (size_t i = first; i < end; ++i) io::append_ply_row(splats->gaussians, i, rows);
            return sink.write(reinterpret_cast<const char*>(rows.data()), rows.size() * sizeof(float));
        });
}

}  // namespace

std::string random_token() {
    unsigned char bytes[16] = {};
    if (getrandom(bytes, sizeof(bytes), 0) != ssize_t(sizeof(bytes)))
        throw RunError("the system gives no random numbers for a token");
    std::string text;
    for (const unsigned char byte : bytes) {
        text += "0123456789abcdef"[byte >> 4];
        text += "0123456789abcdef"[byte & 15];
    }
    return text;
}

Server::Server(const std::string& address, uint16_t port, std::string token, std::chrono::milliseconds lease,
               std::chrono::milliseconds request_patience)
    : token_(std::move(token)),
      lease_(lease),
      http_(std::make_unique<HttpServer>(
          address, port, request_patience,
          [this](const Request& request, Response& response) { answer(request, response); })) {}

Server::~Server() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    news_.notify_all();
    http_.reset();
}

uint16_t Server::port() const {
    return http_->port();
}

void Server::report(const Status& status) {
    const std::lock_guard lock(mutex_);
    auto metrics = std::move(status_.metrics);
    status_ = status;
    status_.metrics = std::move(metrics);
}

void Server::add_metrics(const report::MetricsLine& line) {
    const std::lock_guard lock(mutex_);
    status_.metrics.push_back(line);
}

bool Server::wants_splats(int step) const {
    const std::lock_guard lock(mutex_);
    return wanted_ && (!splats_ || splats_->step != step) && Clock::now() >= next_splats_;
}

void Server::offer(Snapshot&& snapshot, double seconds) {
    auto shared = std::make_shared<const Snapshot>(std::move(snapshot));
    const std::chrono::duration<double> pause(std::max(kLeastPause, seconds / kShare));
    {
        const std::lock_guard lock(mutex_);
        std::swap(splats_, shared);
        wanted_ = false;
        next_splats_ = Clock::now() + std::chrono::duration_cast<Clock::duration>(pause);
    }
    news_.notify_all();
}

bool Server::paused_now() {
    if (trusted_ == 0 && Clock::now() > lease_end_) paused_ = false;
    return paused_;
}

bool Server::paused() {
    const std::lock_guard lock(mutex_);
    return paused_now();
}

bool Server::take_save() {
    const std::lock_guard lock(mutex_);
    return std::exchange(save_, false);
}

std::shared_ptr<void> Server::enter(bool trusted) {
    const std::lock_guard lock(mutex_);
    size_t& count = trusted ? trusted_ : strangers_;
    if (!trusted && count >= kMostStrangers) return nullptr;
    ++count;
    return {this, [&count, this](Server*) {
                const std::lock_guard leaving(mutex_);
                --count;
                if (&count == &trusted_) lease_end_ = Clock::now() + lease_;
            }};
}

std::string Server::status_from(size_t line, bool trusted) {
    Status status;
    {
        const std::lock_guard lock(mutex_);
        status = {run_,         status_.step,    status_.steps, status_.splats,
                  status_.loss, status_.seconds, status_.state, trusted};
        const auto& lines = status_.metrics;
        for (size_t i = line; i < lines.size() && i - line < kMostLines; ++i)
            status.metrics.push_back(lines[i]);
        if (status.state == State::running && paused_now()) status.state = State::paused;
    }
    return encode(status);
}

std::shared_ptr<const Snapshot> Server::splats_for(bool trusted, bool fresh) {
    std::unique_lock lock(mutex_);
    wanted_ = true;
    if (fresh)
        news_.wait_for(lock, kFreshWait,
                       [this, step = status_.step] { return stop_ || (splats_ && splats_->step >= step); });
    if (trusted) return splats_;
    auto given = given_.lock();
    if (!given) given_ = given = splats_;
    return given;
}

void Server::give_splats(const Request& request, Response& response, bool trusted,
                         std::shared_ptr<void> guest) {
    const std::string known = request.get_header_value("If-None-Match");
    const auto splats = splats_for(trusted, known.empty());
    const std::string tag = splats ? "\"" + run_ + "-" + std::to_string(splats->step) + "\"" : "";
    if (!known.empty() && (!splats || known == tag)) {
        response.status = 304;
        return;
    }
    if (!splats) {
        response.set_header("Retry-After", "1");
        return refuse(response, 503, "no splats have been taken yet; ask again");
    }
    response.set_header("ETag", tag);
    response.set_header("Ewa-Step", std::to_string(splats->step));
    give_ply(response, splats, std::move(guest));
}

void Server::command(const std::string& path) {
    const std::lock_guard lock(mutex_);
    if (path == "/save")
        save_ = true;
    else
        paused_ = path == "/pause";
}

void Server::answer(const Request& request, Response& response) {
    if (request.get_header_value_count("Host") != 1 || !own_host(request.get_header_value("Host")))
        return refuse(response, 403, "the Host header must be localhost or an address in numbers");
    if (of_a_web_page(request)) return refuse(response, 403, "requests from web pages are refused");
    if (has_body(request)) return refuse(response, 413, "a request has no body here");
    const std::string shown = request.get_header_value("Authorization");
    const bool trusted = !token_.empty() && same_secret(shown, "Bearer " + token_);
    if (!shown.empty() && !trusted) return refuse(response, 401, "this is not the run's token");
    const auto guest = enter(trusted);
    if (!guest) return refuse(response, 503, "too many clients without the token; try again");

    const bool get = request.method == "GET" || request.method == "HEAD";
    const std::string& path = request.path;
    if (get && path == "/status") {
        const bool lines = request.has_param("metrics");
        const auto first = core::parse_integer<uint32_t>(lines ? request.get_param_value("metrics") : "0");
        if (!first) return refuse(response, 400, "metrics wants the number of the first line");
        return give_text(response, status_from(lines ? *first : SIZE_MAX, trusted), "application/json",
                         guest);
    }
    if (get && path == "/splats") return give_splats(request, response, trusted, guest);
    if (request.method != "POST" || (path != "/pause" && path != "/resume" && path != "/save"))
        return refuse(response, 404, "there is GET /status, /splats and POST /pause, /resume, /save");
    if (!trusted) {
        response.set_header("WWW-Authenticate", "Bearer");
        return refuse(response, 401, "this needs the token: Authorization: Bearer TOKEN (see live.json)");
    }
    command(path);
    give_text(response, "done\n", "text/plain", guest);
}

}  // namespace ewa::live
