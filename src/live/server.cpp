// SPDX-License-Identifier: Apache-2.0
// cpp-httplib parses requests and writes answers. Who may connect, for how long and with how many bytes is
// limited here.
#include "live/server.h"

#include <httplib.h>

#include <algorithm>
#include <future>
#include <list>
#include <optional>
#include <thread>
#include <utility>

#include "core/text.h"
#include "ewa/error.h"
#include "io/splats/formats.h"
#include "io/splats/scene_page.h"
#include "live/wire.h"
#include "platform/socket.h"
#include "platform/system.h"

namespace ewa::live {
namespace {

using httplib::Request;
using httplib::Response;

constexpr size_t kMostConnections = 64;
constexpr size_t kMostRequest = 4096;  // bytes of request line and headers
constexpr double kShare = 0.05;        // of the time that taking splats may cost
constexpr double kLeastPause = 0.2;    // seconds between splats
constexpr std::chrono::seconds kFreshWait(5);
constexpr size_t kRowsAtOnce = 4096;

/// The time does not depend on where the first difference is.
bool same_secret(const std::string& a, const std::string& b) {
    if (a.size() != b.size()) return false;
    unsigned difference = 0;
    for (size_t i = 0; i < a.size(); ++i) difference |= unsigned(a[i] ^ b[i]);
    return difference == 0;
}

/// Nothing, or ":PORT".
bool is_port(std::string_view text) {
    return text.empty() ||
           (text[0] == ':' && text.find_first_not_of("0123456789", 1) == std::string_view::npos);
}

/// Whether "HOST[:PORT]" is an address in numbers or localhost. A web page whose name was made to lead here
/// sends its own name.
bool own_host(const std::string& text) {
    if (text.starts_with('[')) {
        const size_t end = text.find(']');
        return end != std::string::npos && is_port(text.substr(end + 1)) &&
               platform::is_ipv6(text.substr(1, end - 1));
    }
    const size_t end = std::min(text.find(':'), text.size());
    const std::string host = core::lower(text.substr(0, end));
    if (!is_port(text.substr(end))) return false;
    return host == "localhost" || platform::is_ipv4(host);
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
void give_bytes(Response& response, std::shared_ptr<const std::string> bytes, const char* type,
                std::shared_ptr<void> guest) {
    const size_t size = bytes->size();
    response.set_content_provider(size, type,
                                  [bytes = std::move(bytes), guest = std::move(guest)](
                                      size_t from, size_t count, httplib::DataSink& sink) {
                                      return sink.write(bytes->data() + from, count);
                                  });
}

void give_text(Response& response, std::string text, const char* type, std::shared_ptr<void> guest) {
    give_bytes(response, std::make_shared<const std::string>(std::move(text)), type, std::move(guest));
}

/// As PLY, a few rows at a time: there is no second copy of the splats.
void give_ply(Response& response, std::shared_ptr<const Snapshot> splats, std::shared_ptr<void> guest) {
    std::string header = io::ply_header(splats->gaussians, {});
    const bool frozen = !splats->frozen.empty();
    if (frozen)
        header.insert(header.rfind("end_header"), std::string("property float ") + kFrozenProperty + "\n");
    const size_t row = io::ply_row_bytes(splats->gaussians) + (frozen ? sizeof(float) : 0);
    const size_t size = header.size() + row * splats->gaussians.size();
    response.set_content_provider(
        size, "application/octet-stream",
        [header, row, frozen, splats = std::move(splats), guest = std::move(guest)](size_t from, size_t,
                                                                                    httplib::DataSink& sink) {
            if (from < header.size()) return sink.write(header.data() + from, header.size() - from);
            const size_t first = (from - header.size()) / row;
            const size_t end = std::min(first + kRowsAtOnce, splats->gaussians.size());
            std::vector<float> rows;
            rows.reserve(row / sizeof(float) * (end - first));
            for (size_t i = first; i < end; ++i) {
                io::append_ply_row(splats->gaussians, i, rows);
                if (frozen) rows.push_back(splats->frozen[i] ? 1.0f : 0.0f);
            }
            return sink.write(reinterpret_cast<const char*>(rows.data()), rows.size() * sizeof(float));
        });
}

/// cpp-httplib gives each connection to this. It runs on the listening thread, and its jobs only start another.
class AtOnce final : public httplib::TaskQueue {
    // void before cpp-httplib 0.14, bool since
    using Taken = decltype(std::declval<httplib::TaskQueue&>().enqueue({}));

  public:
    Taken enqueue(std::function<void()> job) override {
        job();
        return Taken(true);
    }
    void shutdown() override {}
};

}  // namespace

/// cpp-httplib's constructor makes the whole process ignore SIGPIPE, which Wire does not need.
struct SigpipeBefore {
    platform::PipeSignal before;
};

/// Its threads answer several requests at a time.
class Server::Http final : private SigpipeBefore, private httplib::Server {
  public:
    Http(live::Server& server, const std::string& address, uint16_t port, std::chrono::milliseconds patience)
        : server_(server), patience_(patience) {
        before.restore();
        // cpp-httplib's default would let a second server listen on the same port.
        set_socket_options([](socket_t socket) { platform::reuse_port(std::intptr_t(socket)); });
        set_tcp_nodelay(true);
        set_default_headers({{"Server", "ewa/" EWA_VERSION},
                             {"Accept-Ranges", "none"},
                             {"Cache-Control", "no-store"},
                             {"Cross-Origin-Resource-Policy", "same-origin"},
                             {"X-Content-Type-Options", "nosniff"}});
        // Answers every request before cpp-httplib's own routing, which would read a body.
        set_pre_routing_handler([this](const Request& request, Response& response) {
            answer(request, response);
            return HandlerResponse::Handled;
        });
        platform::clear_socket_error();
        const int bound = port == 0 ? bind_to_any_port(address) : bind_to_port(address, port) ? port : -1;
        if (bound <= 0) {
            const std::string reason = platform::socket_error();
            throw RunError("cannot listen on " + address + ":" + std::to_string(port) + ": " +
                           (reason.empty() ? "there is no such address" : reason));
        }
        port_ = uint16_t(bound);
        new_task_queue = [this] {
            listening_.set_value();
            return new AtOnce;
        };
        thread_ = std::thread([this] { listen_after_bind(); });
        listening_.get_future().wait();  // before this, stop() would do nothing
    }

