// SPDX-License-Identifier: Apache-2.0
// Edits that clients ask for, until the training loop performs them.
#pragma once
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "live/status.h"

namespace ewa::live {

/// Safe to use from several threads.
class EditQueue {
  public:
    /// What became of an edit.
    struct Outcome {
        EditReply reply = {};
        std::string refusal = {};  // one line; empty: it was performed
    };

    /// Waits until the edit is performed or refused. Returns nothing if none has taken it after `wait`, or too many edits wait, or
    /// after stop(): the edit is then not performed. Once it is taken, the wait continues.
    std::optional<Outcome> ask(std::string body, std::chrono::milliseconds wait);
    /// Performs the edits that wait, in order. perform: gets the body; whatever it throws is a refusal. Its RunError is thrown on, once
    /// the edit is answered. Returns whether there was an edit.
    bool perform(const std::function<EditReply(const std::string& body)>& perform);
    /// Ends all waits.
    void stop();
    uint64_t performed() const;

  private:
    struct Edit {
        std::string body;
        bool taken = false;
        std::optional<Outcome> outcome = {};
    };

    mutable std::mutex mutex_;
    std::condition_variable news_;
    std::deque<std::shared_ptr<Edit>> waiting_;
    uint64_t performed_ = 0;
    bool stop_ = false;
};

}  // namespace ewa::live
