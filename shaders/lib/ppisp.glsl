// SPDX-License-Identifier: Apache-2.0
// PPISP: what a camera does to colours, in the order exposure, vignette, colour map, response.
#ifndef EWA_LIB_PPISP
#define EWA_LIB_PPISP

const uint PPISP_VALUES = PPISP_PHOTO_VALUES + PPISP_CAMERA_VALUES;  // of a photo and its camera

// The response of one channel: y = toe_share (x / middle)^toe up to middle, above it
// 1 - (1 - toe_share) ((1 - x) / (1 - middle))^shoulder. Both have one slope at the middle. The result is y^gamma.
struct Response {
    float toe, shoulder, gamma, middle;
    float toe_share;
};

struct Ppisp {
    float gain;
    vec3 targets[4];  // colours (r, g, 1) that blue, red, green and grey become
    mat3 colors;      // of (R, G, R + G + B)
    vec2 center[3];
    vec3 falloff[3];
    Response response[3];
};

float softplus(float x) { return max(x, 0.0) + log(1.0 + exp(-abs(x))); }
float sigmoid(float x) { return 1.0 / (1.0 + exp(-x)); }

Response response_of(float toe, float shoulder, float gamma, float middle) {
    Response r;
    r.toe = float(PPISP_CURVE_MIN) + softplus(toe);
    r.shoulder = float(PPISP_CURVE_MIN) + softplus(shoulder);
    r.gamma = float(PPISP_GAMMA_MIN) + softplus(gamma);
    r.middle = sigmoid(middle);
    r.toe_share = r.shoulder * r.middle / (r.toe + r.middle * (r.shoulder - r.toe));
    return r;
}

// Matrices of the latent offsets of blue, red, green and grey.
mat2 offset_matrix(uint target) {
    const vec3 m = target == 0u   ? vec3(PPISP_BLUE_XX, PPISP_BLUE_XY, PPISP_BLUE_YY)
                   : target == 1u ? vec3(PPISP_RED_XX, PPISP_RED_XY, PPISP_RED_YY)
                   : target == 2u ? vec3(PPISP_GREEN_XX, PPISP_GREEN_XY, PPISP_GREEN_YY)
                                  : vec3(PPISP_GREY_XX, PPISP_GREY_XY, PPISP_GREY_YY);
    return mat2(m.x, m.y, m.y, m.z);
}

// The homography that maps blue (0, 0), red (1, 0), green (0, 1) and grey (1/3, 1/3) to the targets, with 1 in its last
// entry. Its columns follow from the weights w of blue, red and green in grey: sum of w t = grey, up to a factor.
vec3 weights_of(vec3 t[4]) {
    return vec3(dot(cross(t[1], t[2]), t[3]), dot(cross(t[2], t[0]), t[3]), dot(cross(t[0], t[1]), t[3]));
}
mat3 homography_of(vec3 t[4]) {
    const vec3 w = weights_of(t);
    return mat3(w.y / w.x * t[1] - t[0], w.z / w.x * t[2] - t[0], t[0]);
}

// gradient: dL/d(homography). Returns dL/d(target), x and y of each.
vec2[4] homography_backward(vec3 t[4], mat3 gradient) {
    const vec3 w = weights_of(t);
    const vec2 ratio = w.yz / w.x;
    vec3 back[4] = {gradient[2] - gradient[0] - gradient[1], ratio.x * gradient[0], ratio.y * gradient[1], vec3(0.0)};
    const vec2 by_ratio = vec2(dot(gradient[0], t[1]), dot(gradient[1], t[2]));
    const vec3 by_weight = vec3(-dot(by_ratio, ratio), by_ratio) / w.x;
    [[unroll]] for (uint k = 0u; k < 3u; ++k) {
        // w of k is the determinant of the next two targets and grey.
        const uint a = (k + 1u) % 3u, b = (k + 2u) % 3u;
        back[a] += by_weight[k] * cross(t[b], t[3]);
        back[b] += by_weight[k] * cross(t[3], t[a]);
        back[3] += by_weight[k] * cross(t[a], t[b]);
    }
    const vec2 flat_back[4] = {back[0].xy, back[1].xy, back[2].xy, back[3].xy};
    return flat_back;
}

