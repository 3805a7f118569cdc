// SPDX-License-Identifier: Apache-2.0
#include "cli/render_views.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "cli/arguments.h"
#include "core/pixel_size.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "io/datasets/view_list.h"
#include "scene/camera.h"
#include "scene/intrinsics.h"
#include "scene/native_lens.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;

constexpr core::PixelSize kUsualSize{1280, 720}, kPanoramaSize{2048, 1024};
constexpr int kOrbitFrames = 8 * image::kFilmRate;
constexpr double kSecondsBetweenViews = 2;  // of a film, from one saved view to the next
constexpr int kMostFrames = 100000;

/// Eye and target.
std::array<glm::dvec3, 2> parse_look_at(const std::string& text) {
    const std::vector<double> values = core::parse_list(text).value_or(std::vector<double>());
    if (values.size() != 6)
        throw InputError(
            "--look-at: '" + text +
            "' is not six numbers, the eye and the point that it looks at, such as 0,0,-4,0,0,0");
    const glm::dvec3 eye(values[0], values[1], values[2]), target(values[3], values[4], values[5]);
    if (!(glm::length(target - eye) > 0))
        throw InputError("--look-at: the eye is at the point that it looks at");
    return {eye, target};
}

/// The cameras at whole times, for a motion of so many frames.
ViewPath moments_of(std::function<Camera(double)> at, int count) {
    ViewPath views;
    for (int i = 0; i < count; ++i) views.cameras.push_back(at(i));
    if (count > 1) views.at = std::move(at);
    return views;
}

/// length: of the film, s. at: the camera after so many frames of so many.
ViewPath film_of(double length, const std::function<Camera(double, double)>& at) {
    const double frames = image::kFilmRate * length + 1;
    if (frames > kMostFrames)
        throw InputError(fmt::format("--film-seconds: a film of more than {} frames", kMostFrames));
    const int count = std::max(1, int(std::lround(frames)));
    const double last = count - 1;
    // After the last frame, the camera goes back: that frame has the blur of the motion that led to it.
    return moments_of(
        [=](double time) { return at(time <= last ? time : 2 * last - time, std::max(last, 1.0)); }, count);
}

/// The film through the keys. times: when it passes them (s).
ViewPath along_views(const std::vector<Camera>& keys, const std::vector<double>& times, double seconds) {
    const double parts = double(keys.size() - 1);
    if (times.empty())
        return film_of(parts * seconds,
                       [=](double done, double all) { return along_path(keys, parts * done / all); });
    const double from = times.front(), length = times.back() - from;
    return film_of(length, [=](double done, double all) {
        return along_path(keys, times, from + length * done / all, true);
    });
}

}  // namespace

ViewPath path_of(const Dataset& dataset, const std::vector<int>& frames) {
    constexpr double kHighestRate = 1000;
    if (dataset.frame_rate > kHighestRate)
        throw InputError(fmt::format("{}: {:.6g} frames per second are no film's", dataset.root.string(),
                                     dataset.frame_rate));
    ViewPath path;
    path.rate = dataset.frame_rate;
    for (const int frame : frames) path.cameras.push_back(dataset.frames[size_t(frame)].camera);
    const double last = double(frames.size()) - 1;
    // As in along_views, the last frame has the blur of the motion that led to it.
    if (last > 0)
        path.at = [keys = path.cameras, last](double time) {
            return along_path(keys, time <= last ? time : 2 * last - time);
        };
    return path;
}

namespace {

ViewPath saved_views(const ViewsArguments& arguments, ViewsOutput output) {
    const std::vector<io::NamedView> views = io::read_views(arguments.views);
    std::vector<Camera> cameras;
    for (const io::NamedView& view : views) cameras.push_back(view.camera);
    if (cameras.empty()) throw InputError(arguments.views.string() + ": has no views");
    const bool path = output == ViewsOutput::film || arguments.film_seconds > 0;
    if (!arguments.size.empty() || path) {
        core::PixelSize size{cameras[0].width, cameras[0].height};
        if (!arguments.size.empty()) size = size_of(arguments.size);
        for (Camera& camera : cameras) camera = scene::fitted(camera, size.width, size.height);
    }
    if (!path) return {cameras};
    if (arguments.film_seconds == 0 && views[0].time) return along_views(cameras, io::times_of(views, 0), 0);
    return along_views(cameras, {},
                       arguments.film_seconds > 0 ? arguments.film_seconds : kSecondsBetweenViews);
}

ViewPath around(const scene::Framing& framing, int count) {
    return moments_of(
        [=](double time) {
            return scene::orbited(framing.camera, framing.target, framing.up,
                                  2 * std::numbers::pi * time / count);
        },
        count);
}

/// The same views through a lens.
ViewPath seen_through(const LensArgument& lens, ViewPath views, const glm::dvec3& up,
                      const glm::dvec3& middle) {
    const auto seen = [=](const Camera& camera) { return through(lens, camera, up, middle); };
    std::ranges::transform(views.cameras, views.cameras.begin(), seen);
    if (views.at) views.at = [seen, at = views.at](double time) { return seen(at(time)); };
    return views;
}

}  // namespace

std::optional<glm::dvec3> parse_up(const std::string& text) {
    if (text.empty()) return std::nullopt;
    const bool negative = text[0] == '-';
    const std::string axis = text.substr(negative || text[0] == '+' ? 1 : 0);
    if (axis != "x" && axis != "y" && axis != "z")
        throw InputError("--up: '" + text + "' is not an axis: x, y, z, or the opposite such as --up=-y");
    glm::dvec3 up(0);
    up[axis[0] - 'x'] = negative ? -1 : 1;
    return up;
}

