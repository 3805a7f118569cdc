// SPDX-License-Identifier: Apache-2.0
// Which tiles a splat's ellipse {alpha >= ALPHA_MIN} reaches, tile row by tile row, in closed form.
// The result may include too many tiles but never too few, so culling never changes the image.
#ifndef EWA_LIB_FOOTPRINT
#define EWA_LIB_FOOTPRINT

layout(constant_id = SPEC_TILE_WIDTH) const uint TILE_WIDTH = 8;
layout(constant_id = SPEC_TILE_HEIGHT) const uint TILE_HEIGHT = 8;
layout(constant_id = SPEC_WRAP) const uint WRAP = 0u;
layout(constant_id = SPEC_QUADS) const uint QUADS = 0u;

struct Footprint {
    vec2 mean;       // px
    float ux, k, vy; // as in the record
    float reach;     // u^2 + v^2 <= reach^2 where alpha >= ALPHA_MIN
    uint row_begin, row_end;  // of lists: of tiles, or of quads
    uvec2 tile_rows;          // first, one past last
};

// Slack for rounding, in units of u and v. An ordinary splat has a reach of at most 3.3.
const float REACH_SLACK = 1e-3;

// First and one-past-last tile with a pixel centre in mean + [left, right] (px), of `size` pixels. The slack covers the
// rounding of the terms, which may be far larger than their sum.
uvec2 tiles_between(float mean, float left, float right, uint tile, uint size) {
    const float slack = 1e-3 + 4e-7 * (abs(mean) + abs(left) + abs(right));
    const float low = mean + left, high = mean + right;
    const float first = ceil(clamp(low - slack - 0.5, -1.0, float(size)));
    const float last = floor(clamp(high + slack - 0.5, -1.0, float(size)));
    const int begin = max(int(first), 0), end = min(int(last), int(size) - 1);
    return begin <= end ? uvec2(uint(begin) / tile, uint(end) / tile + 1u) : uvec2(0u);
}

// Empty (row_begin == row_end) where the opacity is below ALPHA_MIN or a value is NaN.
Footprint footprint_of(vec4 record0, vec4 record1, uvec2 size) {
    Footprint f;
    f.mean = record0.xy;
    f.ux = record1.x;
    f.k = record1.y;
    f.vy = record1.z;
    const float ratio = record1.w / CUT_OFF;
    f.reach = sqrt(max(0.0, log(max(ratio, 1.0)) * 1.00001 + 1e-5)) + REACH_SLACK;
    f.tile_rows = uvec2(0u);
    if (ratio >= 1.0) {
        const float half_height = f.reach / f.vy;
        f.tile_rows = tiles_between(f.mean.y, -half_height, half_height, TILE_HEIGHT, size.y);
    }
    f.row_begin = QUADS != 0u ? f.tile_rows.x / 2u : f.tile_rows.x;
    f.row_end = QUADS != 0u ? (f.tile_rows.y + 1u) / 2u : f.tile_rows.y;
    return f;
}

// Right border of the ellipse at height dy, relative to the mean: x with ux (x - k dy) = sqrt(reach^2 - (vy dy)^2).
float border(Footprint f, float dy) {
    const float v = f.vy * dy;
    return f.k * dy + (sqrt(max(0.0, f.reach * f.reach - v * v)) + REACH_SLACK) / f.ux;
}

// Quads in a row.
uint quads_of(uint width) { return (width + 2u * TILE_WIDTH - 1u) / (2u * TILE_WIDTH); }

// The same in an image whose left and right border are one line of the scene: from the first tile to the last, which may lie
// beyond the right border and then counts on from the left one.
uvec2 tiles_around(float mean, float left, float right, uint tile, uint size) {
    const uint tiles = QUADS != 0u ? 2u * quads_of(size) : (size + tile - 1u) / tile;
    const uvec2 here = tiles_between(mean, left, right, tile, size);
    const uvec2 above = tiles_between(mean + float(size), left, right, tile, size);
    const uvec2 below = tiles_between(mean - float(size), left, right, tile, size);
    const bool left_too = above.x < above.y, right_too = below.x < below.y;
    if (!left_too && !right_too) return here;
    // What lies at the right border, and what at the left.
    const uint begin = left_too ? above.x : here.x, end = right_too ? below.y : here.y;
    return left_too && right_too || begin <= end ? uvec2(0u, tiles) : uvec2(begin, tiles + end);
}

