// SPDX-License-Identifier: Apache-2.0
#include "live/client.h"

#include <algorithm>

#include "ewa/error.h"

namespace ewa::live {
namespace {

constexpr int kConnectSeconds = 10;
constexpr size_t kMostAnswer = 512;   // bytes of an answer's first line
constexpr size_t kChunk = 16u << 20;  // bytes that memory is taken for before they have come

}  // namespace

Client::Client(const Address& address, const std::string& token, const std::atomic<bool>* stop)
    : socket_(connect_to(address.host, address.port, kConnectSeconds, stop)),
      who_(address.host + ":" + std::to_string(address.port)) {
    if (!ask(std::string(kHello)).empty()) throw InputError(who_ + " is no training of ewa");
    if (!token.empty()) ask("token " + token);
}

std::vector<std::byte> Client::ask(const std::string& request) {
    const RunError gone("the connection to " + who_ + " has ended");
    if (!socket_.send(request + "\n", kPatience)) throw gone;
    const auto line = socket_.receive_line(kMostAnswer, kPatience);
    if (!line) throw gone;
    const uint64_t bytes = payload_of(*line);
    std::vector<std::byte> payload;
    while (payload.size() < bytes) {
        const size_t from = payload.size();
        payload.resize(size_t(std::min<uint64_t>(bytes, from + kChunk)));
        if (!socket_.receive(std::span(payload).subspan(from), kPatience)) throw gone;
    }
    return payload;
}

Status Client::status(size_t first_line) {
    const auto payload = ask("status " + std::to_string(first_line));
    return decode_status(std::string(reinterpret_cast<const char*>(payload.data()), payload.size()));
}

std::optional<Snapshot> Client::splats(int step) {
    const auto payload = ask("splats " + std::to_string(step));
    if (payload.empty()) return std::nullopt;
    return decode_snapshot(payload);
}

void Client::command(const std::string& name) {
    ask(name);
}

}  // namespace ewa::live
