// SPDX-License-Identifier: Apache-2.0
// Prefix sums, radix sort, and the lists of (splat, tile) instances built with them.
#pragma once
#include "passes/pass.h"

namespace ewa::passes {

/// Exclusive prefix sums within blocks. Variant: SPEC_MODE (0 or SCAN_GATHERED).
struct ScanBlocks : SubgroupPass {
    static constexpr char shader[] = "scan_blocks";
    struct Buffers {
        gpu::BufferPart source, order, prefix, totals;
    };
    using Push = shared::ScanPush;
    static Groups groups(const KernelConfig& c, const Push& push) {
        return block_groups(c, push.items, push.block);
    }
};

/// Exclusive prefix sum of the blocks' totals, in place, followed by the grand total.
struct ScanTotals : SubgroupPass {
    static constexpr char shader[] = "scan_totals";
    struct Buffers {
        gpu::BufferPart totals, counts;
    };
    using Push = shared::ScanTotalsPush;
    static Groups groups(const KernelConfig&, const Push&) { return {1, 1, 1}; }
};

/// One invocation is one lane of the sort.
struct SortPass {
    using Push = shared::SortPush;
    static uint32_t group_size(const KernelConfig& config) { return config.sort_group; }
    static Groups groups(const KernelConfig& c, const Push& push) {
        return {(push.lanes + c.sort_group - 1) / c.sort_group, 1, 1};
    }
};

/// Counts the digits of a radix pass. Variant: SPEC_RADIX_BITS.
struct RadixCount : SortPass {
    static constexpr char shader[] = "radix_count";
    struct Buffers {
        gpu::BufferPart keys, counters, counts;
    };
};

/// Moves the pairs of a radix pass. Variant: SPEC_RADIX_BITS, SPEC_MODE (SORT_* bits).
struct RadixScatter : SortPass {
    static constexpr char shader[] = "radix_scatter";
    struct Buffers {
        gpu::BufferPart keys, values, counters, bases, counts, keys_out, values_out, indices, indices_out;
    };
};

/// Writes the (splat, tile) instances in depth order. Variant: SPEC_MODE (0 or EMIT_FIRST_INSTANCES).
struct EmitInstances : ElementPass {
    static constexpr char shader[] = "emit_instances";
    struct Buffers {
        gpu::BufferPart records, order, tile_counts, prefix, totals, counts, keys, splats, first_instances;
    };
    using Push = shared::EmitPush;
    static Groups groups(const KernelConfig& c, const Push& push) {
        return element_groups(c, push.splats, (push.tiles[1] + push.strip_rows - 1) / push.strip_rows);
    }
};

/// Finds where each tile's instances begin in the sorted list.
struct TileStarts : ElementPass {
    static constexpr char shader[] = "tile_starts";
    struct Buffers {
        gpu::BufferPart keys, counts, tile_starts;
    };
    using Push = shared::TileStartsPush;
    static Groups groups(const KernelConfig& c, const Push& push) {
        return element_groups(c, uint64_t(push.tiles) + 2);
    }
};

}  // namespace ewa::passes
