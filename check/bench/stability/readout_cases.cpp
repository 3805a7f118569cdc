// SPDX-License-Identifier: Apache-2.0
#include <glm/matrix.hpp>
#include <iterator>
#include <limits>

#include "bench/stability/case_table.h"
#include "scene/readout.h"

namespace ewa::bench {
namespace {

/// turn: radians, camera axes. way: along the camera's axes (world units).
Camera rolling(Camera camera, ReadoutFrom from, const glm::dvec3& turn, const glm::dvec3& way) {
    scene::add_readout(camera, from, turn, glm::transpose(camera.rotation) * way);
    return camera;
}

Gaussians splats_of_rows(const Change& change = {}) {
    Builder builder(usual_camera());
    builder.add_usual(80, change);
    return builder.take();
}

}  // namespace

void add_readouts(Table& table) {
    const Camera usual = usual_camera();
    const Camera moderate = rolling(usual, ReadoutFrom::top, {0.1, -0.12, 0.2}, {0.2, 0.1, -0.3});
    table.add("rolling_rows", "a camera that turns by 15 degrees during its readout", splats_of_rows(),
              moderate);
    table.add("rolling_columns", "columns from the right", splats_of_rows(),
              rolling(usual, ReadoutFrom::right, {-0.1, 0.1, 0.1}, {0.1, -0.2, 0.1}));
    // Rows that move down by 0.9 of the image's height: near splats keep up with the readout, and are skipped.
    table.add("rolling_fast", "splats that keep up with the readout", splats_of_rows(),
              rolling(usual, ReadoutFrom::top, {-0.5, 0, 0}, {0, -1, 0}));
    table.add("rolling_against", "a turn of 80 degrees against the readout", splats_of_rows(),
              rolling(usual, ReadoutFrom::top, {1.4, 0, 0}, {}));
    table.add("rolling_behind", "splats behind the camera at an end of the readout", splats_of_rows(),
              rolling(usual, ReadoutFrom::top, {}, {0, 0, 12}));
    table.add("rolling_off_screen", "splats far off the first and last rows",
              splats_of_rows([](Sketch& s, uint32_t i) {
                  const double factors[] = {-30, -3, 1, 3, 30};
                  s.view.y *= factors[i % std::size(factors)];
              }),
              moderate);
    table.add("rolling_1:1e4", "needles and discs", splats_of_rows([](Sketch& s, uint32_t i) {
                  s.scale = {0.4, i % 2 == 0 ? 4e-5 : 0.4, 4e-5};
              }),
              moderate);
    table.add("rolling_wide", "splats larger than the image",
              splats_of_rows([](Sketch& s, uint32_t) { s.scale *= 20.0; }), moderate);
    Camera fisheye = usual;
    fisheye.distortion = {.k1 = 0.02, .k2 = -0.01, .lens = Lens::fisheye};
    fisheye.fx = fisheye.fy = 25;
    table.add("rolling_fisheye", "a fisheye that moves", splats_of_rows(),
              rolling(fisheye, ReadoutFrom::bottom, {0.1, -0.12, 0.2}, {0.2, 0.1, -0.3}));
    Gaussians damaged = splats_of_rows();
    for (size_t i = 0; i < 30; ++i)
        damaged.means[3 * (2 * i) + i % 3] =
            i % 2 ? std::numeric_limits<float>::quiet_NaN() : std::numeric_limits<float>::infinity();
    table.add("rolling_value_nan", "every other splat has a mean that is not finite", damaged, moderate);
}

}  // namespace ewa::bench
