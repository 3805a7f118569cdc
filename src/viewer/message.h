// SPDX-License-Identifier: Apache-2.0
// Text over the picture that disappears after some seconds.
#pragma once
#include <chrono>
#include <string>

namespace ewa::viewer {

struct Message {
    using Clock = std::chrono::steady_clock;
    std::string note;  // the last one; the panel shows it after the picture
    Clock::time_point note_until{}, hint_until{};

    void say(const std::string& text) {
        note = text;
        note_until = Clock::now() + std::chrono::seconds(10);
    }
    void hint() { hint_until = Clock::now() + std::chrono::seconds(15); }
    /// Whether the note is over the picture. An empty one never is.
    bool noting(Clock::time_point now) const { return !note.empty() && now < note_until; }
    bool hinting(Clock::time_point now) const { return now < hint_until; }

    /// Hides what has been shown long enough. Returns whether something changed.
    bool expire(Clock::time_point now) {
        bool expired = false;
        for (Clock::time_point* until : {&hint_until, &note_until}) {
            if (*until == Clock::time_point{} || now < *until) continue;
            *until = {};
            expired = true;
        }
        return expired;
    }
};

}  // namespace ewa::viewer