Ppisp ppisp_of(float values[PPISP_VALUES]) {
    Ppisp p;
    p.gain = exp2(values[0]);
    const vec2 sources[4] = {vec2(0.0), vec2(1.0, 0.0), vec2(0.0, 1.0), vec2(1.0 / 3.0)};
    [[unroll]] for (uint k = 0u; k < 4u; ++k)
        p.targets[k] =
            vec3(sources[k] + offset_matrix(k) * vec2(values[1u + 2u * k], values[2u + 2u * k]), 1.0);
    p.colors = homography_of(p.targets);
    [[unroll]] for (uint c = 0u; c < 3u; ++c) {
        const uint at = PPISP_PHOTO_VALUES + PPISP_CHANNEL_FLOATS * c;
        p.center[c] = vec2(values[at], values[at + 1u]);
        p.falloff[c] = vec3(values[at + 2u], values[at + 3u], values[at + 4u]);
        p.response[c] = response_of(values[at + 5u], values[at + 6u], values[at + 7u], values[at + 8u]);
    }
    return p;
}

// Where pixel i of the image is, from the middle, in units of the larger side.
vec2 ppisp_place(ImageLayout image, uint i) {
    const vec2 size = vec2(image.size[0], image.size[1]);
    return (vec2(i % image.size[0], i / image.size[0]) + 0.5 - 0.5 * size) / max(size.x, size.y);
}

vec3 vignette_powers(Ppisp p, uint c, vec2 place) {
    const vec2 d = place - p.center[c];
    const float r2 = dot(d, d);
    return vec3(r2, r2 * r2, r2 * r2 * r2);
}

vec3 mapped_colors(Ppisp p, vec3 color) {
    const float intensity = color.r + color.g + color.b;
    const vec3 q = p.colors * vec3(color.rg, intensity);
    const vec3 scaled = q * (intensity / (q.z + float(PPISP_INTENSITY_MIN)));
    return vec3(scaled.xy, scaled.z - scaled.x - scaled.y);
}

// The curve before gamma.
float response_curve(Response r, float x) {
    if (x <= r.middle) return r.toe_share * pow(max(x / r.middle, float(PPISP_BASE_MIN)), r.toe);
    return 1.0 - (1.0 - r.toe_share) * pow(max((1.0 - x) / (1.0 - r.middle), float(PPISP_BASE_MIN)), r.shoulder);
}

vec3 vignetted(Ppisp p, vec3 color, vec2 place) {
    vec3 shaded;
    [[unroll]] for (uint c = 0u; c < 3u; ++c)
        shaded[c] =
            color[c] * p.gain * clamp(1.0 + dot(p.falloff[c], vignette_powers(p, c, place)), 0.0, 1.0);
    return shaded;
}

vec3 ppisp_color(Ppisp p, vec3 color, vec2 place) {
    const vec3 mapped = clamp(mapped_colors(p, vignetted(p, color, place)), 0.0, 1.0);
    vec3 result;
    [[unroll]] for (uint c = 0u; c < 3u; ++c)
        result[c] =
            pow(max(response_curve(p.response[c], mapped[c]), float(PPISP_BASE_MIN)), p.response[c].gamma);
    return result;
}