    /// Ends every connection. No answer may still wait for news of the server.
    ~Http() override {
        stop();
        thread_.join();
        {
            const std::lock_guard lock(mutex_);
            for (const Connection& connection : connections_)
                if (!connection.done) platform::shut_down(std::intptr_t(connection.socket));
        }
        for (Connection& connection : connections_) connection.thread.join();
    }

    uint16_t port() const { return port_; }

  private:
    struct Connection {
        socket_t socket = INVALID_SOCKET;
        std::thread thread;
        bool asked = false;  // its request has come
        bool cut = false;    // another connection replaces it
        bool done = false;
    };

    bool process_and_close_socket(socket_t socket) override {
        std::unique_lock lock(mutex_);
        if (!make_place(lock)) {
            platform::close_socket(std::intptr_t(socket));
            return false;
        }
        Connection& connection = connections_.emplace_back();
        connection.socket = socket;
        try {
            connection.thread = std::thread([this, &connection] { serve(connection); });
        } catch (const std::system_error&) {  // the system has no more threads: the training continues
            platform::close_socket(std::intptr_t(socket));
            connections_.pop_back();
        }
        return true;
    }

    bool make_place(std::unique_lock<std::mutex>& lock) {
        connections_.remove_if([](Connection& connection) {
            if (connection.done) connection.thread.join();
            return connection.done;
        });
        if (connections_.size() < kMostConnections) return true;
        const auto silent = std::find_if(connections_.begin(), connections_.end(),
                                         [](const Connection& connection) { return !connection.asked; });
        if (silent == connections_.end()) return false;
        silent->cut = true;
        if (!silent->done) platform::shut_down(std::intptr_t(silent->socket));
        lock.unlock();
        silent->thread.join();
        lock.lock();
        connections_.erase(silent);
        return true;
    }

    void serve(Connection& connection) {
        try {
            Wire wire(connection.socket, kMostRequest, patience_);
            wire_ = &wire;
            process(*this, wire, [&](Request& request) {
                const std::lock_guard lock(mutex_);
                if (connection.cut) throw RunError("the connection was cut");
                connection.asked = true;
                // One short request could ask for the splats thousands of times.
                request.ranges.clear();
            });
        } catch (const std::exception&) {
            // Out of memory, for one client: its connection ends, the training does not.
        }
        const std::lock_guard lock(mutex_);
        platform::shut_down(std::intptr_t(connection.socket));
        platform::close_socket(std::intptr_t(connection.socket));
        connection.done = true;
    }

    template <class Self>
    static void process(Self& self, httplib::Stream& stream, const std::function<void(Request&)>& begin) {
        bool closed = true;
        if constexpr (requires { self.process_request(stream, true, closed, begin); })
            self.process_request(stream, true, closed, begin);
        else  // since cpp-httplib 0.17
            self.process_request(stream, std::string(), 0, std::string(), 0, true, closed, begin);
    }

