// SPDX-License-Identifier: Apache-2.0
#include "operators/device_lists.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "operators/array.h"

namespace ewa::operators {
namespace {

uint32_t ceil_divide(uint32_t a, uint32_t b) {
    return (a + b - 1) / b;
}

/// The pixels that a splat may reach: [low, high) on each axis.
struct Reach {
    double low[2] = {0, 0}, high[2] = {0, 0};
};

/// A little more than the box of the ellipse in which alpha is 1/255 or more. A skipped splat has an empty one.
Reach reach_of(const ScreenSplats& splats, size_t i) {
    const float* shape = &splats.conics[3 * i];
    const double a = shape[0], b = shape[1], c = shape[2];
    double half[2];  // of the ellipse d^T conic d = 2
    if (splats.whiteners) {
        half[0] = std::sqrt(1 / (a * a) + b * b / (c * c));
        half[1] = 1 / std::abs(c);
    } else {
        const double det = a * c - b * b;
        half[0] = std::sqrt(2 * c / det);
        half[1] = std::sqrt(2 * a / det);
    }
    const double size = std::sqrt(std::log(double(splats.opacities[i]) / shared::ALPHA_MIN));
    Reach reach;
    for (size_t axis = 0; axis < 2; ++axis) {
        const double mean = splats.means2d[2 * i + axis], radius = 1.001 * size * half[axis] + 1;
        if (!std::isfinite(mean + radius)) return {};
        reach.low[axis] = mean - radius;
        reach.high[axis] = mean + radius;
    }
    return reach;
}

/// A box of cells, with both ends.
struct Cells {
    uint32_t first[2], last[2];
    uint64_t count() const { return uint64_t(last[0] - first[0] + 1) * (last[1] - first[1] + 1); }
};

/// Tiles of the device, or their parts where instances have some. Cell c of a tile is part c, row by row.
struct Grid {
    uint32_t width, height;    // of a cell, px
    uint32_t across, down;     // cells of a tile
    uint32_t tiles_x;          // of the image
    uint32_t image[2];         // px
    uint32_t caller, columns;  // of the caller's tiles: size in px, number in a row

