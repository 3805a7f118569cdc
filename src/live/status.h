// SPDX-License-Identifier: Apache-2.0
// The state of a training run, as GET /status answers it, and what POST /edit answers.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "report/summary.h"

namespace ewa::live {

inline constexpr size_t kMostLines = 2000;                // of metrics in one answer
inline constexpr const char* kFrozenProperty = "frozen";  // of the PLY of GET /splats

enum class State { running, paused, done };

struct Status {
    std::string run = {};  // a random name: a new run may answer at the address of an old one
    int step = 0, steps = 0;
    uint32_t splats = 0;
    double loss = 0, seconds = 0;  // loss: NaN before the first step; seconds: only of training
    State state = State::running;
    bool commands = false;  // whether this client may give commands
    std::vector<report::MetricsLine> metrics = {};
};

/// One JSON object with the members of Status by name; "state" is "running", "paused" or "done".
std::string encode(const Status& status);
/// Throws InputError that names the member.
Status decode_status(const std::string& text);

struct EditReply {
    int step = 0;         // after which the splats were edited
    uint32_t splats = 0;  // that are left
    EditCounts counts = {};
};

/// One JSON object with step, splats, removed, frozen and unfrozen.
std::string encode(const EditReply& reply);
/// Throws InputError that names the member.
EditReply decode_edit_reply(const std::string& text);

/// The time to the end of the run, s, if it continues as in its last lines of metrics. NaN if these do not suffice, or it does
/// not run.
double seconds_left(const Status& status);

}  // namespace ewa::live