    void answer(const Request& request, Response& response) {
        if (request.get_header_value_count("Host") != 1 || !own_host(request.get_header_value("Host")))
            return refuse(response, 403, "the Host header must be localhost or an address in numbers");
        if (of_a_web_page(request)) return refuse(response, 403, "requests from web pages are refused");
        const bool edits = request.method == "POST" && request.path == "/edit";
        if (has_body(request) && !edits) return refuse(response, 413, "a request has no body here");
        const std::string shown = request.get_header_value("Authorization");
        const bool trusted = !server_.token_.empty() && same_secret(shown, "Bearer " + server_.token_);
        if (!shown.empty() && !trusted) return refuse(response, 401, "this is not the run's token");
        const auto guest = enter(trusted);
        if (!guest) return refuse(response, 503, "too many clients without the token; try again");

        const bool get = request.method == "GET" || request.method == "HEAD";
        const std::string& path = request.path;
        if (get && path == "/status") {
            const bool lines = request.has_param("metrics");
            const auto first =
                core::parse_integer<uint32_t>(lines ? request.get_param_value("metrics") : "0");
            if (!first) return refuse(response, 400, "metrics wants the number of the first line");
            const std::string status = status_from(lines ? *first : SIZE_MAX, trusted);
            return give_text(response, status, "application/json", guest);
        }
        if (get && path == "/splats") return give_splats(request, response, trusted, guest);
        if (get && path == "/scene") return give_scene(request, response, trusted, guest);
        if (get && path == "/") return give_page(response, trusted, guest);
        if (!edits &&
            (request.method != "POST" || (path != "/pause" && path != "/resume" && path != "/save")))
            return refuse(response, 404,
                          "there is GET /, /scene, /splats, /status and POST /pause, /resume, /save, /edit");
        if (!trusted) {
            response.set_header("WWW-Authenticate", "Bearer");
            return refuse(response, 401, "this needs the token: Authorization: Bearer TOKEN (see live.json)");
        }
        if (edits) return take_edit(request, response, guest);
        {
            const std::lock_guard lock(server_.mutex_);
            if (path == "/save")
                server_.save_ = true;
            else
                server_.paused_ = path == "/pause";
        }
        give_text(response, "done\n", "text/plain", guest);
    }

    /// Reads the body of an edit. Nothing, with a refusal, if it has none, is too long or does not come.
    static std::optional<std::string> body_of(const Request& request, Response& response) {
        const auto bytes = core::parse_integer<uint64_t>(request.get_header_value("Content-Length"));
        const auto refused = [&](int status, const std::string& why) {
            refuse(response, status, why);
            return std::nullopt;
        };
        if (!bytes || *bytes == 0 || request.has_header("Transfer-Encoding"))
            return refused(411, "an edit is the body of its request, with a Content-Length");
        if (*bytes > kMostEdit)
            return refused(413, "an edit has at most " + std::to_string(kMostEdit) + " bytes");
        std::string body(size_t(*bytes), '\0');
        wire_->allow(*bytes);
        for (size_t at = 0; at < body.size();) {
            const ssize_t got = wire_->read(&body[at], body.size() - at);
            if (got <= 0) return refused(408, "the edit has not come whole");
            at += size_t(got);
        }
        return body;
    }

    void take_edit(const Request& request, Response& response, std::shared_ptr<void> guest) {
        auto body = body_of(request, response);
        if (!body) return;
        {
            const std::lock_guard lock(server_.mutex_);
            if (server_.status_.state == State::done) return refuse(response, 409, "the training has ended");
        }
        const auto outcome = server_.edits_.ask(std::move(*body), server_.edit_wait_);
        if (!outcome)
            return refuse(response, 503,
                          "the training takes no edit now, and nothing was changed; try again");
        if (!outcome->refusal.empty()) return refuse(response, 400, outcome->refusal);
        give_text(response, encode(outcome->reply), "application/json", std::move(guest));
    }

    /// Counts a request until the pointer is gone. Null: there are too many without the token.
    std::shared_ptr<void> enter(bool trusted) {
        const std::lock_guard lock(server_.mutex_);
        size_t& count = trusted ? server_.trusted_ : server_.strangers_;
        if (!trusted && count >= kMostStrangers) return nullptr;
        ++count;
        return {this, [&server = server_, &count](Http*) {
                    const std::lock_guard leaving(server.mutex_);
                    --count;
                    if (&count == &server.trusted_) server.lease_end_ = Clock::now() + server.lease_;
                }};
    }

    std::string status_from(size_t line, bool trusted) {
        std::unique_lock lock(server_.mutex_);
        const Status& now = server_.status_;
        Status status{server_.run_, now.step,    now.steps, now.splats,
                      now.loss,     now.seconds, now.state, trusted};
        for (size_t i = line; i < now.metrics.size() && i - line < kMostLines; ++i)
            status.metrics.push_back(now.metrics[i]);
        if (status.state == State::running && server_.paused_now()) status.state = State::paused;
        lock.unlock();
        return encode(status);
    }

