// SPDX-License-Identifier: Apache-2.0
#include "live/http_server.h"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "ewa/error.h"
#include "live/wire.h"

namespace ewa::live {
namespace {

/// What cpp-httplib gives a connection to. It runs on the listening thread, and only starts another.
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

/// cpp-httplib's default would let a second server listen on the same port.
void set_listener_options(int socket) {
    const int yes = 1;
    setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
}

}  // namespace

HttpServer::HttpServer(const std::string& address, uint16_t port, std::chrono::milliseconds patience,
                       Answer answer)
    : patience_(patience) {
    sigaction(SIGPIPE, &action, nullptr);
    set_socket_options(set_listener_options);
    set_tcp_nodelay(true);
    set_default_headers({{"Server", "ewa/" EWA_VERSION},
                         {"Accept-Ranges", "none"},
                         {"Cache-Control", "no-store"},
                         {"Cross-Origin-Resource-Policy", "same-origin"},
                         {"X-Content-Type-Options", "nosniff"}});
    // Every request is answered here: cpp-httplib's own routing, which would read a body, is never reached.
    set_pre_routing_handler([answer = std::move(answer)](const auto& request, auto& response) {
        answer(request, response);
        return HandlerResponse::Handled;
    });
    errno = 0;
    const int bound = port == 0 ? bind_to_any_port(address) : bind_to_port(address, port) ? port : -1;
    if (bound <= 0)
        throw RunError("cannot listen on " + address + ":" + std::to_string(port) + ": " +
                       (errno ? std::strerror(errno) : "there is no such address"));
    port_ = uint16_t(bound);
    new_task_queue = [this] {
        listening_.set_value();
        return new AtOnce;
    };
    thread_ = std::thread([this] { listen_after_bind(); });
    listening_.get_future().wait();  // before this, stop() would do nothing
}

HttpServer::~HttpServer() {
    stop();
    thread_.join();
    {
        const std::lock_guard lock(mutex_);
        for (const Connection& connection : connections_)
            if (!connection.done) ::shutdown(connection.socket, SHUT_RDWR);
    }
    for (Connection& connection : connections_) connection.thread.join();
}

bool HttpServer::make_place(std::unique_lock<std::mutex>& lock) {
    connections_.remove_if([](Connection& connection) {
        if (connection.done) connection.thread.join();
        return connection.done;
    });
    if (connections_.size() < kMostConnections) return true;
    const auto silent = std::find_if(connections_.begin(), connections_.end(),
                                     [](const Connection& connection) { return !connection.asked; });
    if (silent == connections_.end()) return false;
    silent->cut = true;
    if (!silent->done) ::shutdown(silent->socket, SHUT_RDWR);
    lock.unlock();
    silent->thread.join();
    lock.lock();
    connections_.erase(silent);
    return true;
}

bool HttpServer::process_and_close_socket(int socket) {
    std::unique_lock lock(mutex_);
    if (!make_place(lock)) {
        ::close(socket);
        return false;
    }
    Connection& connection = connections_.emplace_back();
    connection.socket = socket;
    try {
        connection.thread = std::thread([this, &connection] { serve(connection); });
    } catch (const std::system_error&) {  // no thread to be had: the training goes on
        ::close(socket);
        connections_.pop_back();
    }
    return true;
}

template <class Self>
void HttpServer::process(Self& self, httplib::Stream& stream,
                         const std::function<void(httplib::Request&)>& begin) {
    bool closed = true;
    if constexpr (requires { self.process_request(stream, true, closed, begin); })
        self.process_request(stream, true, closed, begin);
    else  // since cpp-httplib 0.17
        self.process_request(stream, std::string(), 0, std::string(), 0, true, closed, begin);
}

void HttpServer::serve(Connection& connection) {
    try {
        Wire wire(connection.socket, kMostRequest, patience_);
        process(*this, wire, [&](httplib::Request& request) {
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
    ::shutdown(connection.socket, SHUT_RDWR);
    ::close(connection.socket);
    connection.done = true;
}

}  // namespace ewa::live
