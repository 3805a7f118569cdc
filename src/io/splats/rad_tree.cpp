// SPDX-License-Identifier: Apache-2.0
#include <cassert>
#include <limits>
#include <span>

#include "ewa/splat_edit.h"
#include "io/splats/rad.h"
#include "scene/decimate.h"

namespace ewa::io {

namespace {

constexpr size_t kMostChildren = kRadChunk - 1;  // with the root, they are the first chunk

/// For each splat of a level, those of the finer level that are merged in it.
class Merged {
  public:
    Merged(const std::vector<uint32_t>& into, size_t splats) : begin_(splats + 1), finer_(into.size()) {
        for (const uint32_t splat : into) ++begin_[splat + 1];
        for (size_t i = 0; i < splats; ++i) begin_[i + 1] += begin_[i];
        std::vector<uint32_t> next(begin_.begin(), begin_.end() - 1);
        for (size_t i = 0; i < into.size(); ++i) finer_[next[into[i]]++] = uint32_t(i);
    }

    std::span<const uint32_t> of(size_t splat) const {
        return std::span(finer_).subspan(begin_[splat], begin_[splat + 1] - begin_[splat]);
    }

  private:
    std::vector<uint32_t> begin_, finer_;
};

class TreeOfLevels {
  public:
    TreeOfLevels(const Gaussians& gaussians, int levels) {
        finest_ = morton_order(gaussians);
        Gaussians left = gaussians;
        select_splats(left, finest_);
        const auto halve = [&](size_t target) {
            std::vector<uint32_t> into;
            scene::decimate_traced(left, target, {.into = &into});
            merged_.emplace_back(into, left.size());
            tree_.coarser.push_back(left);
        };
        for (int level = 1; left.size() > 1 && (level < levels || left.size() > kMostChildren); ++level)
            halve((left.size() + 1) / 2);
        if (left.size() > 1) order_ = morton_order(left);
        if (left.size() > 1) halve(1);
    }

    RadTree build() {
        std::vector<std::vector<uint32_t>> open(merged_.size() + 1);  // nodes by their level
        add(open, merged_.size(), 0);
        // From the coarsest level to the finest, so that a viewer which reads from the front has the whole of the scene early.
        for (size_t level = merged_.size(); level > 0; --level)
            for (const uint32_t node : open[level]) {
                std::span<const uint32_t> children = merged_[level - 1].of(tree_.nodes[node].index);
                if (level == merged_.size() && !order_.empty()) children = order_;
                assert(children.size() <= std::numeric_limits<uint16_t>::max());
                tree_.nodes[node].child_start = uint32_t(tree_.nodes.size());
                tree_.nodes[node].child_count = uint16_t(children.size());
                for (const uint32_t child : children) add(open, level - 1, child);
            }
        return std::move(tree_);
    }

  private:
    /// Adds the splat as a node of the finest level that has it.
    void add(std::vector<std::vector<uint32_t>>& open, size_t level, uint32_t index) {
        while (level > 0 && merged_[level - 1].of(index).size() == 1) index = merged_[--level].of(index)[0];
        open[level].push_back(uint32_t(tree_.nodes.size()));
        tree_.nodes.push_back({level == 0 ? finest_[index] : index, 0, 0, uint16_t(level)});
    }

    RadTree tree_;
    std::vector<Merged> merged_;    // of each level from 1 on
    std::vector<uint32_t> order_;   // of the root's children
    std::vector<uint32_t> finest_;  // the scene's splats, in the order in which they are merged
};

}  // namespace

RadTree build_rad_tree(const Gaussians& gaussians, int levels) {
    return TreeOfLevels(gaussians, levels).build();
}

}  // namespace ewa::io
