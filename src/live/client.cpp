// SPDX-License-Identifier: Apache-2.0
#include "live/client.h"

#include <httplib.h>
#include <sys/mman.h>

#include <algorithm>
#include <cstdio>

#include "core/text.h"
#include "ewa/error.h"
#include "io/splats/formats.h"
#include "live/wire.h"

namespace ewa::live {
namespace {

constexpr int kConnectSeconds = 3;
constexpr std::chrono::seconds kPatience(30);
constexpr uint64_t kMostHeader = 8192;               // bytes of an answer before its body
constexpr uint64_t kMostText = 16u << 20;            // bytes of a body that is text
constexpr uint64_t kMostSplats = uint64_t(1) << 33;  // bytes of a body that is splats

/// A nameless file in memory, which readers open by path.
struct MemoryFile {
    std::unique_ptr<std::FILE, int (*)(std::FILE*)> file;
    MemoryFile() : file(fdopen(memfd_create("splats", MFD_CLOEXEC), "wb"), std::fclose) {
        if (!file) throw RunError("out of memory for the trainer's splats");
    }
    std::string path() const { return "/proc/self/fd/" + std::to_string(fileno(file.get())); }
};

}  // namespace

/// cpp-httplib's client on a Wire: it would read a status line of any length, and crash on a long one.
class Client::Http final : public httplib::ClientImpl {
  public:
    Http(const Address& address, const std::string& token, const std::atomic<bool>* stop)
        : ClientImpl(address.host, address.port),
          name_(address.host + ":" + std::to_string(address.port)),
          stop_(stop) {
        set_connection_timeout(kConnectSeconds);
        set_tcp_nodelay(true);
        set_decompress(false);
        // The server refuses names, for the sake of browsers. This is none.
        httplib::Headers headers{{"Host", "localhost"}};
        if (!token.empty()) headers.emplace("Authorization", "Bearer " + token);
        set_default_headers(std::move(headers));
    }

    /// The answer, its body given to `take` as it comes where its status is 200.
    httplib::Response get(const std::string& path, const httplib::Headers& headers, uint64_t most,
                          const httplib::ContentReceiver& take) {
        std::string text;  // of another status
        const auto begin = [&](const httplib::Response& response) {
            wire_->allow(response.status == 200 ? most : kMostHeader);
            good_ = response.status == 200;
            return true;
        };
        const auto receive = [&](const char* bytes, size_t count) {
            if (good_) return take(bytes, count);
            text.append(bytes, count);
            return true;
        };
        return checked(Get(path, headers, begin, receive), text);
    }

    void post(const std::string& path) {
        const auto result = Post(path);
        checked(result, result ? result->body : "");
    }

    const std::string& name() const { return name_; }

  private:
    bool process_socket(const Socket& socket, std::function<bool(httplib::Stream&)> exchange) override {
        Wire wire(socket.sock, kMostHeader, kPatience, stop_);
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
    Wire* wire_ = nullptr;  // of the present exchange
    bool good_ = false;
};

Client::Client(const Address& address, const std::string& token, const std::atomic<bool>* stop)
    : http_(std::make_unique<Http>(address, token, stop)) {}

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
    MemoryFile memory;
    const auto answer = http_->get("/splats", {{"If-None-Match", tag.empty() ? "\"none\"" : tag}},
                                   kMostSplats, [&](const char* bytes, size_t count) {
                                       return std::fwrite(bytes, 1, count, memory.file.get()) == count;
                                   });
    if (answer.status == 304) return std::nullopt;
    if (std::fflush(memory.file.get()) != 0) throw RunError("out of memory for the trainer's splats");
    TaggedSplats splats;
    splats.step = std::max(0, core::parse_integer<int>(answer.get_header_value("Ewa-Step")).value_or(0));
    splats.tag = answer.get_header_value("ETag");
    try {
        splats.gaussians = io::read_ply(memory.path()).gaussians;
    } catch (const InputError& error) {
        throw InputError("the trainer's splats cannot be read: " + std::string(error.what()));
    }
    return splats;
}

void Client::command(const std::string& name) {
    http_->post("/" + name);
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

}  // namespace ewa::live
