// SPDX-License-Identifier: Apache-2.0
// Marching along the rays of a strip: where the intervals of a ray begin and end, and what each absorbs and emits. A splat's
// optical depth in an interval is a difference of its normal distribution, so that none is lost however few intervals there
// are. Within an interval all splats are mixed.
//
// Intervals are dense where light is absorbed. First MARCH_BINS bins are laid over three standard deviations of the ray's
// optical depth on either side of its mean. With the depth F up to each border of a bin, the intervals then have equal shares
// of 1 - exp(-F / 2), interpolated within a bin. This is the optimum if an interval's error is proportional to the square of
// its optical depth and to the light that reaches it.
// Needs rays.glsl and normal.glsl.
#ifndef EWA_LIB_MARCH
#define EWA_LIB_MARCH

const float FAR = 1e30;  // the last border

// The borders of a ray's intervals.
struct Placing {
    float first, step;                 // of the bins
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
    p.depth = p.m.depth >= float(MARCH_DEPTH_MIN) ? p.m.depth : 0.0;
    // |b| at the mean: sqrt(2) / (rho z).
    p.sharpness = p.depth > 0.0 ? 1.4142135623730951 * p.m.root / (r.bend.z * r.color.w) : 0.0;
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
        if (k != LISTED && k >= end) break;                                                  \
        const uint count = choose_next(k, end, top, bottom, FROM, TO);                       \
        for (uint first = 0u; first < count; first += SUBGROUP) {                            \
            RaySplat own = read_chosen(first, count);                                        \
            const uint most = min(count - first, SUBGROUP);                                  \
            [[dont_unroll]] for (uint b = 0; b < most; b += RAY_BLOCK) {                     \
                [[unroll]] for (uint j = 0; j < RAY_BLOCK; ++j) {                            \
                    const RaySplat r = shared_ray_splat(own, j);
#define END_SPLATS } move_down(own); }}}

// Lists the splats that the strip's rays meet.
void list_row(uint tile, uint strip, Ray ray) {
    const float top = strip_top(tile, strip), bottom = top + float(ROW_STEP - 1u);
    const uint end = tile_starts[tile + 1u];
    row_count = 0u;
    listed_to = tile_starts[tile];
    for (uint turn = tile_starts[tile]; turn < end; ++turn) {
        if (listed_to >= end || row_count + CHOSEN_MOST + PEEK * SUBGROUP > ROW_MOST) break;
        const uint count = choose(listed_to, end, top, bottom, float(NEAR_PLANE), NEVER);
        for (uint first = 0u; first < count; first += SUBGROUP) {
            RaySplat own = read_chosen(first, count);
            const uint most = min(count - first, SUBGROUP);
            [[dont_unroll]] for (uint b = 0; b < most; b += RAY_BLOCK) {
                [[unroll]] for (uint j = 0; j < RAY_BLOCK; ++j) {
                    const RaySplat r = shared_ray_splat(own, j);
                    const Passing p = pass_by(r, ray);
                    const float reach = p.depth > 0.0 ? float(MARCH_REACH) / p.sharpness : 0.0;
                    const float from = subgroup_min(p.depth > 0.0 ? p.m.middle - reach : NEVER);
                    const float to = subgroup_max(p.depth > 0.0 ? p.m.middle + reach : -NEVER);
                    if (from <= to && to > float(NEAR_PLANE)) {
                        if (LANE == 0u) {
                            row[row_count] = r.at;
                            row_from[row_count] = from;
                            row_to[row_count] = to;
                        }
                        ++row_count;
                    }
                }
                move_down(own);
            }
        }
    }
    subgroupMemoryBarrierShared();
    subgroupBarrier();
}

Placing place_intervals(uint tile, uint strip, Ray ray, uint samples) {
    Placing placing;
    placing.first = float(NEAR_PLANE);
    placing.step = 0.0;
    [[unroll]] for (uint b = 0u; b <= MARCH_BINS; ++b) placing.reached[b] = 1.0;
    list_row(tile, strip, ray);
    if (samples == 1u) return placing;
    const float top = strip_top(tile, strip), bottom = top + float(ROW_STEP - 1u);
    const uint end = tile_starts[tile + 1u];
    const float near = float(NEAR_PLANE);
    // Sums relative to a splat of the ray: the deviation may be far smaller than the depth.
    float origin = -1.0, sum = 1e-30, sum1 = 0.0, sum2 = 0.0;
    FOR_EACH_SPLAT(near, NEVER)
        const Passing p = pass_by(r, ray);
        const float weight = p.depth * (1.0 - share_before(p, near));
        const float at = max(p.m.middle, near);
        origin = origin < 0.0 && weight > 0.0 ? at : origin;
        const float by = at - origin, sigma = weight > 0.0 ? 1.0 / p.sharpness : 0.0;
        sum += weight;
        sum1 += weight > 0.0 ? weight * by : 0.0;
        sum2 += weight > 0.0 ? weight * (by * by + sigma * sigma) : 0.0;
    END_SPLATS
    const float mean = sum1 / sum, deviation = sqrt(max(0.0, sum2 / sum - mean * mean));
    placing.first = max(near, origin + mean - 3.0 * deviation);
    placing.step = max(origin + mean + 3.0 * deviation - placing.first, 0.0) / float(MARCH_BINS);
    [[unroll]] for (uint b = 0u; b <= MARCH_BINS; ++b) placing.reached[b] = 0.0;
    FOR_EACH_SPLAT(near, NEVER)
        const Passing p = pass_by(r, ray);
        const float before = share_before(p, near);
        [[unroll]] for (uint b = 1u; b < MARCH_BINS; ++b)
            placing.reached[b] += p.depth * (share_before(p, placing.first + placing.step * float(b)) - before);
        placing.reached[MARCH_BINS] += p.depth * (1.0 - before);
    END_SPLATS
    [[unroll]] for (uint b = 1u; b <= MARCH_BINS; ++b) placing.reached[b] = 1.0 - exp(-0.5 * placing.reached[b]);
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
    return placing.first + placing.step * bins;
}

// Intervals that are evaluated together, in registers.
layout(constant_id = SPEC_MODE) const uint CHUNK = 8;

float borders[CHUNK + 1u];
float depths[CHUNK];
vec3 emissions[CHUNK];  // sum of colour * depth

// (1 - exp(-x)) / x
float mean_transmittance(float x) { return x < 0.01 ? 1.0 - x * (0.5 - x * (0.16666667 - x * 0.041666667)) : (1.0 - exp(-x)) / x; }

// Evaluates CHUNK intervals from `begin` on. open: whether this lane's ray counts. from, to: the subgroup's borders.
void march_chunk(uint tile, uint strip, Ray ray, Placing placing, uint begin, uint samples, bool open, out float from, out float to) {
    const float top = strip_top(tile, strip), bottom = top + float(ROW_STEP - 1u);
    const uint end = tile_starts[tile + 1u];
    [[unroll]] for (uint j = 0u; j <= CHUNK; ++j) borders[j] = border_of(placing, begin + j, samples);
    [[unroll]] for (uint j = 0u; j < CHUNK; ++j) {
        depths[j] = 0.0;
        emissions[j] = vec3(0.0);
    }
    from = subgroup_min(open ? borders[0] : NEVER);
    to = subgroup_max(open ? borders[CHUNK] : 0.0);
    FOR_EACH_SPLAT(from, to)
        const Passing p = pass_by(r, ray);
        float before = share_before(p, borders[0]);
        [[unroll]] for (uint i = 0u; i < CHUNK; ++i) {
            const float after = share_before(p, borders[i + 1u]);
            const float depth = p.depth * (after - before);
            depths[i] += depth;
            emissions[i] += depth * r.color.rgb;
            before = after;
        }
    END_SPLATS
}
#endif
