// SPDX-License-Identifier: Apache-2.0
// The views of ewa render without a dataset: the scene framed by itself, an orbit, given eyes and saved views.
#pragma once
#include <filesystem>
#include <functional>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cli/film.h"
#include "cli/lens_argument.h"
#include "ewa/camera.h"
#include "ewa/dataset.h"
#include "ewa/gaussians.h"
#include "scene/framing.h"

namespace ewa::cli {

/// --size, --look-at, --up, --views, --orbit, --film-seconds and --through.
struct ViewsArguments {
    std::string size, look_at, up;
    std::filesystem::path views;
    int orbit = 0;                          // 0: not given
    double film_seconds = 0;                // 0: not given
    std::optional<LensArgument> lens = {};  // empty: a pinhole
    // World: where a 360° image is taken unless an option names the eye. Empty: in the middle of the scene.
    std::optional<glm::dvec3> inside = {};
};

/// Whether one of these options is given.
bool any_given(const ViewsArguments& arguments);

/// What the views are written as.
enum class ViewsOutput { image, folder, film };
/// An existing folder is one. Else by the name: .png and .exr are an image, those of is_film_name a film, others a folder.
/// Throws InputError for the names of other images and films, and of an existing file.
ViewsOutput views_output(const std::filesystem::path& path);

/// Parses --up. Empty: not given. Throws InputError.
std::optional<glm::dvec3> parse_up(const std::string& text);

/// Throws InputError for texts that cannot be read. The scene is not needed.
void check_views(const ViewsArguments& arguments);

/// The camera through the lens, where middle (world) is what it looks at. A 360° image has its horizon level.
Camera through(const LensArgument& lens, const Camera& camera, const glm::dvec3& up,
               const glm::dvec3& middle);

struct ViewPath {
    std::vector<Camera> cameras;
    /// Where they are moments of one motion, the camera at a time: cameras[i] at i, for times from 0 to size(). Else empty.
    std::function<Camera(double)> at = {};
    double rate = kFilmRate;  // frames per second of a film
};

/// The frames of a dataset that is a path of cameras. Throws InputError if its rate is none of a film.
ViewPath path_of(const Dataset& dataset, const std::vector<int>& frames);

/// At least one camera, all of one size for a film. hints: what is known of the scene; --up has precedence. Throws
/// InputError, also if an image should hold several views.
ViewPath views_of(const ViewsArguments& arguments, const Gaussians& gaussians,
                  const scene::FramingHints& hints, ViewsOutput output);

}  // namespace ewa::cli
