// SPDX-License-Identifier: Apache-2.0
// Undo and redo of the saved views, which are the keys of the film. Independent of the window.
#pragma once
#include <cstddef>
#include <utility>
#include <vector>

#include "io/datasets/view_list.h"

namespace ewa::viewer {

/// The earlier states of the views. Their changes are ordered among the edits of the scene by the number of edits that are done:
/// what was done last is undone first.
class ViewHistory {
  public:
    using Views = std::vector<io::NamedView>;

    /// views: at the beginning, where no undo() goes further back.
    explicit ViewHistory(Views views) : now_(std::move(views)) {}

    /// Keeps the state before, if the views have changed since the last call. A view that gets its first time has not changed.
    void watch(const Views& views, size_t edits);
    /// Takes the last change back, unless an edit came after it. Returns whether it did.
    bool undo(Views& views, size_t edits) { return go(views, edits, undone_, done_); }
    /// Makes the change again that undo() took back last, unless an edit comes before it.
    bool redo(Views& views, size_t edits) { return go(views, edits, done_, undone_); }

  private:
    struct Change {
        Views views;   // of the state on the other side of the change
        size_t edits;  // done when it was made
    };
    bool go(Views& views, size_t edits, std::vector<Change>& to, std::vector<Change>& from);

    Views now_;
    std::vector<Change> done_, undone_;
};

}  // namespace ewa::viewer
