// SPDX-License-Identifier: Apache-2.0
// Reflection of a glTF material: a Lambert layer under a GGX layer, as in appendix B of the specification, with F0 and
// F90 of KHR_materials_specular. Directions point away from the surface, in a frame whose z is the normal.
#ifndef EWA_LIB_REFLECTION
#define EWA_LIB_REFLECTION

const float PI = 3.14159265358979;
const float LAMBERT_BLUR = 0.35;  // least GGX width after a Lambert reflection

struct Reflector {
    vec3 diffuse;    // albedo of the Lambert layer without Fresnel's share
    vec3 f0, f90;
    float width;     // GGX alpha
    float mirror_share;  // probability of sampling the GGX layer
    float dielectric_f0, dielectric_f90, metallic;
};

vec3 fresnel(vec3 f0, vec3 f90, float cosine) {
    const float c = clamp(1.0 - cosine, 0.0, 1.0), c2 = c * c;
    return f0 + (f90 - f0) * (c2 * c2 * c);
}

float brightest(vec3 v) { return max(v.x, max(v.y, v.z)); }

// blur: least GGX width.
Reflector reflector_of(Material m, float cosine, float blur) {
    Reflector r;
    r.metallic = clamp(m.metallic, 0.0, 1.0);
    r.diffuse = m.base * (1.0 - r.metallic);
    r.dielectric_f0 = m.f0;
    r.dielectric_f90 = m.f90;
    r.f0 = mix(vec3(m.f0), m.base, r.metallic);
    r.f90 = vec3(mix(m.f90, 1.0, r.metallic));
    const float roughness = clamp(m.roughness, 0.0, 1.0);
    r.width = max(max(roughness * roughness, TRACE_ALPHA_MIN), blur);
    const float mirrored = brightest(fresnel(r.f0, r.f90, cosine)), scattered = brightest(r.diffuse) * (1.0 - m.f0);
    r.mirror_share = mirrored <= 0.0 ? 0.0 : scattered <= 0.0 ? 1.0 : clamp(mirrored / (mirrored + scattered), 0.1, 0.9);
    return r;
}

float ggx_lambda(float width, vec3 v) {
    return 0.5 * (sqrt(1.0 + width * width * dot(v.xy, v.xy) / (v.z * v.z)) - 1.0);
}

// BRDF times the cosine, and the density with which sample_reflection chooses in_dir.
vec3 evaluate_reflection(Reflector r, vec3 out_dir, vec3 in_dir, out float density) {
    density = 0.0;
    if (!(in_dir.z > 0.0) || !(out_dir.z > 0.0)) return vec3(0.0);
    const vec3 h = normalize(out_dir + in_dir);
    const float cosine = dot(out_dir, h);
    const float c = clamp(1.0 - cosine, 0.0, 1.0), c2 = c * c;
    const float refracted = 1.0 - (r.dielectric_f0 + (r.dielectric_f90 - r.dielectric_f0) * (c2 * c2 * c));
    const vec3 diffuse = r.diffuse * (refracted / PI);
    const float e = dot(h.xy, h.xy) / (r.width * r.width) + h.z * h.z;
    const float distribution = 1.0 / (PI * r.width * r.width * e * e);
    const float lambda_out = ggx_lambda(r.width, out_dir), lambda_in = ggx_lambda(r.width, in_dir);
    const vec3 mirror = fresnel(r.f0, r.f90, cosine) *
                        (distribution / ((1.0 + lambda_out + lambda_in) * 4.0 * out_dir.z * in_dir.z));
    const float mirror_density = distribution / ((1.0 + lambda_out) * 4.0 * out_dir.z);
    density = mix(in_dir.z / PI, mirror_density, r.mirror_share);
    return (diffuse + mirror) * in_dir.z;
}

// Samples a direction: cosine-weighted for the Lambert layer, visible normals for GGX (Heitz 2018). The direction may
// point below the surface, where the BRDF is zero.
vec3 sample_reflection(Reflector r, vec3 out_dir, float choice, vec2 u) {
    const float turn = 2.0 * PI;
    if (choice >= r.mirror_share) {
        const float radius = sqrt(u.x);
        return vec3(radius * cos(turn * u.y), radius * sin(turn * u.y), sqrt(max(0.0, 1.0 - u.x)));
    }
    const vec3 v = normalize(vec3(r.width * out_dir.xy, out_dir.z));
    const float length2 = dot(v.xy, v.xy);
    const vec3 t1 = length2 > 0.0 ? vec3(-v.y, v.x, 0.0) * inversesqrt(length2) : vec3(1.0, 0.0, 0.0);
    const vec3 t2 = cross(v, t1);
    const float radius = sqrt(u.x), a = radius * cos(turn * u.y), s = 0.5 * (1.0 + v.z);
    const float b = mix(sqrt(max(0.0, 1.0 - a * a)), radius * sin(turn * u.y), s);
    const vec3 n = a * t1 + b * t2 + sqrt(max(0.0, 1.0 - a * a - b * b)) * v;
    const vec3 h = normalize(vec3(r.width * n.xy, max(1e-6, n.z)));
    return reflect(-out_dir, h);
}

// Two directions at right angles to n and to each other (Duff et al. 2017).
mat3 frame_of(vec3 n) {
    const float s = n.z >= 0.0 ? 1.0 : -1.0, a = -1.0 / (s + n.z), b = n.x * n.y * a;
    return mat3(vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x), vec3(b, s + n.y * n.y * a, -n.y), n);
}
#endif