    /// The newest splats, or null. fresh: waits for those of the present step, a limited time.
    std::shared_ptr<const Snapshot> splats_for(bool trusted, bool fresh) {
        std::unique_lock lock(server_.mutex_);
        server_.wanted_ = true;
        if (fresh)
            server_.news_.wait_for(lock, kFreshWait, [&server = server_, step = server_.status_.step] {
                return server.stop_ || (server.splats_ && server.splats_->step >= step &&
                                        server.splats_->edits == server.edits_.performed());
            });
        if (trusted) return server_.splats_;
        auto given = server_.given_.lock();
        if (!given) server_.given_ = given = server_.splats_;
        return given;
    }

    /// Names the splats of an answer, or completes one without splats, and then returns false. step: -1 for no splats.
    bool name_splats(const std::string& known, Response& response, int step, uint64_t edits) const {
        std::string tag = "\"" + server_.run_ + "-" + std::to_string(step);
        if (edits > 0) tag += "-" + std::to_string(edits);
        tag += '"';
        if (!known.empty() && (step < 0 || known == tag)) {
            response.status = 304;
            return false;
        }
        if (step < 0) {
            response.set_header("Retry-After", "1");
            refuse(response, 503, "no splats have been taken yet; ask again");
            return false;
        }
        response.set_header("ETag", tag);
        response.set_header("Ewa-Step", std::to_string(step));
        return true;
    }

    void give_splats(const Request& request, Response& response, bool trusted, std::shared_ptr<void> guest) {
        const std::string known = request.get_header_value("If-None-Match");
        const auto splats = splats_for(trusted, known.empty());
        if (name_splats(known, response, splats ? splats->step : -1, splats ? splats->edits : 0))
            give_ply(response, splats, std::move(guest));
    }

    /// As the page reads them. They are made on this thread, so the training does not wait.
    void give_scene(const Request& request, Response& response, bool trusted, std::shared_ptr<void> guest) {
        const std::string known = request.get_header_value("If-None-Match");
        const auto [options, busy] = page_options();
        auto scene = server_.scenes_.kept(trusted, busy);
        if (!scene)
            if (const auto splats = splats_for(trusted, known.empty()))
                scene = server_.scenes_.of({splats->step, splats->edits}, splats->gaussians, options, trusted,
                                           busy);
        if (!name_splats(known, response, scene ? scene->step : -1, scene ? scene->edits : 0)) return;
        give_bytes(response, {scene, &scene->sog}, "application/octet-stream", std::move(guest));
    }

    void give_page(Response& response, bool trusted, std::shared_ptr<void> guest) {
        auto splats = splats_for(trusted, false);
        if (!splats) splats = splats_for(trusted, true);
        if (!splats) {
            response.set_header("Refresh", "1");
            return refuse(response, 503, "the training has no splats yet; this page will load by itself");
        }
        // The page's own policy is in it. This cannot be.
        response.set_header("Content-Security-Policy", "frame-ancestors 'none'");
        give_text(response, io::live_page(splats->gaussians, page_options().first.page),
                  "text/html; charset=utf-8", std::move(guest));
    }

    /// What the page shows, and whether the training is busy.
    std::pair<SaveOptions, bool> page_options() const {
        const std::lock_guard lock(server_.mutex_);
        return {server_.options_, server_.status_.state == State::running && !server_.paused_now()};
    }

    inline static thread_local Wire* wire_ = nullptr;  // of the connection that this thread serves
    live::Server& server_;
    const std::chrono::milliseconds patience_;
    uint16_t port_ = 0;
    std::mutex mutex_;  // of the connections
    std::list<Connection> connections_;
    std::promise<void> listening_;
    std::thread thread_;  // last
};

std::string random_token() {
    unsigned char bytes[16] = {};
    if (!platform::random_bytes(bytes, sizeof(bytes)))
        throw RunError("the system gives no random numbers for a token");
    std::string text;
    for (const unsigned char byte : bytes) {
        text += "0123456789abcdef"[byte >> 4];
        text += "0123456789abcdef"[byte & 15];
    }
    return text;
}

Server::Server(const std::string& address, uint16_t port, std::string token, std::chrono::milliseconds lease,
               std::chrono::milliseconds request_patience, std::chrono::milliseconds edit_wait)
    : token_(std::move(token)),
      lease_(lease),
      edit_wait_(edit_wait),
      http_(std::make_unique<Http>(*this, address, port, request_patience)) {}

Server::~Server() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    news_.notify_all();
    edits_.stop();
    http_.reset();
}

uint16_t Server::port() const {
    return http_->port();
}

void Server::describe(const SaveOptions& options) {
    const std::lock_guard lock(mutex_);
    options_ = options;
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
    const bool newest = splats_ && splats_->step == step && splats_->edits == edits_.performed();
    return wanted_ && !newest && Clock::now() >= next_splats_;
}

void Server::offer(Snapshot&& snapshot, double seconds) {
    snapshot.edits = edits_.performed();
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

}  // namespace ewa::live
