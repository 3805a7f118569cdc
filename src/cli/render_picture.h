// SPDX-License-Identifier: Apache-2.0
// Images of ewa render that average several renders, for depth of field and motion blur. Also transparent images.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "cli/render_views.h"
#include "ewa/appearance.h"
#include "ewa/camera.h"
#include "ewa/renderer.h"

namespace ewa::cli {

/// --aperture, --focus, --shutter, --blur-samples and --transparent.
struct PictureArguments {
    double aperture = 0, focus = 0;  // world units; 0: not given
    double shutter = 0;              // share of a frame's time; 0: no motion blur
    int blur_samples = 32;
    bool transparent = false;

    bool blurs() const { return aperture > 0 || shutter > 0; }
};

/// Throws InputError if the options do not suit the views or the file format. path: whether the views are moments of one motion.
/// extension: the image files' extension in lower case, with its dot.
void check_picture(const PictureArguments& arguments, bool path, const std::string& extension);

/// Renders views with depth of field and motion blur. All views of one motion have the focus distance found for the first.
class PictureTaker {
  public:
    /// kernel: that of the renderer's options. views: must be moments of one motion if arguments.shutter > 0.
    PictureTaker(const PictureArguments& arguments, Renderer& renderer, Drawing drawing, Footprint kernel,
                 ViewPath views)
        : arguments_(arguments),
          renderer_(renderer),
          drawing_(drawing),
          kernel_(kernel),
          views_(std::move(views)) {}

    /// The image of view i. With a shutter, the camera moves towards the next view during the exposure.
    /// Throws InputError if the options do not suit the lens of a camera, or no view has a surface to focus on.
    Rendering take(size_t i);

    uint32_t skipped() const { return skipped_; }  // the most splats of a render that were not finite

  private:
    Rendering render(const Camera& camera);
    Rendering averaged(size_t i, double focus);
    double focus_of(size_t i);
    double depth_of_middle(const Camera& camera);

    const PictureArguments& arguments_;
    Renderer& renderer_;
    Drawing drawing_;
    Footprint kernel_;
    ViewPath views_;
    double found_ = 0;  // distance of focus
    uint32_t skipped_ = 0;
};

/// Whether the rendering shows no splat, or, for the depth of surfaces, no surface.
bool is_empty(const Rendering& rendering);

/// Applies an appearance (such as exposure) to the colours. Rendering and result are over a black background.
Image with_appearance_over_black(const Rendering& rendering, const Appearance& appearance);

/// RGBA whose colour is not multiplied by alpha, from a render over black.
Image transparent_image(const Rendering& rendering);

/// The colour as 8-bit RGBA, rounded and clamped as save_image does it.
std::vector<uint8_t> screen_bytes(const Image& color);

}  // namespace ewa::cli
