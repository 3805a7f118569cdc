// SPDX-License-Identifier: Apache-2.0
// The views of ewa render without a dataset: the scene framed by itself, an orbit, given eyes and saved views.
#pragma once
#include <filesystem>
#include <functional>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cli/lens_argument.h"
#include "ewa/camera.h"
#include "ewa/dataset.h"
#include "ewa/gaussians.h"
#include "image/film_file.h"
#include "scene/framing.h"

namespace ewa::cli {

/// --size, --look-at, --up, --views, --orbit, --film-seconds and --through.
struct ViewsArguments {
    std::string size, look_at, up;
    std::filesystem::path views;
    int orbit = 0;                          // 0: not given
    double film_seconds = 0;                // 0: not given
    std::optional<LensArgument> lens = {};  // empty: a pinhole
    // Position (world) of a 360° camera unless an option names the eye. Empty: the middle of the scene.
    std::optional<glm::dvec3> inside = {};
};

/// Whether one of these options is given.
bool any_given(const ViewsArguments& arguments);

/// The form in which the views are written: one image, a folder of images, or a film.
enum class ViewsOutput { image, folder, film };
/// The form that the output path names. An existing folder gives a folder. Else the extension decides: .png and .exr give an
/// image, names of is_film_name() a film, others a folder. Throws InputError for other image or film formats, and existing files.
ViewsOutput views_output(const std::filesystem::path& path);

/// Parses --up. Empty: not given. Throws InputError.
std::optional<glm::dvec3> parse_up(const std::string& text);

/// Checks the arguments before the scene is loaded. Throws InputError for a text that cannot be parsed.
void check_views(const ViewsArguments& arguments);

/// The camera with this lens. middle: the point (world) that it looks at. A 360° camera is turned so that its horizon is level.
Camera through(const LensArgument& lens, const Camera& camera, const glm::dvec3& up,
               const glm::dvec3& middle);

struct ViewPath {
    std::vector<Camera> cameras;
    /// The camera at any time from 0 to cameras.size(); at(i) is cameras[i]. Empty unless the cameras are moments of one motion.
    std::function<Camera(double)> at = {};
    double rate = image::kFilmRate;  // frames per second of a film
};

/// The cameras of these frames of a dataset, in order. Throws InputError if the dataset's frame rate cannot be that of a film.
ViewPath path_of(const Dataset& dataset, const std::vector<int>& frames);

/// The cameras that the arguments ask for: at least one, all of one size for a film. hints: the scene's up direction and front;
/// --up has precedence. Throws InputError, also if several views would be written to one image.
ViewPath views_of(const ViewsArguments& arguments, const Gaussians& gaussians,
                  const scene::FramingHints& hints, ViewsOutput output);

}  // namespace ewa::cli
