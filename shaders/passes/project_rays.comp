#version 460
// SPDX-License-Identifier: Apache-2.0
// Prepares splats for integration along rays.
// One invocation owns splat i. It reads its parameters and the camera, and writes how rays meet it, its record, its depth key
// and the number of tiles that it reaches. The record has an ellipse for the tiles' lists: the outline of the ellipsoid
// outside of which no ray counts. Under perspective that is exactly an ellipse, unless the ellipsoid reaches the plane of the
// eye; then all tiles list the splat. The key is the least view depth of the ellipsoid, or that of the mean.
// SPEC_MODE: 0, PROJECT_RAYS_DEEP or PROJECT_RAYS_BY_MEAN.
#extension GL_GOOGLE_include_directive : require
#define BINDING_CAMERA 1
#include "lib/prelude.glsl"
#include "lib/stored_splat.glsl"
#include "lib/ray_shape.glsl"
#include "lib/footprint.glsl"
#include "lib/lens_ray.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(constant_id = SPEC_SH_DEGREE) const uint SH_DEGREE = 3;
layout(constant_id = SPEC_MODE) const uint MODE = 0;

TEXELS(0, params);
STORED_TEXELS(2, records);
layout(set = 0, binding = 3, scalar) writeonly buffer DepthKeys { uint depth_keys[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer TileCounts { uint tile_counts[]; };
layout(set = 0, binding = 5, scalar) buffer CountsBlock { Counts counts; };
STORED_TEXELS(6, rays);
layout(push_constant, scalar) uniform Push { ProjectPush push; };
#include "lib/splat_color.glsl"

// The least optical depth that counts.
float depth_min() {
    return MODE == PROJECT_RAYS_DEEP ? float(MARCH_DEPTH_MIN) : CUT_OFF * (1.0 + CUT_OFF * (0.5 + CUT_OFF / 3.0));
}

// Longest direction of a ray through the image, with z = 1.
float longest_direction() {
    const vec2 focal = vec2(camera.focal_hi[0], camera.focal_hi[1]), center = vec2(camera.center_hi[0], camera.center_hi[1]);
    const vec2 far = max(abs(center), abs(vec2(camera.size[0], camera.size[1]) - center)) / focal;
    return sqrt(1.0 + dot(far, far));
}

// Where the ellipsoid x.x = 2 reach projects to: u^2 + v^2 <= K^2 (1 + g . (u, v))^2.
struct Outline {
    bool ellipse;
    float k2;      // K^2
    vec2 g;        // by (u, v)
    float bend2;   // K^2 |g|^2
};

Outline outline_of(RayShape r, float reach) {
    Outline o;
    const float inside = reach * r.rho * r.rho;
    o.k2 = reach / (1.0 - inside);
    o.g = vec2(r.bend.x / r.ux, (r.bend.x * r.k + r.bend.y) / r.vy);
    o.bend2 = o.k2 * dot(o.g, o.g);
    o.ellipse = inside < 0.999 && o.bend2 < 0.999;
    return o;
}

// Half the squared radius of the ellipsoid that holds every ray that counts, in standard deviations; below 0: there is none.
float reach_of(RayShape r) {
    if (KERNEL != KERNEL_DENSITY) return log(r.depth / depth_min());
    // The direction with the least shadow has the most depth.
    const float least_sharp = least_of(r.sharpness), at_mean = log(robust_length((r.eye.to_mean * r.directions) * r.sharpness) / least_sharp);
    // A splat's own camera has no image border that bounds a ray's direction.
    if (LENSES != 0u) return log(r.depth / depth_min()) + at_mean;
    const float most = r.depth * longest_direction();
    float reach = log(most / depth_min()) + at_mean;
    // Inside the ellipsoid that follows from it, |b| has a
    // better bound, which gives a smaller ellipsoid.
    [[unroll]] for (int i = 0; i < 2; ++i) {
        const Outline o = outline_of(r, reach);
        if (reach > 0.0 && o.ellipse) reach = min(reach, log(most * (1.0 + sqrt(o.bend2)) / depth_min()));
    }
    return reach;
}

// The opacity with which a record reaches to u^2 + v^2 = 1.
#define OPACITY_OF_UNIT (2.718281828 * CUT_OFF)

// All tiles list the splat.
void record_everywhere(out vec4 record0, out vec4 record1) {
    record0 = vec4(0.5 * vec2(camera.size[0], camera.size[1]), 0.0, 0.0);
    record1 = vec4(1e-9, 0.0, 1e-9, OPACITY_OF_UNIT);
}

// The ellipse as a footprint that reaches to u^2 + v^2 = 1.
void outline_record(RayShape r, vec2 mean, float reach, out vec4 record0, out vec4 record1) {
    const Outline o = outline_of(r, reach);
    if (!o.ellipse) {
        record_everywhere(record0, record1);
        return;
    }
    const float rest = 1.0 - o.bend2;
    const vec2 middle = o.g * (o.k2 / rest);
    // E = rest / K^2 (1 - K^2 g g^T) is the ellipse's matrix, e its Cholesky factor.
    const float e11 = sqrt(rest / o.k2 * (1.0 - o.k2 * o.g.x * o.g.x));
    const float e12 = -rest * o.g.x * o.g.y / e11, e22 = rest / o.k2 * sqrt(rest) / e11;
    const float dy = middle.y / r.vy;
    record0 = vec4(mean + vec2(middle.x / r.ux + r.k * dy, dy), 0.0, 0.0);
    record1 = vec4(e11 * r.ux, r.k - e12 * r.vy / (e11 * r.ux), e22 * r.vy, OPACITY_OF_UNIT);
}

// Where the outline meets a direction of the splat's own image, in tangents.
vec2 outline_at(RayShape r, Outline o, float turn) {
    const vec2 way = vec2(cos(turn), sin(turn));
    const vec2 at = way * (sqrt(o.k2) / (1.0 - sqrt(o.k2) * dot(o.g, way)));
    const float dy = at.y / r.vy;
    return vec2(at.x / r.ux + r.k * dy, dy);
}

// A direction along which the lens is not one to one. A pinhole with distortion has none.
vec3 pole_of_lens(float sign) {
    return camera.lens == LENS_EQUIRECTANGULAR ? vec3(0.0, sign, 0.0) : vec3(0.0, 0.0, -1.0);
}

// Whether the outline reaches to OUTLINE_MARGIN from a direction, in the splat's own image.
const float OUTLINE_MARGIN = 1.25;
bool outline_holds(RayShape r, Outline o, vec3 at) {
    if (at.z <= 0.0) return false;
    const vec2 t = at.xy / at.z / OUTLINE_MARGIN;
    const vec2 uv = vec2(r.ux * (t.x - r.k * t.y), r.vy * t.y);
    const float along = 1.0 + dot(o.g, uv);
    return dot(uv, uv) <= o.k2 * along * along;
}

// Through a lens the outline is no ellipse. The record is the smallest ellipse of the shape of the splat's footprint that holds
// OUTLINE_POINTS of it, and a tenth more: between these, a curve of so small an angle bends less.
const uint OUTLINE_POINTS = 16u;
void lens_outline_record(RayShape r, Projection p, vec2 mean, float reach, mat3 to_frame, out vec4 record0, out vec4 record1) {
    record_everywhere(record0, record1);
    const Outline o = outline_of(r, reach);
    if (!o.ellipse) return;
    if (camera.lens != LENS_BROWN && (outline_holds(r, o, to_frame * pole_of_lens(1.0)) || outline_holds(r, o, to_frame * pole_of_lens(-1.0)))) return;
    float farthest = 0.0;
    const vec2 focal = vec2(camera.focal_hi[0], camera.focal_hi[1]), center = vec2(camera.center_hi[0], camera.center_hi[1]);
    for (uint k = 0u; k < OUTLINE_POINTS; ++k) {
        const vec2 t = outline_at(r, o, 6.2831853 / float(OUTLINE_POINTS) * float(k));
        // Wider than 60 degrees.
        if (!(dot(t, t) < 3.0)) return;
        bool shown;
        const vec2 plane = lens_position(vec3(t, 1.0) * to_frame, shown);
        if (!shown) return;
        vec2 beside = plane * focal + center - mean;
        if (WRAP != 0u) beside.x -= float(camera.size[0]) * round(beside.x / float(camera.size[0]));
        const vec2 uv = vec2(p.ux * (beside.x - p.k * beside.y), p.vy * beside.y);
        farthest = max(farthest, dot(uv, uv));
    }
    const float scale = 1.0 / (1.1 * sqrt(farthest));
    record0 = vec4(mean, 0.0, 0.0);
    record1 = vec4(p.ux * scale, p.k, p.vy * scale, OPACITY_OF_UNIT);
}

void project(uint i) {
    const vec4 p0 = param(0, i), p1 = param(1, i), p2 = param(2, i);
    const StoredSplat splat = StoredSplat(p0.xyz, p0.w, p1, p2.xyz);
    const StoredProjection stored = project_splat(splat);
    const Projection p = stored.footprint;
    const View view = p.view;
    const RayShape r = ray_shape(view, stored.unit_quaternion, splat.log_scale, splat.logit);
    const float z = r.eye.z;
    bool finite_color;
    const vec3 color = sh_color(i, p2, normalize(view.offset), finite_color);

    const bool lens = LENSES != 0u;
    const vec2 x = lens ? pixel_in_plane(p.image.x, 0) : pixel_position(view.x, view.z, 0);
    const vec2 y = lens ? pixel_in_plane(p.image.y, 1) : pixel_position(view.y, view.z, 1);
    const vec3 along = point_of(view) / z;
    const vec4 mean = lens ? vec4(along, frame_factor(along)) : vec4(x.x, y.x, x.y, y.y), shape = vec4(r.ux, r.k, r.vy, r.depth);
    const float reach = reach_of(r) * 1.00001 + 1e-5;
    const vec3 scale = r.least_scale / r.sharpness;
    // Less the rounding of a ray's middle.
    const float depth = r.eye.depth;
    const float least = depth - sqrt(2.0 * max(reach, 0.0)) * robust_length((r.eye.deeper * r.directions) * scale) * 1.00001 - 1e-6 * z;
    const vec4 bend = vec4(r.bend, r.rho, least);

    const bool stored_finite = is_finite(p0) && is_finite(p1) && is_finite(p2.xyz) && stored.in_range;
    const bool in_front = depth > float(NEAR_PLANE) && (!lens || p.image.shown);
    const bool projected_finite = p.footprint_in_range && finite_color && is_finite(mean) && is_finite(vec4(x, y)) && is_finite(shape) &&
                                  is_finite(bend) && r.ux > 0.0 && r.vy > 0.0;
    const bool visible = stored_finite && in_front && projected_finite && sigmoid(p0.w) >= float(ALPHA_MIN) && reach > 0.0;

    uint count = 0u;
    vec4 record0 = vec4(0.0), record1 = vec4(1.0, 0.0, 1.0, 0.0);
    if (visible) {
        if (lens)
            lens_outline_record(r, p, vec2(x.x, y.x), reach, transpose(frame_rows(along)), record0, record1);
        else
            outline_record(r, mean.xy, reach, record0, record1);
        const uvec2 size = uvec2(camera.size[0], camera.size[1]);
        const Footprint f = footprint_of(record0, record1, size);
        count = count_tiles(f, f.row_begin, f.row_end, size);
    }
    rays[RAY_TEXELS * i] = as_texel(mean);
    rays[RAY_TEXELS * i + 1] = as_texel(shape);
    rays[RAY_TEXELS * i + 2] = as_texel(bend);
    records[RECORD_TEXELS * i] = as_texel(record0);
    records[RECORD_TEXELS * i + 1] = as_texel(record1);
    records[RECORD_TEXELS * i + 2] = as_texel(vec4(color, z));
    depth_keys[i] = count > 0u ? floatBitsToUint(MODE == PROJECT_RAYS_BY_MEAN ? depth : max(least, float(NEAR_PLANE))) : 0xffffffffu;
    tile_counts[i] = count;
    if (!stored_finite || (in_front && !projected_finite)) atomicAdd(counts.skipped_nonfinite, 1u);
}

void main() {
    const uint i = item_index();
    if (i < push.splats) project(i);
}
