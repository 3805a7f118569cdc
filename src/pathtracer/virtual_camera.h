// SPDX-License-Identifier: Apache-2.0
// The cameras of a rendered dataset: where they are, their exposure, and how radiance becomes an image.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "ewa/appearance.h"
#include "ewa/camera.h"
#include "ewa/image.h"
#include "scene/mesh_scene.h"

namespace ewa::pathtracer {

/// `count` pinholes on a dome around the box that look at its centre, y up. Elevations are 8 to 65 degrees,
/// spaced by equal area. Each camera is turned by the golden angle from the one before, so every k-th of them
/// covers the dome too. The angle of view is 45 degrees along the smaller side. Each camera is as near as
/// possible with all corners of the box in its image; for a box without extent, one unit away. count, width,
/// height >= 1; width and height in px.
std::vector<Camera> dome_cameras(const scene::Box& box, int count, int width, int height);

/// The pinhole of a file's camera for an image of this size in px, with its vertical angle and square pixels.
Camera pinhole_of(const scene::FileCamera& camera, int width, int height);

/// The sRGB transfer function of min(1, value). NaN and negative values become 0.
float developed(double value);

/// Composites the pixels over the sky. `radiance` is as in develop; afterwards all pixels are fully covered.
void show_sky(Image& radiance, const Camera& camera, const scene::Sky& sky);

/// Applies `factor` and sRGB's curve. `radiance` is RGBA: radiance times coverage, and coverage. The result
/// is RGB if all pixels are fully covered, else RGBA with colour not multiplied by alpha.
Image develop(const Image& radiance, double factor);

/// The exposure in stops, rounded to tenths, that maps the 95th percentile of the covered pixels' largest
/// channel to 0.8. 0 if all pixels are black.
double automatic_exposure(const std::vector<Image>& radiances);

/// A PPISP for each of `count` images of one camera. Their exposures and colours have the mean 0.
std::vector<Ppisp> varied_appearances(size_t count, uint64_t seed);

}  // namespace ewa::pathtracer
