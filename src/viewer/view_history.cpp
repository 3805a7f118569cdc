// SPDX-License-Identifier: Apache-2.0
#include "viewer/view_history.h"

#include <algorithm>

namespace ewa::viewer {
namespace {

constexpr size_t kMostChanges = 100;

bool same_key(const io::NamedView& a, const io::NamedView& b) {
    return a.name == b.name && a.pivot == b.pivot && a.camera.rotation == b.camera.rotation &&
           a.camera.translation == b.camera.translation && (!a.time || !b.time || a.time == b.time);
}

}  // namespace

void ViewHistory::watch(const Views& views, size_t edits) {
    if (!std::ranges::equal(views, now_, same_key)) {
        done_.push_back({std::move(now_), edits});
        undone_.clear();
        if (done_.size() > kMostChanges) done_.erase(done_.begin());
    }
    now_ = views;
}

bool ViewHistory::go(Views& views, size_t edits, std::vector<Change>& to, std::vector<Change>& from) {
    watch(views, edits);
    if (from.empty() || from.back().edits != edits) return false;
    Change change = std::move(from.back());
    from.pop_back();
    to.push_back({std::move(views), edits});
    views = now_ = std::move(change.views);
    return true;
}

}  // namespace ewa::viewer
