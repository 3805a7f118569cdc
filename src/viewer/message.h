// SPDX-License-Identifier: Apache-2.0
// Text over the picture that disappears after some seconds.
#pragma once
#include <algorithm>
#include <chrono>
#include <string>

namespace ewa::viewer {

struct Message {
    using Clock = std::chrono::steady_clock;
    std::string note;         // the last one; the panel shows it after the picture
    bool until_edit = false;  // the next edit removes it
    Clock::time_point note_until{}, hint_until{};
    static constexpr std::chrono::seconds kFade{2};

    void say(const std::string& text, bool until_next_edit = false) {
        note = text;
        until_edit = until_next_edit;
        note_until = Clock::now() + std::chrono::seconds(10);
    }
    void hint() { hint_until = Clock::now() + std::chrono::seconds(15); }
    /// Whether the note is over the picture. An empty one never is.
    bool noting(Clock::time_point now) const { return !note.empty() && now < note_until; }
    bool hinting(Clock::time_point now) const { return now < hint_until; }
    /// The hint fades in its last seconds.
    float hint_opacity(Clock::time_point now) const {
        return std::clamp(std::chrono::duration<float>(hint_until - now) / kFade, 0.0f, 1.0f);
    }

    /// Hides what has been shown long enough. Returns whether something changes.
    bool expire(Clock::time_point now) {
        bool expired = hinting(now) && hint_opacity(now) < 1;
        for (Clock::time_point* until : {&hint_until, &note_until}) {
            if (*until == Clock::time_point{} || now < *until) continue;
            *until = {};
            expired = true;
        }
        return expired;
    }
};

}  // namespace ewa::viewer