    size_t cells() const { return size_t(across) * down; }
    size_t index(uint32_t x, uint32_t y) const {
        const size_t tile = size_t(y / down) * tiles_x + x / across;
        return tile * cells() + (y % down) * across + x % across;
    }
    /// The cells of a caller's tile that the reach overlaps; at least one.
    Cells overlapped(uint32_t tile, const Reach& reach) const {
        const uint32_t first[2] = {tile % columns * caller, tile / columns * caller},
                       size[2] = {width, height};
        Cells cells;
        for (size_t axis = 0; axis < 2; ++axis) {
            const uint32_t begin = first[axis] / size[axis];
            const uint32_t end = ceil_divide(std::min(first[axis] + caller, image[axis]), size[axis]);
            const auto within = [&](double pixel) {
                return uint32_t(std::clamp(std::floor(pixel / size[axis]), double(begin), double(end - 1)));
            };
            cells.first[axis] = within(reach.low[axis]);
            cells.last[axis] = within(reach.high[axis]);
        }
        return cells;
    }
};

Grid grid_of(const TileLists& lists, const pipeline::Sizes& s, const passes::KernelConfig& config) {
    const bool parts = have_parts(lists, config);
    const uint32_t width = parts ? std::min(shared::PART_SIZE, config.tile_width) : config.tile_width;
    const uint32_t height = parts ? shared::PART_SIZE : config.tile_height;
    return {.width = width,
            .height = height,
            .across = config.tile_width / width,
            .down = config.tile_height / height,
            .tiles_x = s.tiles_x,
            .image = {s.width, s.height},
            .caller = lists.tile_size,
            .columns = ceil_divide(s.width, lists.tile_size)};
}

void check_lists(const TileLists& lists, const Grid& grid, uint32_t splat_count) {
    const uint32_t rows = ceil_divide(grid.image[1], lists.tile_size);
    check_size("offsets", lists.offsets.size(), size_t(grid.columns) * rows + 1, "[tiles + 1]");
    for (size_t t = 0; t + 1 < lists.offsets.size(); ++t)
        if (lists.offsets[t] < 0 || lists.offsets[t] > lists.offsets[t + 1])
            throw InputError("offsets decrease at tile " + std::to_string(t));
    if (size_t(lists.offsets.back()) > lists.splats.size())
        throw InputError("offsets end at " + std::to_string(lists.offsets.back()) + ", and the lists have " +
                         std::to_string(lists.splats.size()) + " entries");
    for (const int32_t splat : lists.splats)
        if (splat < 0 || uint32_t(splat) >= splat_count)
            throw InputError("a list with splat " + std::to_string(splat) + " of " +
                             std::to_string(splat_count));
    if (grid.cells() > 1 && splat_count >> shared::PART_SHIFT > 0)
        throw InputError("tiles of " + std::to_string(lists.tile_size) + " px take at most " +
                         std::to_string(1u << shared::PART_SHIFT) + " splats");
}

}  // namespace

bool have_parts(const TileLists& lists, const passes::KernelConfig& config) {
    return lists.tile_size % config.tile_width != 0 || lists.tile_size % config.tile_height != 0;
}

DeviceLists device_lists(const ScreenSplats& splats, const TileLists& lists, const pipeline::Sizes& s,
                         const passes::KernelConfig& config, const std::function<void(uint32_t)>& reserve) {
    if (lists.tile_size == 0 || lists.tile_size % shared::PART_SIZE != 0)
        throw InputError("lists of tiles of " + std::to_string(lists.tile_size) +
                         " px; a tile has a multiple of " + std::to_string(shared::PART_SIZE) + " px");
    const Grid grid = grid_of(lists, s, config);
    const auto count = uint32_t(splats.size());
    check_lists(lists, grid, count);
    std::vector<Reach> reaches(count);
    for (size_t i = 0; i < count; ++i) reaches[i] = reach_of(splats, i);
    const auto walk = [&](const auto& visit) {
        for (uint32_t tile = 0; tile + 1 < lists.offsets.size(); ++tile)
            for (int32_t e = lists.offsets[tile]; e < lists.offsets[tile + 1]; ++e) {
                const auto splat = uint32_t(lists.splats[size_t(e)]);
                visit(splat, grid.overlapped(tile, reaches[splat]));
            }
    };
    const auto walk_cells = [&](const auto& visit) {
        walk([&](uint32_t splat, const Cells& cells) {
            for (uint32_t y = cells.first[1]; y <= cells.last[1]; ++y)
                for (uint32_t x = cells.first[0]; x <= cells.last[0]; ++x) visit(splat, grid.index(x, y));
        });
    };

    uint64_t sum = 0;
    walk([&](uint32_t, const Cells& cells) { sum += cells.count(); });
    reserve(pipeline::checked_instances(sum));
    std::vector<uint64_t> places(size_t(s.tiles_x) * s.tiles_y * grid.cells(), 0);
    walk_cells([&](uint32_t, size_t cell) { ++places[cell]; });
    uint64_t begin = 0;
    for (uint64_t& place : places) place = std::exchange(begin, begin + place);

    DeviceLists d;
    for (size_t cell = 0; cell < places.size(); cell += grid.cells())
        d.tile_starts.push_back(uint32_t(places[cell]));
    // One more end: no instance follows those of the last tile.
    d.tile_starts.insert(d.tile_starts.end(), 2, uint32_t(sum));
    d.tile_counts.assign(count, 0);
    d.splats.resize(sum);
    walk_cells([&](uint32_t splat, size_t cell) {
        const auto part = uint32_t(cell % grid.cells());
        d.splats[places[cell]++] = grid.cells() > 1 ? splat | part << shared::PART_SHIFT : splat;
        ++d.tile_counts[splat];
    });
    d.first_instances.resize(count);
    uint32_t next = 0;
    for (uint32_t i = 0; i < count; ++i) d.first_instances[i] = std::exchange(next, next + d.tile_counts[i]);
    std::vector<uint32_t> ends = d.first_instances;
    d.sorted_indices.resize(sum);
    const uint32_t mask = grid.cells() > 1 ? (1u << shared::PART_SHIFT) - 1 : UINT32_MAX;
    for (uint32_t k = 0; k < sum; ++k) d.sorted_indices[ends[d.splats[k] & mask]++] = k;
    return d;
}

}  // namespace ewa::operators
