// SPDX-License-Identifier: Apache-2.0
// A training step whose splats are in chunks. All chunks list what the views see, each view is drawn from the lists of all
// chunks, and all chunks are updated. Lists and sums of gradients wait in host memory.
#pragma once
#include <functional>
#include <span>
#include <vector>

#include "train/batch.h"
#include "train/chunks.h"

namespace ewa::train {

class ChunkBatch {
  public:
    /// parts.model is not used. more: what else the submission of a chunk's update does.
    BatchReport step(const BatchParts& parts, Chunks& chunks, std::span<const BatchView> views,
                     const pipeline::Rates& rates, int sh_degree,
                     const std::function<void(gpu::Recording&, const pipeline::Model&)>& more);

  private:
    /// What a view sees.
    struct Seen {
        std::vector<uint64_t> listed;  // of each chunk
        std::vector<std::vector<std::byte>> records;
        std::vector<std::byte> sums;
        uint64_t skipped = 0;  // splats
        explicit Seen(size_t chunks) : listed(chunks), records(chunks) {}
        double loss = 0, psnr = 0;
        uint64_t all() const;
        uint64_t before(int chunk) const;  // listed by the chunks before
    };
    void reserve(const BatchParts& parts, pipeline::FrameRequest request, uint64_t splats);
    void list(const BatchParts& parts, Chunks& chunks, std::span<const BatchView> views, int chunk,
              const pipeline::Model& model);
    void draw(const BatchParts& parts, Chunks& chunks, const BatchView& view, Seen& seen);
    shared::Counts draw_until_it_fits(const BatchParts& parts, const BatchView& view, uint32_t splats,
                                      const std::vector<std::byte>& records);
    void make_room_for_sums(const BatchParts& parts, uint64_t splats);
    void upload_sums(const BatchParts& parts, Chunks& chunks, int chunk);

    pipeline::ViewBuffers buffers_;  // of one chunk, and the sums of a chunk or a view
    std::vector<Seen> seen_;         // by each view
};

}  // namespace ewa::train
