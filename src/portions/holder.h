// SPDX-License-Identifier: Apache-2.0
// Stores a rank's portions: ranges of the scene's splats. A single portion stays on the device. Several portions are in host
// memory, and on the device as many as fit in its limit. Visits of all portions then alternate in direction. So a visit begins with
// portions that the last visit has left on the device.
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

/// The arrays of a portion's splats. list_indices: ViewBuffers::list_indices, which exist between the listing of a portion's splats
/// and their update.
enum Array : size_t { params, moments1, moments2, statistics, list_indices, arrays };
const char* name_of(Array array);
/// The size in bytes of this array for this many splats.
uint64_t bytes_of(Array array, uint32_t splats, int sh_degree);

/// The arrays that a portion needs on the device while it is used. statistics: statistics and parameters. state: all arrays.
enum class Need { params, statistics, state };

struct Setup {
    int count = 1;       // portions of each rank
    uint64_t limit = 0;  // of device memory in bytes; applies with several portions
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
    uint64_t state_bytes(uint32_t splats) const;  // of all stored arrays
    /// The arrays that each portion has and that a checkpoint stores.
    std::span<const Array> kept() const { return kept_; }
    /// The model of a portion. Its arrays need not be on the device.
    pipeline::Model& model(int portion) { return own_[size_t(portion)].model; }
    Streaming& streaming() { return streaming_; }
    virtual std::unique_ptr<Lists> make_lists() = 0;

    /// Brings the needed arrays of a portion to the device. They stay there until the next call of use.
    virtual pipeline::Model& use(int portion, Need need) = 0;
    /// Call it after the arrays of the portion in use have changed on the device: copies in host memory are then out of date.
    virtual void changed() = 0;
    /// The list indices of the portion in use. The caller moves the buffer out, or sets it.
    virtual gpu::Buffer& indices() = 0;
    /// Calls visit(portion, its model) for all, in the direction that finds most of them on the device.
    virtual void visit(Need need, const std::function<void(int, pipeline::Model&)>& visit) = 0;

    /// Reads back an array of one portion. The overload without `portion` joins those of all portions.
    virtual std::vector<std::byte> download(int portion, Array array) = 0;
    std::vector<std::byte> download(Array array);
    /// give adds an array that a portion lacks. remove frees an array of a portion.
    virtual void give(int portion, Array array, std::vector<std::byte> bytes) = 0;
    virtual void remove(int portion, Array array) { buffer(portion, array) = gpu::Buffer(); }
    /// Frees all arrays of a portion and replaces its model. like: a model without arrays.
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

/// Makes a holder. With several portions, the holder limits the device's memory to setup.limit while it exists.
std::unique_ptr<Holder> make_holder(gpu::Device& device, const Setup& setup);

}  // namespace ewa::portions
