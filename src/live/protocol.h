// SPDX-License-Identifier: Apache-2.0
// Watching a training run over a socket. One client, one connection, one request at a time.
//
// A request is one line of text of at most kMostRequest bytes, words separated by a blank, ended by "\n". An
// answer is one line "ok <bytes>\n" with that many bytes of payload behind it, or "no <why>\n".
//
//   hello ewa-live 1        -> "ok" and nothing: this is such a server
//   token <text>            -> commands are taken from now on on this connection, where the text is the
//   server's token status <n>              -> JSON: {"step", "steps", "splats", "loss", "seconds", "state":
//   "running" | "paused" | "done",
//                              "commands": whether this connection may give any, "metrics": the lines of
//                              metrics.jsonl from the n-th on, at most kMostLines of them}
//   splats <step>           -> splats of a later step than this one, as encode() lays them out; empty where
//   there are none
//                              yet. Asking is what makes the trainer take them; it never waits for them to be
//                              sent.
//   pause | go | save       -> commands: hold the training before its next step, go on, save splats and
//   checkpoint. A pause
//                              ends with the connection that asked for it.
//
// A server answers strangers: it listens on the loopback unless told otherwise, takes commands only from who
// has its token, and closes a connection that sends a line too long or stays silent for kPatience. It has
// kMostClients places. Where they are taken, a newcomer gets that of whoever has no token and has been silent
// longest, for kSilence at least. Where nobody has, it may say hello and show the token, and whoever does has
// a place beyond those; anything else is refused. So nobody without the token can shut out who has it.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "ewa/gaussians.h"
#include "report/summary.h"

namespace ewa::live {

inline constexpr std::string_view kHello = "hello ewa-live 1";
inline constexpr size_t kMostRequest = 256;                  // bytes of a line, the end included
inline constexpr uint64_t kMostPayload = uint64_t(1) << 33;  // bytes a client takes
inline constexpr size_t kMostLines = 2000;                   // of metrics in an answer
inline constexpr int kMostClients = 8;
inline constexpr int kPatience = 30;  // seconds
inline constexpr int kSilence = 2;    // seconds, after which a place may go to a newcomer

enum class State { running, paused, done };

struct Status {
    int step = 0, steps = 0;
    uint32_t splats = 0;
    double loss = 0, seconds = 0;
    State state = State::running;
    bool commands = false;
    std::vector<report::MetricsLine> metrics;
};

std::string encode(const Status& status);
/// Throws InputError.
Status decode_status(const std::string& text);

/// 40 bytes: "EWAS", number of splats and SH degree as little-endian uint32, step as int32, origin as three
/// float64; then means, quaternions, log scales, opacity logits and SH as Gaussians has them, little-endian
/// float32.
struct Snapshot {
    int step = 0;
    Gaussians gaussians;
};
std::vector<std::byte> encode(const Snapshot& snapshot);
/// Throws InputError where the bytes are not exactly such a snapshot.
Snapshot decode_snapshot(const std::vector<std::byte>& bytes);

/// "ok 12" -> 12. Throws InputError for a refusal, with its reason, and for anything else.
uint64_t payload_of(const std::string& line);

}  // namespace ewa::live
