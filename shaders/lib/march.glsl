// SPDX-License-Identifier: Apache-2.0
// Marching along the rays of a strip: where the intervals of a ray begin and end, and what each absorbs and emits. A splat's
// optical depth in an interval is a difference of its normal distribution, so that none is lost however few intervals there
// are. Within an interval all splats are mixed.
//
// Intervals are dense where light is absorbed. First MARCH_BINS bins are laid over the splats that the ray meets, equal in the
// logarithm of the view depth: a far splat does not widen the bins of near ones much. For this look a splat is spread evenly, which
// is quick. With the depth F up to each border of a bin, the intervals then have equal shares of 1 - exp(-F / 2), interpolated
// within a bin. This is the optimum if an interval's error is proportional to the square of its optical depth and to the light
// that reaches it.
// Needs rays.glsl and normal.glsl.
#ifndef EWA_LIB_MARCH
#define EWA_LIB_MARCH

const float FAR = 1e30;  // the last border

// The borders of a ray's intervals.
struct Placing {
    float first, last;                 // of the bins; 0 if the ray meets nothing
    float step;                        // log2 of the ratio of their borders
    float reached[MARCH_BINS + 1u];    // 1 - exp(-F / 2) at their borders
    float slopes[MARCH_BINS];          // bins by that
};

// A lane's splat j, as it is passed by a lane's ray.
struct Passing {
    Meeting m;
    float depth;      // 0 below MARCH_DEPTH_MIN
    float sharpness;  // 1 / standard deviation along the ray
};

Passing pass_by(RaySplat r, Ray ray) {
    Passing p;
    p.m = meet(r, ray);
    p.depth = p.m.depth >= float(MARCH_DEPTH_MIN) && sees(ray) ? p.m.depth : 0.0;
    p.sharpness = p.depth > 0.0 ? r.along * p.m.root : 0.0;
    if (LENSES != 0u) p.sharpness /= abs(p.m.stretch);
    p.m.middle = p.depth > 0.0 ? p.m.middle : 0.0;
    return p;
}

float share_before(Passing p, float t) { return normal_cdf((t - p.m.middle) * p.sharpness); }

float subgroup_max(float x) { return -subgroup_min(-x); }

// The splats that some ray of the strip meets, and the view depths that they span on these rays. With many splats only the
// first ones are listed; `listed_to` is the first instance that was not looked at.
shared uint row[ROW_MOST];
shared float row_from[ROW_MOST], row_to[ROW_MOST];
uint row_count = 0u, listed_to = 0u;

// Chooses first from the strip's list, then from the instances that are not in it. k begins as LISTED.
const uint LISTED = 0xffffffffu;
uint choose_next(inout uint k, uint end, float top, float bottom, float from, float to) {
    if (k != LISTED) return choose(k, end, top, bottom, from, to);
    subgroupBarrier();  // the last ones have been read
    uint count = 0u;
    for (uint i = 0u; i < row_count; i += SUBGROUP) {
        if (!in_time()) break;
        const uint at = min(i + LANE, ROW_MOST - 1u);
        const bool keep = i + LANE < row_count && row_from[at] <= to && row_to[at] >= from;
        const uint rank = subgroup_inclusive_sum(keep ? 1u : 0u);
        if (keep) chosen[count + rank - 1u] = row[at];
        count += subgroupShuffle(rank, SUBGROUP - 1u);
    }
    subgroupMemoryBarrierShared();
    subgroupBarrier();
    k = listed_to;
    return count;
}

