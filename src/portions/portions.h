// SPDX-License-Identifier: Apache-2.0
// The splats of a training, in portions. All splats have one order on all ranks. A portion is a range of it, in whole blocks of
// PARAM_BLOCK splats. The arrays of all portions, joined in order, are those of a training in one portion. Each rank has the same
// number of portions.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "ewa/ranks.h"
#include "portions/holder.h"

namespace ewa::portions {

struct Range {
    uint32_t first = 0, splats = 0;
};
/// The range of a portion if `all` splats are divided into `portions` portions.
Range range_of(uint32_t all, int portion, int portions);

/// Throws RunError if some portion would have no splats.
void check_portions(uint32_t all, int portions);

constexpr size_t kTexelBytes = 16;
/// Copy splat i from or to an array with the layout of the parameters. Outside of the array, its `planes` texels are contiguous.
void pack_splat(const std::byte* array, uint32_t planes, size_t i, std::byte* to);
void unpack_splat(const std::byte* from, uint32_t planes, size_t i, std::byte* array);

class Portions {
  public:
    using Need = portions::Need;

    /// Divides the first splats. All ranks have the same setup.
    Portions(gpu::Device& device, std::shared_ptr<Ranks> ranks, const Gaussians& start, const Setup& setup);

    Ranks& ranks() const { return *ranks_; }
    /// The portions of this rank.
    Holder& holder() const { return *holder_; }
    int count() const { return count_; }                    // of this rank
    int all() const { return count() * ranks_->size(); }    // of all ranks
    int first() const { return count() * ranks_->rank(); }  // index of this rank's first portion
    int rank_of(int portion) const { return portion / count(); }
    bool alone() const { return all() == 1; }

    uint32_t splats() const { return splats_; }  // of all portions
    uint32_t largest() const;                    // of a portion of this rank
    int sh_degree() const { return sh_degree_; }
    const glm::dvec3& origin() const { return origin_; }

    // The same functions as Holder's.
    void changed() { holder_->changed(); }
    void visit(Need need, const std::function<void(int, pipeline::Model&)>& visit) {
        holder_->visit(need, visit);
    }

    /// Frees all arrays and sets the total number of splats to `splats`, divided among the portions.
    void clear(uint32_t splats);
    /// Moves splats between portions until each has its range again, after the numbers of splats in portions have changed.
    /// Statistics restart at zero. Collective. Throws what check_portions throws.
    void level();
    /// The splats of all portions, on rank 0; empty on other ranks. Collective.
    Gaussians gaussians();

  private:
    void level(Array array, const std::vector<Range>& before, const std::vector<Range>& after);

    std::shared_ptr<Ranks> ranks_;
    int count_;
    uint32_t splats_ = 0;
    int sh_degree_;
    glm::dvec3 origin_;
    std::unique_ptr<Holder> holder_;
};

}  // namespace ewa::portions
