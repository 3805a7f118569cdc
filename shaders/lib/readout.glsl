// SPDX-License-Identifier: Apache-2.0
// Splats that a rolling shutter sees, with LENSES_ROLLING: the time of a splat's row, and its image then.
// check/reference/readout.h has the formulas. Times are those of scene::middle_motion. Needs lens.glsl.
#ifndef EWA_LIB_READOUT
#define EWA_LIB_READOUT

const bool ROLLING = LENSES == LENSES_ROLLING;

vec3 readout_turn() { return vec3(camera.readout_turn[0], camera.readout_turn[1], camera.readout_turn[2]); }

// Factors of turn x p and of turn x (turn x p) in p's turn at a time: sin(a) / a and (1 - cos(a)) / a^2 as series, because the
// device's sine may have few digits. a is at most READOUT_TURN_MAX (0.5 + READOUT_MARGIN).
vec2 turn_factors(float time) {
    const vec3 turn = readout_turn();
    const float q = time * time * dot(turn, turn);
    const float sine = 1.0 - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0 * (1.0 - q / 72.0 * (1.0 - q / 110.0))));
    const float cosine = 0.5 - q / 24.0 * (1.0 - q / 30.0 * (1.0 - q / 56.0 * (1.0 - q / 90.0 * (1.0 - q / 132.0))));
    return vec2(time * sine, time * time * cosine);
}

vec3 turned(vec3 p, vec2 factors) {
    const vec3 across = cross(readout_turn(), p);
    return p + factors.x * across + factors.y * cross(readout_turn(), across);
}

// The camera's turn since the middle of the readout, as a matrix.
mat3 readout_rotation(float time) {
    const vec2 factors = turn_factors(time);
    return mat3(turned(vec3(1.0, 0.0, 0.0), factors), turned(vec3(0.0, 1.0, 0.0), factors), turned(vec3(0.0, 0.0, 1.0), factors));
}

vec3 readout_shift() { return vec3(camera.readout_shift[0], camera.readout_shift[1], camera.readout_shift[2]); }

// A point at a time of the readout. The turn adds a small term to a float pair: it needs no pair itself.
View view_at(View middle, float time) {
    const vec3 shift = readout_shift();
    const vec2 x = df_add(middle.x, two_product(time, -shift.x)), y = df_add(middle.y, two_product(time, -shift.y)),
               z = df_add(middle.z, two_product(time, -shift.z));
    const vec2 factors = turn_factors(time);
    const vec3 p = vec3(x.x, y.x, z.x), across = cross(readout_turn(), p);
    const vec3 added = factors.x * across + factors.y * cross(readout_turn(), across);
    return View(middle.offset, df_add(x, vec2(added.x, 0.0)), df_add(y, vec2(added.y, 0.0)), df_add(z, vec2(added.z, 0.0)));
}

bool in_front(LensImage image) { return image.shown && image.depth > float(NEAR_PLANE); }

// r: how the time of the pixel changes with the point.
vec3 readout_row(LensImage image) {
    return camera.readout_slope[0] * camera.focal_hi[0] * image.exact_x + camera.readout_slope[1] * camera.focal_hi[1] * image.exact_y;
}

vec3 readout_shift_at(float time) { return turned(readout_shift(), turn_factors(time)); }

vec3 readout_motion(View view, float time) { return cross(readout_turn(), point_of(view)) - readout_shift_at(time); }

float cut_time(float time) { return clamp(time, -0.5 - float(READOUT_MARGIN), 0.5 + float(READOUT_MARGIN)); }

// Fills `readout`, and by how much the time of the pixel is late.
float set_readout(View view, LensImage image, inout Readout readout) {
    readout.motion = readout_motion(view, readout.time);
    const vec2 pixel = vec2(pixel_in_plane(image.x, 0).x, pixel_in_plane(image.y, 1).x);
    const float time = camera.readout_first + dot(vec2(camera.readout_slope[0], camera.readout_slope[1]), pixel);
    const float cut = cut_time(time);
    readout.row = cut == time ? readout_row(image) : vec3(0.0);
    return cut - readout.time;
}

// Moves the view and its image to the time of the splat's row, and shears the rows of J. The body of the loop is large: one copy of it
// compiles faster.
Readout read_out(inout View view, out LensImage image) {
    const View middle = view;
    Readout readout = Readout(0.0, vec3(0.0), vec3(0.0), 1.0);
    float late = 0.0, rate = 1.0, next = 0.0, end = -0.5;
    bool found = false, shown = false;
    [[dont_unroll]] for (uint i = 0u; i < READOUT_VIEWS; ++i) {
        readout.time = next;
        view = view_at(middle, next);
        image = lens_image(view);
        shown = in_front(image);
        late = set_readout(view, image, readout);
        rate = 1.0 - dot(readout.row, readout.motion);
        found = found || shown;
        if (shown) {
            next = cut_time(next + late / max(rate, float(READOUT_RATE_MIN)));
        } else {
            // A splat may be behind the camera at some times only. One that was in front and is no longer has no time.
            if (found || end > 0.5) break;
            next = end;
            end += 1.0;
        }
    }
    image.shown = shown && rate >= float(READOUT_RATE_MIN) && abs(late) <= float(READOUT_RESIDUAL);
    readout.gain = 1.0 / rate;
    // The time has few digits. Where the pixel moves far, that would be a part of a pixel: the motion takes it there.
    const float rest = late * readout.gain;
    image.x = df_add(image.x, vec2(rest * dot(image.exact_x, readout.motion), 0.0));
    image.y = df_add(image.y, vec2(rest * dot(image.exact_y, readout.motion), 0.0));
    const vec3 row = readout.gain * readout.row;
    image.jx += dot(image.jx, readout.motion) * row;
    image.jy += dot(image.jy, readout.motion) * row;
    image.exact_x += dot(image.exact_x, readout.motion) * row;
    image.exact_y += dot(image.exact_y, readout.motion) * row;
    view.offset = transpose(readout_rotation(readout.time) * camera_rotation()) * point_of(view);
    return readout;
}
#endif
