// SPDX-License-Identifier: Apache-2.0
// Where the portions of a rank are. One portion stays on the device. The host holds all of several, and the device as many as
// fit in its limit. Visits then go forwards and backwards in turn, so the last portions of a visit are the first ones of the
// next.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "pipeline/model.h"
#include "portions/lists.h"

namespace ewa::portions {

/// The arrays of a portion's splats. list_indices: ViewBuffers::list_indices, from a list to its update.
enum Array : size_t { params, moments1, moments2, statistics, list_indices, arrays };
const char* name_of(Array array);
/// Bytes of so many splats.
uint64_t bytes_of(Array array, uint32_t splats, int sh_degree);

/// What a portion has on the device while it is used. statistics: and parameters.
enum class Need { params, statistics, state };

struct Setup {
    int count = 1;       // portions of each rank
    uint64_t limit = 0;  // of the device's memory, bytes; with several portions
    int moments = 0;     // arrays of moments
    bool statistics = false;
};

class Holder {
  public:
    explicit Holder(const Setup& setup);
    virtual ~Holder() = default;
    Holder(const Holder&) = delete;
    Holder& operator=(const Holder&) = delete;

    int count() const { return int(own_.size()); }
    uint32_t splats() const;
    uint64_t state_bytes(uint32_t splats) const;  // of so many splats
    /// The arrays of a state that the portions have.
    std::span<const Array> kept() const { return kept_; }
    /// A portion, whose arrays may be elsewhere.
    pipeline::Model& model(int portion) { return own_[size_t(portion)].model; }
    Streaming& streaming() { return streaming_; }
    virtual std::unique_ptr<Lists> make_lists() = 0;

    /// A portion with the arrays that are needed. They stay until another portion is used.
    virtual pipeline::Model& use(int portion, Need need) = 0;
    /// The state of the portion in use has changed in place.
    virtual void changed() = 0;
    /// The list indices of the portion in use. The caller moves them away or sets them.
    virtual gpu::Buffer& indices() = 0;
    /// Calls visit(portion, its model) for all, in the direction that finds most of them on the device.
    virtual void visit(Need need, const std::function<void(int, pipeline::Model&)>& visit) = 0;

    /// An array of a state, of a portion; and of all portions, one after another.
    virtual std::vector<std::byte> download(int portion, Array array) = 0;
    std::vector<std::byte> download(Array array);
    /// Gives a portion an array that it lacks, or takes one away.
    virtual void give(int portion, Array array, std::vector<std::byte> bytes) = 0;
    virtual void remove(int portion, Array array) { buffer(portion, array) = gpu::Buffer(); }
    /// Takes all arrays away. like: the portion without arrays.
    void clear(int portion, pipeline::Model like);

  protected:
    gpu::Buffer& buffer(int portion, size_t array);
    uint64_t bytes(int portion, Array array) {
        return bytes_of(array, model(portion).splats, model(portion).sh_degree);
    }

  private:
    struct Portion {
        pipeline::Model model;
        gpu::Buffer list_indices;
    };
    std::vector<Portion> own_;
    std::vector<Array> kept_;
    Streaming streaming_;
};

/// With several portions it limits the device's memory as long as it lives.
std::unique_ptr<Holder> make_holder(gpu::Device& device, const Setup& setup);

}  // namespace ewa::portions
