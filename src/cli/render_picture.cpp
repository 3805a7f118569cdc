// SPDX-License-Identifier: Apache-2.0
#include "cli/render_picture.h"

#include <algorithm>
#include <cmath>

#include "ewa/error.h"
#include "scene/camera.h"
#include "scene/color.h"
#include "scene/native_lens.h"
#include "scene/picture_views.h"

namespace ewa::cli {
namespace {

void add_image(Image& sum, const Image& image, bool linear) {
    if (sum.pixels.empty()) sum = Image(image.width, image.height, image.channels);
    for (size_t i = 0; i < image.pixels.size(); ++i) {
        const float v = image.pixels[i];
        sum.pixels[i] += linear ? float(scene::linear_of_srgb(std::max(v, 0.0f))) : v;
    }
}

void divide(Image& sum, int count, bool linear) {
    for (float& v : sum.pixels)
        v = linear ? float(scene::srgb_of_linear(double(v) / count)) : v / float(count);
}

}  // namespace

void check_picture(const PictureArguments& arguments, bool path, const std::string& extension) {
    if (arguments.shutter > 0 && !path)
        throw InputError("--shutter: there is no motion; it needs a film, --orbit or --film-seconds");
    if (arguments.transparent && extension != ".png" && extension != ".exr")
        throw InputError("--transparent: " + extension + " has no alpha; a .png and an .exr have");
}

Rendering PictureTaker::render(const Camera& camera) {
    Rendering rendering = renderer_.render(camera, drawing_);
    skipped_ = std::max(skipped_, renderer_.skipped_nonfinite());
    return rendering;
}

/// The depth of the surface in the middle of the image. Where none is opaque, the mean of what the middle shows. 0: nothing.
double PictureTaker::depth_of_middle(const Camera& camera) {
    // The middle pixel of a small image of a tenth of the view.
    constexpr int kSide = 33;
    constexpr double kShown = 0.1;
    const double scale = kSide / (kShown * std::min(camera.width, camera.height));
    Camera middle = camera;
    middle.width = middle.height = kSide;
    middle.fx *= scale;
    middle.fy *= scale;
    middle.cx = 0.5 * kSide + scale * (camera.cx - 0.5 * camera.width);
    middle.cy = 0.5 * kSide + scale * (camera.cy - 0.5 * camera.height);
    // Other integrators draw no surfaces.
    DrawOptions options{.render = {.kernel = kernel_}, .drawing = Drawing::median_depth};
    const float surface = *renderer_.render(middle, options).median_depth.at(kSide / 2, kSide / 2);
    if (surface > 0) return surface;
    options.drawing = Drawing::depth;
    const Rendering seen = renderer_.render(middle, options);
    constexpr float kThere = 0.1f;
    return *seen.alpha.at(kSide / 2, kSide / 2) > kThere ? *seen.depth.at(kSide / 2, kSide / 2) : 0;
}

double PictureTaker::focus_of(size_t i) {
    if (arguments_.focus > 0) return arguments_.focus;
    if (views_.at && found_ > 0) return found_;
    if (const double depth = depth_of_middle(views_.cameras[i]); depth > 0) return found_ = depth;
    // A view whose middle is empty has the distance of another one.
    for (size_t k = 0; k < views_.cameras.size() && !(found_ > 0); ++k)
        if (scene::has_movable_eye(views_.cameras[k])) found_ = depth_of_middle(views_.cameras[k]);
    if (!(found_ > 0)) throw InputError("--focus is needed: the middle of the image shows no splat");
    return found_;
}

Rendering PictureTaker::averaged(size_t i, double focus) {
    const Camera& view = views_.cameras[i];
    const int count = arguments_.blur_samples;
    // Light adds up in a camera, so colours are averaged in linear light. Programs that put a transparent image over another one
    // blend stored values, as splats are blended.
    const bool linear = !arguments_.transparent;
    Rendering sum;
    for (int k = 0; k < count; ++k) {
        Camera camera =
            arguments_.shutter > 0 ? views_.at(double(i) + arguments_.shutter * scene::even_share(k)) : view;
        const glm::dvec2 place = 0.5 * arguments_.aperture * scene::disc_point(k, count);
        if (arguments_.aperture > 0) camera = scene::moved_eye(camera, place, focus);
        const Rendering one = render(camera);
        add_image(sum.color, one.color, linear);
        add_image(sum.alpha, one.alpha, false);
    }
    divide(sum.color, count, linear);
    divide(sum.alpha, count, false);
    return sum;
}

Rendering PictureTaker::take(size_t i) {
    const Camera& camera = views_.cameras[i];
    if (!arguments_.blurs()) return render(camera);
    if (scene::shows_all_around(camera))
        throw InputError("--aperture and --shutter: a 360° image has neither");
    if (arguments_.aperture > 0 && !scene::has_movable_eye(camera))
        throw InputError("--aperture needs a pinhole: --lens undistort");
    return averaged(i, arguments_.aperture > 0 ? focus_of(i) : 1);
}

bool is_empty(const Rendering& rendering) {
    const Image& shown = rendering.median_depth.pixels.empty() ? rendering.alpha : rendering.median_depth;
    return std::ranges::all_of(shown.pixels, [](float value) { return value == 0; });
}

namespace {

/// The colours of a render over black, not multiplied by alpha.
Image straight_colors(const Rendering& rendering) {
    Image color = rendering.color;
    for (size_t i = 0; i < rendering.alpha.pixels.size(); ++i)
        if (const float alpha = rendering.alpha.pixels[i]; alpha > 0)
            for (size_t c = 0; c < 3; ++c) color.pixels[3 * i + c] /= alpha;
    return color;
}

}  // namespace

Image with_appearance_over_black(const Rendering& rendering, const Appearance& appearance) {
    Image color = with_appearance(straight_colors(rendering), appearance);
    for (size_t i = 0; i < color.pixels.size(); ++i) color.pixels[i] *= rendering.alpha.pixels[i / 3];
    return color;
}

Image transparent_image(const Rendering& rendering) {
    return with_alpha(straight_colors(rendering), rendering.alpha);
}

std::vector<uint8_t> screen_bytes(const Image& color) {
    std::vector<uint8_t> bytes;
    bytes.reserve(color.pixels.size() / 3 * 4);
    for (size_t i = 0; i < color.pixels.size(); ++i) {
        bytes.push_back(uint8_t(std::lround(255 * std::clamp(color.pixels[i], 0.0f, 1.0f))));
        if (i % 3 == 2) bytes.push_back(255);
    }
    return bytes;
}

}  // namespace ewa::cli
