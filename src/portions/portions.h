// SPDX-License-Identifier: Apache-2.0
// The splats of a training, in portions. A portion has a range of the one order that all ranks agree on, in whole blocks of
// PARAM_BLOCK splats. The arrays of all portions one after another are those of a training in one portion.
//
// Each rank holds as many portions as any other: one, which stays on the device, or several. The host then holds all of them,
// and the device as many as fit in its limit. Visits go forwards and backwards in turn, so the last portions of a visit are
// the first ones of the next.
#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "ewa/ranks.h"
#include "pipeline/model.h"

namespace ewa::portions {

struct Range {
    uint32_t first = 0, splats = 0;
};
/// The splats of a portion, of `all` splats in so many portions.
Range range_of(uint32_t all, int portion, int portions);

/// Throws RunError if some portion would have no splats.
void check_portions(uint32_t all, int portions);

constexpr size_t kTexelBytes = 16;
/// Copies the texels of splat i, one after another, from or to an array with the layout of the parameters.
void pack_splat(const std::byte* array, uint32_t planes, size_t i, std::byte* to);
void unpack_splat(const std::byte* from, uint32_t planes, size_t i, std::byte* array);

/// The arrays of a portion's splats. list_indices: ViewBuffers::list_indices, from a list to its update.
enum Array : size_t { params, moments1, moments2, statistics, list_indices, arrays };

struct Setup {
    int count = 1;       // portions of each rank
    uint64_t limit = 0;  // of the device's memory, bytes; with several portions
    int moments = 0;     // arrays of moments
    bool statistics = false;
};

class Portions {
  public:
    /// What a portion has on the device while it is used. statistics: and parameters.
    enum class Need { params, statistics, state };

    /// Divides the first splats. With several portions it limits the device's memory as long as this lives. All ranks have
    /// the same setup.
    Portions(gpu::Device& device, std::shared_ptr<Ranks> ranks, const Gaussians& start, const Setup& setup);
    ~Portions();
    Portions(const Portions&) = delete;
    Portions& operator=(const Portions&) = delete;

    Ranks& ranks() const { return *ranks_; }
    int count() const { return int(own_.size()); }          // of this rank
    int all() const { return count() * ranks_->size(); }    // of all ranks
    int first() const { return count() * ranks_->rank(); }  // number of this rank's first one
    int rank_of(int portion) const { return portion / count(); }
    bool alone() const { return all() == 1; }
    /// Whether portions leave the device.
    bool streamed() const { return count() > 1; }

    uint32_t splats() const { return splats_; }  // of all portions
    uint32_t own_splats() const;                 // of this rank
    uint32_t largest() const;                    // of a portion of this rank
    int sh_degree() const { return sh_degree_; }
    const glm::dvec3& origin() const { return origin_; }

    /// The portion, among this rank's, with the arrays that are needed. They stay until another portion is used.
    pipeline::Model& use(int portion, Need need);
    /// The state of the portion in use has changed in place.
    void changed();
    gpu::Buffer take_list_indices();
    void keep_list_indices(gpu::Buffer listed);
    /// Calls visit(portion, its model) for this rank's, in the direction that finds most of them on the device.
    void visit(Need need, const std::function<void(int, pipeline::Model&)>& visit);

    /// Moves splats between portions until each has its range again, after their numbers have changed. Statistics
    /// begin again. Collective. Throws what check_portions throws.
    void level();

    /// The arrays of a state that a training has.
    std::span<const Array> kept() const { return kept_; }
    static const char* name_of(Array array);
    uint64_t bytes_of(Array array, uint32_t splats) const;
    uint64_t state_bytes(uint32_t splats) const;  // of all of them
    // What follows is collective, as level().
    /// Rank 0 gets an array of all portions in pieces, as by portions::pass_on.
    void pass_on(Array array, const std::function<void(uint64_t bytes, uint32_t checksum)>& begin,
                 const std::function<void(std::span<const std::byte>)>& take);
    /// Gives the portions an array that they lack, of splats() splats, as portions::hand_out divides it.
    void hand_out(Array array, const std::function<void(uint64_t offset, std::span<std::byte>)>& read);
    /// The splats, on rank 0; empty on the others.
    Gaussians gaussians();
    /// Bytes of rank 0, on every rank.
    std::vector<std::byte> sent(std::span<const std::byte> own) const;

    /// Takes away all arrays, for `splats` splats of all portions.
    void clear(uint32_t splats);
    // Bytes that were copied to the device and back so far, and the time that this took, in ms.
    uint64_t streamed_bytes() const { return streamed_; }
    double streaming() const { return streaming_; }
    /// Copies so many bytes.
    template <class Copy>
    void stream(uint64_t bytes, Copy copy) {
        const auto begin = std::chrono::steady_clock::now();
        copy();
        streaming_ +=
            std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
        streamed_ += bytes;
    }

  private:
    /// An array's bytes on the host, and which buffer has the same bytes.
    struct Kept {
        std::string name;
        gpu::Texel texel = gpu::Texel::none;
        std::vector<std::byte> bytes;
        uint64_t same_as = 0;  // Buffer::serial; 0: none
    };
    struct Portion {
        pipeline::Model model;
        gpu::Buffer list_indices;
        std::array<Kept, arrays> kept;
        gpu::Buffer& buffer(size_t array);
    };
    std::vector<std::byte> bytes_of(Portion& portion, Array array);
    /// An array of all of this rank's portions, one after another.
    std::vector<std::byte> bytes(Array array);
    void give(int portion, Array array, std::vector<std::byte> bytes);
    void copy_to_host(Portion& portion, size_t array);
    bool evict();
    int visits_until(int portion, size_t array) const;
    void level(Array array, const std::vector<Range>& before, const std::vector<Range>& after);

    gpu::Device& device_;
    std::shared_ptr<Ranks> ranks_;
    std::vector<Portion> own_;
    std::vector<Array> kept_;
    uint32_t splats_ = 0;
    int sh_degree_;
    glm::dvec3 origin_;
    int in_use_ = -1;
    bool forwards_ = true;
    Need need_ = Need::state;  // of the visit
    bool evicting_ = false;
    uint64_t streamed_ = 0;
    double streaming_ = 0;
};

}  // namespace ewa::portions
