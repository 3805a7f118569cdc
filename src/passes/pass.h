// SPDX-License-Identifier: Apache-2.0
// The common parts of all passes. A pass is a struct that describes one shader (passes.h). It has
// - shader: the file in shaders/passes without extension, which is also the name of the timing;
// - Work: the push constants (Push), or those of a uniform block, the invocations of a workgroup (group_size), and the workgroups
//   (groups);
// - data members: one gpu::BufferPart for each of the shader's bindings, in their order.
// A pass does not say what it reads or writes: a recording derives that from the shader.
#pragma once
#include <array>
#include <bit>
#include <functional>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include "gpu/recording.h"
#include "passes/kernel_config.h"

namespace ewa::passes {

/// A workgroup of invocations that each own an element.
template <class P>
struct ElementGroup {
    using Push = P;
    static uint32_t group_size(const KernelConfig& config) { return config.element_group; }
};

/// A workgroup that is a subgroup; there is one.
template <class P>
struct OneSubgroup {
    using Push = P;
    static uint32_t group_size(const KernelConfig& config) { return config.subgroup; }
    static Groups groups(const KernelConfig&, const Push&) { return {1, 1, 1}; }
};

template <class P>
P push_of(uint32_t P::*);
template <class P>
P push_of(uint64_t (*)(const P&));

/// One invocation an element, in each of kLayers layers. kItems: the member of the push constants that counts
/// the elements, or a function of the push constants.
template <auto kItems, uint32_t kLayers = 1>
struct PerElement : ElementGroup<decltype(push_of(kItems))> {
    static Groups groups(const KernelConfig& config, const decltype(push_of(kItems))& push) {
        return element_groups(config, std::invoke(kItems, push), kLayers);
    }
};

/// The same for a pass whose values are in a uniform block. `Push` is then the block, of which only the number of elements is read.
template <auto kItems>
struct PerElementOfBlock : PerElement<kItems> {
    static constexpr bool push_in_buffer = true;
};

/// One invocation for each of push.splats, in a layer for each of push.views.
template <class P>
struct PerViewElement : ElementGroup<P> {
    static Groups groups(const KernelConfig& config, const P& push) {
        return element_groups(config, push.splats, push.views);
    }
};

/// One subgroup for each block of push.block items.
template <class P>
struct PerBlock : OneSubgroup<P> {
    static Groups groups(const KernelConfig& config, const P& push) {
        return block_groups(config, push.items, push.block);
    }
};

/// One subgroup a tile.
struct PerTile : OneSubgroup<shared::BlendPush> {
    static Groups groups(const KernelConfig& config, const Push& push) { return tile_groups(config, push); }
};

/// Four subgroups a quad, of a pass that otherwise has one a tile. Variant: SPEC_QUADS too.
template <class PassOfTiles>
struct OfQuads : PassOfTiles {
    struct Work : PerTile {
        static uint32_t group_size(const KernelConfig& config) {
            return shared::QUAD_TILES * config.subgroup;
        }
    };
};

/// Strips of a tile, in each of which a lane has one pixel.
inline uint32_t strips_of(const KernelConfig& config) {
    return config.tile_width * config.tile_height / config.subgroup;
}

/// One subgroup a tile, for one of its strips.
struct StripPerTile : OneSubgroup<shared::RayPush> {
    static Groups groups(const KernelConfig& config, const Push& push) {
        return tile_groups(config, push.blend);
    }
};

/// One subgroup for each strip of a tile.
struct PerStrip : OneSubgroup<shared::RayPush> {
    static Groups groups(const KernelConfig& config, const Push& push) {
        const Groups tiles = tile_groups(config, push.blend);
        return {tiles[0], tiles[1], strips_of(config)};
    }
};

/// One invocation a lane of the radix sort.
struct PerSortLane {
    using Push = shared::SortPush;
    static uint32_t group_size(const KernelConfig& config) { return config.sort_group; }
    static Groups groups(const KernelConfig& config, const Push& push) {
        return {(push.lanes + config.sort_group - 1) / config.sort_group, 1, 1};
    }
};

/// One workgroup for each block of keys that are ranked in shared memory.
struct PerRankedBlock {
    using Push = shared::SortPush;
    static uint32_t group_size(const KernelConfig& config) { return ranked_group(config); }
    static Groups groups(const KernelConfig& config, const Push& push) { return grid_of(config, push.lanes); }
};

using Constants = std::vector<gpu::SpecConstant>;

/// A compiled pass.
template <class Definition>
struct Pass {
    using Push = typename Definition::Work::Push;
    const gpu::Pipeline& pipeline;
    const KernelConfig& config;

    void record(gpu::Recording& recording, const Definition& buffers, const Push& push,
                const char* name = Definition::shader) const {
        record(recording, buffers, push, Definition::Work::groups(config, push), name);
    }
    /// groups: the dispatch's workgroups, as Recording::dispatch takes them.
    void record(gpu::Recording& recording, const Definition& buffers, const Push& push,
                const gpu::Workgroups& groups, const char* name = Definition::shader) const {
        constexpr size_t kParts = sizeof(Definition) / sizeof(gpu::BufferPart);
        static_assert(sizeof(Definition) == kParts * sizeof(gpu::BufferPart));
        std::span<const std::byte> constants;
        if constexpr (!requires { Definition::Work::push_in_buffer; })
            constants = std::as_bytes(std::span(&push, 1));
        recording.dispatch(pipeline, name, std::bit_cast<std::array<gpu::BufferPart, kParts>>(buffers),
                           constants, groups);
    }
};

/// The passes of a device for one configuration. The device compiles each at its first use, and keeps it.
class PassCache {
  public:
    explicit PassCache(gpu::Device& device) : PassCache(device, config_for(device.limits())) {}
    PassCache(gpu::Device& device, const KernelConfig& config) : device_(device), config_(config) {}
    PassCache(const PassCache&) = delete;

    gpu::Device& device() const { return device_; }
    const KernelConfig& config() const { return config_; }

    /// variant: the shader's specialisation constants (SPEC_*) that the configuration does not set; SPEC_SHARP,
    /// SPEC_KERNEL, SPEC_PARTS, SPEC_SLOTS and SPEC_QUADS are 0 without. Throws std::logic_error if one is missing or the shader does not declare it.
    template <class Definition>
    Pass<Definition> get(const Constants& variant = {}) {
        return {pipeline(Definition::shader, Definition::Work::group_size(config_), variant), config_};
    }

  private:
    const gpu::Pipeline& pipeline(std::string_view shader, uint32_t group_size, const Constants& variant);

    gpu::Device& device_;
    KernelConfig config_;
    std::map<std::pair<std::string_view, Constants>, const gpu::Pipeline*> pipelines_;
};

/// Records passes: the recording, and the passes of its device.
struct Recorder {
    gpu::Recording& recording;
    PassCache& cache;

    /// variant: see PassCache::get. name: of the timing.
    template <class Definition>
    void record(const Definition& buffers, const typename Pass<Definition>::Push& push,
                const Constants& variant = {}, const char* name = Definition::shader) const {
        cache.get<Definition>(variant).record(recording, buffers, push, name);
    }
};

}  // namespace ewa::passes