// Gradient of the response of one channel. Returns dL/dx, and adds to dL/d(toe, shoulder, gamma, middle).
float response_backward(Response r, float x, float gradient, inout vec4 sum) {
    const float y = response_curve(r, x), base = max(y, float(PPISP_BASE_MIN));
    const float result = pow(base, r.gamma);
    sum.z += gradient * result * log(base);
    if (y < float(PPISP_BASE_MIN)) return 0.0;
    const float by_y = gradient * r.gamma * result / base;
    const bool low = x <= r.middle;
    // The curve is offset + sign share power, with power = base2^exponent.
    const float span = low ? r.middle : 1.0 - r.middle, ratio = (low ? x : 1.0 - x) / span;
    const float base2 = max(ratio, float(PPISP_BASE_MIN)), exponent = low ? r.toe : r.shoulder;
    const float share = low ? r.toe_share : 1.0 - r.toe_share, power = pow(base2, exponent);
    const float by_exponent = (low ? by_y : -by_y) * share * power * log(base2);
    const float slope = ratio < float(PPISP_BASE_MIN) ? 0.0 : by_y * share * exponent * power / (base2 * span);
    const float by_share = by_y * power;  // toe_share rises the lower part and lowers what the upper takes away
    const float mixed = r.toe + r.middle * (r.shoulder - r.toe), scale = by_share / (mixed * mixed);
    sum.x += (low ? by_exponent : 0.0) - scale * r.shoulder * r.middle * (1.0 - r.middle);
    sum.y += (low ? 0.0 : by_exponent) + scale * r.middle * r.toe * (1.0 - r.middle);
    sum.w += scale * r.shoulder * r.toe - slope * ratio;
    return slope;
}

// What a pixel adds to the gradient, as PPISP_SUM_FLOATS describes it.
struct PpispSums {
    float exposure;
    mat3 colors;
    vec2 center[3];
    vec3 falloff[3];
    vec4 response[3];
};

// gradient: dL/d(ppisp_color). Returns dL/d(color).
vec3 ppisp_backward(Ppisp p, vec3 color, vec2 place, vec3 gradient, inout PpispSums sums) {
    const vec3 shaded = vignetted(p, color, place), mapped = mapped_colors(p, shaded);
    vec3 by_mapped;
    [[unroll]] for (uint c = 0u; c < 3u; ++c) {
        const float back =
            response_backward(p.response[c], clamp(mapped[c], 0.0, 1.0), gradient[c], sums.response[c]);
        by_mapped[c] = mapped[c] >= 0.0 && mapped[c] <= 1.0 ? back : 0.0;
    }
    const float intensity = shaded.r + shaded.g + shaded.b;
    const vec3 from = vec3(shaded.rg, intensity), q = p.colors * from;
    const float divisor = q.z + float(PPISP_INTENSITY_MIN), scale = intensity / divisor;
    const vec3 by_scaled = vec3(by_mapped.rg - by_mapped.b, by_mapped.b);
    const float by_scale = dot(by_scaled, q);
    const vec3 by_q = scale * by_scaled - vec3(0.0, 0.0, by_scale * scale / divisor);
    sums.colors += outerProduct(by_q, from);
    const vec3 by_from = by_q * p.colors;
    const vec3 by_shaded = vec3(by_from.xy, 0.0) + by_from.z + by_scale / divisor;
    vec3 back;
    [[unroll]] for (uint c = 0u; c < 3u; ++c) {
        const vec3 powers = vignette_powers(p, c, place);
        const float raw = 1.0 + dot(p.falloff[c], powers), factor = clamp(raw, 0.0, 1.0);
        const float exposed = color[c] * p.gain;
        const float by_raw = raw >= 0.0 && raw <= 1.0 ? by_shaded[c] * exposed : 0.0;
        sums.falloff[c] += by_raw * powers;
        const float by_r2 = by_raw * dot(p.falloff[c], vec3(1.0, 2.0 * powers.x, 3.0 * powers.y));
        sums.center[c] -= 2.0 * by_r2 * (place - p.center[c]);
        const float by_exposed = by_shaded[c] * factor;
        sums.exposure += by_exposed * exposed * log(2.0);
        back[c] = by_exposed * p.gain;
    }
    return back;
}
#endif