// Tile columns reached in a tile row. The border is concave in dy, so its maximum over the row's pixel centres is at its
// peak, or at the nearer end if the peak is outside the row. The left border is the right one turned by 180 degrees.
uvec2 columns_of(Footprint f, uint row, uvec2 size) {
    const float half_height = f.reach / f.vy;
    const float low = clamp(float(row * TILE_HEIGHT) + 0.5 - f.mean.y, -half_height, half_height);
    const float high =
        clamp(float(min((row + 1u) * TILE_HEIGHT, size.y)) - 0.5 - f.mean.y, -half_height, half_height);
    // Peak of the border: d/d(dy) = 0 at vy dy = reach * t / sqrt(1 + t^2), t = k ux / vy.
    const float t = f.k * f.ux / f.vy;
    const float peak = half_height * t / sqrt(1.0 + t * t);
    const float right = border(f, clamp(peak, low, high));
    const float left = -border(f, -clamp(-peak, low, high));
    return WRAP != 0u ? tiles_around(f.mean.x, left, right, TILE_WIDTH, size.x)
                      : tiles_between(f.mean.x, left, right, TILE_WIDTH, size.x);
}

// A row of lists: the columns that the splat reaches. With QUADS also the tile columns in each of the two tile rows.
struct ListRow {
    uvec2 columns, upper, lower;
};

// Some of the columns may have no tile that the splat reaches. With WRAP, numbers may count on from the last column.
ListRow list_row(Footprint f, uint row, uvec2 size) {
    ListRow r;
    if (QUADS == 0u) {
        r.columns = columns_of(f, row, size);
        return r;
    }
    const uint quads = quads_of(size.x);
    r.upper = 2u * row >= f.tile_rows.x ? columns_of(f, 2u * row, size) : uvec2(0u);
    r.lower = 2u * row + 1u < f.tile_rows.y ? columns_of(f, 2u * row + 1u, size) : uvec2(0u);
    const bool upper = r.upper.x < r.upper.y, lower = r.lower.x < r.lower.y;
    // Where the ranges are at different borders, the left one counts on behind the right one.
    if (WRAP != 0u && upper && lower) {
        if (r.upper.x + quads < r.lower.x) r.upper += 2u * quads;
        if (r.lower.x + quads < r.upper.x) r.lower += 2u * quads;
    }
    const uint begin = min(upper ? r.upper.x : r.lower.x, lower ? r.lower.x : r.upper.x);
    r.columns = uvec2(begin / 2u, (max(r.upper.y, r.lower.y) + 1u) / 2u);
    if (WRAP != 0u && r.columns.y - r.columns.x > quads) r.columns = uvec2(0u, quads);
    return r;
}

uint has_tile(uvec2 range, uint tile, uint period) {
    bool has = false;
    [[unroll]] for (uint turn = 0u; turn < 3u; ++turn) {
        if (turn == 0u || WRAP != 0u) has = has || (tile + turn * period >= range.x && tile + turn * period < range.y);
    }
    return has ? 1u : 0u;
}

// Bits of the tiles of a quad that the splat reaches, row by row. column: of the quad.
uint reached_tiles(ListRow r, uint column, uvec2 size) {
    const uint period = 2u * quads_of(size.x), tile = WRAP != 0u ? 2u * column % period : 2u * column;
    return has_tile(r.upper, tile, period) | has_tile(r.upper, tile + 1u, period) << 1u |
           has_tile(r.lower, tile, period) << 2u | has_tile(r.lower, tile + 1u, period) << 3u;
}

// Pairs (splat, list) in the rows [begin, end) of lists.
uint count_tiles(Footprint f, uint begin, uint end, uvec2 size) {
    uint count = 0u;
    for (uint row = begin; row < end; ++row) {
        const uvec2 columns = list_row(f, row, size).columns;
        count += columns.y - columns.x;
    }
    return count;
}
#endif
