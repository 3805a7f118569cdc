// SPDX-License-Identifier: Apache-2.0
#include "live/edit_queue.h"

#include <exception>
#include <utility>

#include "core/text.h"
#include "ewa/error.h"

namespace ewa::live {
namespace {

constexpr size_t kMostWaiting = 16;  // edits

}  // namespace

std::optional<EditQueue::Outcome> EditQueue::ask(std::string body, std::chrono::milliseconds wait) {
    const auto edit = std::make_shared<Edit>(Edit{.body = std::move(body)});
    std::unique_lock lock(mutex_);
    if (stop_ || waiting_.size() >= kMostWaiting) return std::nullopt;
    waiting_.push_back(edit);
    const auto settled = [&] { return stop_ || edit->outcome; };
    news_.wait_for(lock, wait, settled);
    if (edit->taken) news_.wait(lock, settled);
    std::erase(waiting_, edit);
    return edit->outcome;
}

bool EditQueue::perform(const std::function<EditReply(const std::string& body)>& perform) {
    for (bool any = false;; any = true) {
        std::shared_ptr<Edit> edit;
        {
            const std::lock_guard lock(mutex_);
            if (waiting_.empty()) return any;
            edit = waiting_.front();
            waiting_.pop_front();
            edit->taken = true;
        }
        Outcome outcome;
        std::exception_ptr failure;  // of the machine, which is no matter of the edit
        try {
            outcome.reply = perform(edit->body);
        } catch (const InputError& error) {
            outcome.refusal = core::one_line(error.what());
        } catch (const std::exception& error) {
            outcome.refusal = "the edit failed: " + core::one_line(error.what());
            if (dynamic_cast<const RunError*>(&error)) failure = std::current_exception();
        }
        {
            const std::lock_guard lock(mutex_);
            if (outcome.refusal.empty()) ++performed_;
            edit->outcome = std::move(outcome);
        }
        news_.notify_all();
        if (failure) std::rethrow_exception(failure);
    }
}

void EditQueue::stop() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    news_.notify_all();
}

uint64_t EditQueue::performed() const {
    const std::lock_guard lock(mutex_);
    return performed_;
}

}  // namespace ewa::live