// For each splat r of the strip whose view depths meet [FROM, TO]; END_SPLATS ends the loop's body.
#define FOR_EACH_SPLAT(FROM, TO)                                                             \
    for (uint turn = 0u, k = LISTED; turn < end + 1u; ++turn) {                              \
        if (!in_time() || (k != LISTED && k >= end)) break;                                  \
        const uint count = choose_next(k, end, top, bottom, FROM, TO);                       \
        RaySplat own;                                                                        \
        [[dont_unroll]] for (uint i = 0u; i < count; i += RAY_BLOCK) {                       \
            if (!in_time()) break;                                                           \
            next_block(own, i, count);                                                       \
            [[unroll]] for (uint j = 0; j < RAY_BLOCK; ++j) {                                \
                const RaySplat r = shared_ray_splat(own, j);
#define END_SPLATS }}}

// How far a splat of this optical depth reaches along a ray, in standard deviations: to the ellipsoid outside of which no ray
// counts. What is beyond has 2e-6 of optical depth at most.
float reach_along(float depth) { return sqrt(2.0 * log(max(depth / float(MARCH_DEPTH_MIN), 1.0))); }

// Lists the splats that the strip's rays meet. first, last: the view depths that this lane's ray meets any at, to MARCH_BIN_REACH;
// NEVER and 0 if it meets none.
void list_row(uint tile, uint strip, Ray ray, out float first, out float last) {
    const float top = strip_top(tile, strip), bottom = top + float(ROW_STEP - 1u), near = float(NEAR_PLANE);
    const uint end = tile_starts[tile + 1u];
    first = NEVER;
    last = 0.0;
    row_count = 0u;
    listed_to = tile_starts[tile];
    bool room = true;
    uint k = listed_to;
    for (uint turn = tile_starts[tile]; turn < end; ++turn) {
        if (!in_time() || k >= end) break;
        const uint count = choose(k, end, top, bottom, near, NEVER);
        RaySplat own;
        [[dont_unroll]] for (uint i = 0u; i < count; i += RAY_BLOCK) {
            if (!in_time()) break;
            next_block(own, i, count);
            [[unroll]] for (uint j = 0; j < RAY_BLOCK; ++j) {
                const RaySplat r = shared_ray_splat(own, j);
                const Passing p = pass_by(r, ray);
                const float sigma = p.depth > 0.0 ? 1.0 / p.sharpness : 0.0;
                const float reach = reach_along(p.depth) * sigma;
                const float from = subgroup_min(p.depth > 0.0 ? p.m.middle - reach : NEVER);
                const float to = subgroup_max(p.depth > 0.0 ? p.m.middle + reach : -NEVER);
                const bool met = p.depth > 0.0 && p.m.middle + float(MARCH_BIN_REACH) * sigma > near;
                first = met ? min(first, max(p.m.middle - float(MARCH_BIN_REACH) * sigma, near)) : first;
                last = met ? max(last, p.m.middle + float(MARCH_BIN_REACH) * sigma) : last;
                if (room && from <= to && to > near) {
                    if (LANE == 0u) {
                        row[row_count] = r.at;
                        row_from[row_count] = from;
                        row_to[row_count] = to;
                    }
                    ++row_count;
                }
            }
        }
        listed_to = room ? k : listed_to;
        room = room && row_count + CHOSEN_MOST + PEEKED <= ROW_MOST;
    }
    subgroupMemoryBarrierShared();
    subgroupBarrier();
}

Placing place_intervals(uint tile, uint strip, Ray ray, uint samples) {
    Placing placing;
    placing.step = 0.0;
    [[unroll]] for (uint b = 0u; b <= MARCH_BINS; ++b) placing.reached[b] = 0.0;
    list_row(tile, strip, ray, placing.first, placing.last);
    if (samples == 1u || subgroupAll(placing.last == 0.0)) return placing;
    const float top = strip_top(tile, strip), bottom = top + float(ROW_STEP - 1u), near = float(NEAR_PLANE);
    const uint end = tile_starts[tile + 1u];
    placing.first = placing.last > 0.0 ? placing.first : 1.0;
    placing.step = placing.last > 0.0 ? log2(placing.last / placing.first) / float(MARCH_BINS) : 0.0;
    float at[MARCH_BINS + 1u];
    [[unroll]] for (uint b = 0u; b <= MARCH_BINS; ++b) at[b] = placing.first * exp2(placing.step * float(b));
    float before = 0.0;  // the eye
    FOR_EACH_SPLAT(near, NEVER)
        // A splat's depth is spread evenly over as long a way as has the same standard deviation.
        const Passing p = pass_by(r, ray);
        const float slope = p.depth * p.sharpness * 0.28867513, none = 0.5 * p.depth - slope * p.m.middle;
        before += clamp(slope * near + none, 0.0, p.depth);
        [[unroll]] for (uint b = 1u; b <= MARCH_BINS; ++b) placing.reached[b] += clamp(slope * at[b] + none, 0.0, p.depth);
    END_SPLATS
    [[unroll]] for (uint b = 1u; b <= MARCH_BINS; ++b) placing.reached[b] = 1.0 - exp(-0.5 * max(placing.reached[b] - before, 0.0));
    [[unroll]] for (uint b = 0u; b < MARCH_BINS; ++b)
        placing.slopes[b] = 1.0 / max(placing.reached[b + 1u] - placing.reached[b], 1e-12);
    return placing;
}

// Where interval j begins, of `samples`.
float border_of(Placing placing, uint j, uint samples) {
    if (j == 0u) return float(NEAR_PLANE);
    if (j >= samples) return FAR;
    const float wanted = placing.reached[MARCH_BINS] * (float(j) / float(samples));
    float bins = 0.0;
    [[unroll]] for (uint b = 0u; b < MARCH_BINS; ++b) {
        bins += clamp((wanted - placing.reached[b]) * placing.slopes[b], 0.0, 1.0);
    }
    return placing.first * exp2(placing.step * bins);
}

// Intervals that are evaluated together, in registers.
layout(constant_id = SPEC_MODE) const uint GROUP = 8;

float borders[GROUP + 1u];
float depths[GROUP];
vec3 emissions[GROUP];  // sum of colour * depth

// (1 - exp(-x)) / x
float mean_transmittance(float x) { return x < 0.01 ? 1.0 - x * (0.5 - x * (0.16666667 - x * 0.041666667)) : (1.0 - exp(-x)) / x; }

// Evaluates GROUP intervals from `begin` on. open: whether this lane's ray counts. from, to: the subgroup's borders.
void march_group(uint tile, uint strip, Ray ray, Placing placing, uint begin, uint samples, bool open, out float from, out float to) {
    const float top = strip_top(tile, strip), bottom = top + float(ROW_STEP - 1u);
    const uint end = tile_starts[tile + 1u];
    [[unroll]] for (uint j = 0u; j <= GROUP; ++j) borders[j] = border_of(placing, begin + j, samples);
    [[unroll]] for (uint j = 0u; j < GROUP; ++j) {
        depths[j] = 0.0;
        emissions[j] = vec3(0.0);
    }
    from = subgroup_min(open ? borders[0] : NEVER);
    to = subgroup_max(open ? borders[GROUP] : 0.0);
    FOR_EACH_SPLAT(from, to)
        const Passing p = pass_by(r, ray);
        float before = share_before(p, borders[0]);
        [[unroll]] for (uint i = 0u; i < GROUP; ++i) {
            const float after = share_before(p, borders[i + 1u]);
            const float depth = p.depth * (after - before);
            depths[i] += depth;
            emissions[i] += depth * r.color.rgb;
            before = after;
        }
    END_SPLATS
}
#endif
