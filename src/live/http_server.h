// SPDX-License-Identifier: Apache-2.0
// cpp-httplib's server behind a door: it parses requests and writes answers, but who may connect, for how
// long and with how many bytes is bounded here. One connection, one request.
#pragma once
#include <httplib.h>

#include <chrono>
#include <csignal>
#include <functional>
#include <future>
#include <list>
#include <mutex>
#include <thread>

namespace ewa::live {

inline constexpr size_t kMostConnections = 64;
inline constexpr size_t kMostRequest = 4096;  // bytes of request line and headers

/// cpp-httplib's constructor makes the whole process ignore SIGPIPE, which Wire does not need.
struct SigpipeBefore {
    struct sigaction action {};
    SigpipeBefore() { sigaction(SIGPIPE, nullptr, &action); }
};

class HttpServer final : private SigpipeBefore, private httplib::Server {
  public:
    /// Called on threads of the server, several at a time. What the answer's content provider holds lives
    /// until the answer has been sent.
    using Answer = std::function<void(const httplib::Request&, httplib::Response&)>;

    /// Listens at once; port 0: any free one. patience: for a whole request. Throws RunError.
    HttpServer(const std::string& address, uint16_t port, std::chrono::milliseconds patience, Answer answer);
    /// Cuts every connection. The caller ends its own waits in `answer` before.
    ~HttpServer();

    uint16_t port() const { return port_; }

  private:
    struct Connection {
        int socket = -1;
        std::thread thread;
        bool asked = false;  // its request has come
        bool cut = false;    // it gave its place to another
        bool done = false;
    };
    bool process_and_close_socket(int socket) override;
    bool make_place(std::unique_lock<std::mutex>& lock);
    void serve(Connection& connection);
    template <class Self>
    static void process(Self& self, httplib::Stream& stream,
                        const std::function<void(httplib::Request&)>& begin);

    const std::chrono::milliseconds patience_;
    uint16_t port_ = 0;
    std::mutex mutex_;  // of what follows
    std::list<Connection> connections_;
    std::promise<void> listening_;
    std::thread thread_;  // last
};

}  // namespace ewa::live
