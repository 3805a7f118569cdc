// SPDX-License-Identifier: Apache-2.0
// Pictures of ewa render that consist of several renders: depth of field and motion blur. Also transparent ones.
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

/// Throws InputError where the images do not go with the options. path: whether the views are moments of one motion. extension: of the
/// images in lower case, with its dot.
void check_picture(const PictureArguments& arguments, bool path, const std::string& extension);

/// Takes pictures of views. It keeps the distance of focus that it has found for the first of a path.
class PictureTaker {
  public:
    /// kernel: of the renderer's options. views: moments of one motion for a shutter.
    PictureTaker(const PictureArguments& arguments, Renderer& renderer, Drawing drawing, Footprint kernel,
                 ViewPath views)
        : arguments_(arguments),
          renderer_(renderer),
          drawing_(drawing),
          kernel_(kernel),
          views_(std::move(views)) {}

    /// The picture of view i. With a shutter, while the camera moves to the next view.
    /// Throws InputError where the options do not go with the lens of a camera, or no view has anything in focus.
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

/// Whether it shows no splat, or no surface where it has the depth of surfaces.
bool is_empty(const Rendering& rendering);

/// The colours as a camera of this appearance shows them. The rendering is over black, and stays so.
Image with_appearance_over_black(const Rendering& rendering, const Appearance& appearance);

/// RGBA whose colour is not multiplied by alpha, from a render over black.
Image transparent_image(const Rendering& rendering);

/// The colour as 8-bit RGBA, rounded and clamped as save_image does it.
std::vector<uint8_t> screen_bytes(const Image& color);

}  // namespace ewa::cli