bool any_given(const ViewsArguments& arguments) {
    return !arguments.size.empty() || !arguments.look_at.empty() || !arguments.up.empty() ||
           !arguments.views.empty() || arguments.orbit > 0;
}

ViewsOutput views_output(const fs::path& path) {
    std::error_code error;
    if (fs::is_directory(path, error)) return ViewsOutput::folder;
    const std::string extension = core::lower(path.extension().string());
    for (const char* image : {".png", ".jpg", ".jpeg", ".exr"})
        if (extension == image) return ViewsOutput::image;
    for (const char* other : {".gif", ".webp", ".bmp", ".tif", ".tiff", ".avi"})
        if (extension == other)
            throw InputError("--output " + core::one_line(path.string()) +
                             ": an image is .png, .jpg or .exr, a film .mp4, .mov, .mkv or .webm, and a "
                             "folder has another "
                             "name");
    if (image::is_film_name(path)) return ViewsOutput::film;
    if (fs::exists(path, error))
        throw InputError("--output " + core::one_line(path.string()) +
                         ": is no folder; an image is .png, .jpg or .exr, a film .mp4, .mov, .mkv or .webm");
    return ViewsOutput::folder;
}

void check_views(const ViewsArguments& arguments) {
    if (!arguments.size.empty()) size_of(arguments.size);
    if (!arguments.look_at.empty()) parse_look_at(arguments.look_at);
    parse_up(arguments.up);
}

Camera through(const LensArgument& lens, const Camera& camera, const glm::dvec3& up,
               const glm::dvec3& middle) {
    if (lens.lens.lens != Lens::equirectangular) {
        const Camera seen = scene::through_lens(camera, lens.lens, lens.fisheye_degrees, middle);
        const std::string fault = scene::intrinsics_fault(seen, lens.lens);
        if (!fault.empty()) throw InputError("--through: " + fault);
        return seen;
    }
    // A look straight down or up has its heading at the top or bottom of the image.
    const glm::dmat3 axes = glm::transpose(camera.rotation);
    glm::dvec3 ahead = axes[2] - glm::dot(axes[2], up) * up;
    if (glm::length(ahead) < 1e-3) ahead = -axes[1];
    const glm::dvec3 eye = camera.position();
    const Camera level = scene::look_at(eye, eye + ahead, up, camera.width, camera.height);
    return scene::through_lens(level, lens.lens, lens.fisheye_degrees, middle);
}

namespace {

/// The views round the scene or from a given eye.
ViewPath framed_views(const ViewsArguments& arguments, const Gaussians& gaussians,
                      const scene::FramingHints& hints, int count) {
    const bool all_around = arguments.lens && arguments.lens->lens.lens == Lens::equirectangular;
    core::PixelSize size = !arguments.size.empty() ? size_of(arguments.size)
                           : all_around            ? kPanoramaSize
                                                   : kUsualSize;
    // A size of screens names the width of a panorama.
    if (all_around && arguments.size.find('x') == std::string::npos) size.height = size.width / 2;
    scene::FramingHints known = hints;
    if (const auto up = parse_up(arguments.up)) known.up = up;
    known.all_round = count > 1;
    scene::Framing framing;
    if (arguments.look_at.empty()) {
        framing = scene::frame_scene(gaussians, size.width, size.height, known);
        if (all_around && count == 1) {
            const glm::dvec3 ahead = glm::transpose(framing.camera.rotation)[2];
            const glm::dvec3 eye = arguments.inside.value_or(framing.target);
            framing.camera = scene::look_at(eye, eye + ahead, framing.up, size.width, size.height);
        }
    } else {
        framing.up = known.up ? glm::normalize(*known.up) : scene::guessed_up(gaussians);
        const auto [eye, target] = parse_look_at(arguments.look_at);
        framing.target = target;
        framing.camera = scene::look_at(eye, target, framing.up, size.width, size.height);
    }
    ViewPath views = around(framing, count);
    if (!arguments.lens) return views;
    return seen_through(*arguments.lens, std::move(views), framing.up, framing.target);
}

}  // namespace

ViewPath views_of(const ViewsArguments& arguments, const Gaussians& gaussians,
                  const scene::FramingHints& hints, ViewsOutput output) {
    const bool film = output == ViewsOutput::film;
    ViewPath views;
    if (!arguments.views.empty()) {
        views = saved_views(arguments, output);
        if (arguments.lens) {
            const auto given = parse_up(arguments.up);
            const glm::dvec3 up = given ? *given : hints.up ? *hints.up : scene::guessed_up(gaussians);
            const glm::dvec3 middle = scene::framed_box(gaussians).center();
            views = seen_through(*arguments.lens, std::move(views), glm::normalize(up), middle);
        }
    } else {
        const int count = arguments.orbit > 0 ? arguments.orbit : film ? kOrbitFrames : 1;
        views = framed_views(arguments, gaussians, hints, count);
    }
    if (output == ViewsOutput::image && views.cameras.size() > 1)
        throw InputError(
            fmt::format("--output names one image, and there are {} views; name a folder, or a film such "
                        "as film.mp4",
                        views.cameras.size()));
    return views;
}

}  // namespace ewa::cli
