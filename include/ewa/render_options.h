// SPDX-License-Identifier: Apache-2.0
// The options of a render: all that an image depends on besides the splats and the camera.
#pragma once
#include <array>
#include <cstdint>
#include <memory>

namespace ewa {

struct SkyMap;

/// How a splat's opacity depends on its footprint. Values are KERNEL_* of shaders/shared/constants.h.
enum class Footprint { peak = 0, antialias = 1, density = 2 };

/// How the splats along a ray become one colour.
enum class Integrator {
    splat,    // 2D footprints on the image, in the depth order of the splats' means
    ray,      // each splat's integral along the ray, in the order of the integrals' middles on the ray
    march,    // the volume of all splats, in intervals along the ray
    fast_ray  // each splat's integral along the ray, in the depth order of the splats' means
};

inline constexpr int kMostSamples = 4096, kMostNearest = 1000;

/// Options that a scene is rendered and trained with.
struct RenderOptions {
    std::array<float, 3> background{0, 0, 0};  // RGB, as the pixels of Image
    Footprint kernel = Footprint::peak;
    int sh_degree = 3;  // degrees above this, or above the scene's, are skipped
    Integrator integrator = Integrator::splat;
    int samples = 64;     // of a ray, with Integrator::march
    bool points = false;  // spheres in place of Gaussians: the nearest ones at a pixel, blended by weight
    int nearest = 8;      // spheres at a pixel, with `points`
    std::shared_ptr<const SkyMap> sky{};  // in place of the background; null: none
};

/// Throws InputError for a negative SH degree, for samples or spheres outside 1 to kMostSamples and kMostNearest, and what
/// check(SkyMap) throws. Functions that take RenderOptions call this check.
void check(const RenderOptions& options);

/// The planes of a render.
enum class Drawing {
    color,
    depth,  // the colour, and Rendering::depth
    count,  // the colour, and Rendering::count
    /// Each splat as a solid ellipsoid of ELLIPSOID_REACH standard deviations. The nearest one gives the pixel its shaded colour.
    ellipsoids,
    /// Rendering::median_depth in place of the colour. For Integrator::splat without `points`.
    median_depth,
    /// Rendering::normal in place of the colour. For Integrator::splat without `points`.
    normal
};

/// Bits of a splat's mark, see Renderer::mark.
enum Mark : uint8_t {
    kMarkSelected = 1,  // drawn in the selection's colour
    kMarkLocked = 2,    // drawn darker
    kMarkHidden = 4,    // not drawn
    kMarkDeleted = 8,   // not drawn
    kMarkPreview = 16,  // drawn red: what a cleaning rule would remove
};

/// The options that may differ from one image of a scene to the next.
struct DrawOptions {
    RenderOptions render;
    Drawing drawing = Drawing::color;
    double splat_scale = 1;     // factor of every splat's scales, above 0
    bool plain_colors = false;  // marks hide splats, but do not tint them (for pictures and films)
};

}  // namespace ewa
