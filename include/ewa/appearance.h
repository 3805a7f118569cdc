// SPDX-License-Identifier: Apache-2.0
// The appearance of training images: how a camera changes their colours. Training learns it.
#pragma once
#include <array>
#include <filesystem>
#include <glm/glm.hpp>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "ewa/image.h"

namespace ewa {

/// Models of a training image's appearance.
enum class AppearanceModel {
    none,
    affine,    // an affine map of colours for each image, as 3DGS learns exposures: Exposure
    ppisp,     // exposure and colours of each image, vignette and response of each camera: Ppisp
    grid,      // a bilateral grid of affine maps for each image: ColorGrid
    automatic  // ppisp if the training images disagree on the colours of the points or by EXIF, else none
};

/// An affine map of colours: three rows of a 3x3 matrix M, each followed by its offset in b. The training image shows M c + b
/// where the splats have colour c.
using Exposure = std::array<float, 12>;
inline constexpr Exposure kIdentityExposure{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

/// PPISP: an image's exposure and colour map, and its camera's vignette and response, in this order (shaders/lib/ppisp.glsl has the
/// formulas). A default-constructed Ppisp leaves colours from 0 to 1 unchanged.
struct Ppisp {
    /// An image's values: its exposure in stops, then latent x, y offsets of the four colours to which blue, red, green and grey
    /// map.
    std::array<float, 9> photo{};
    /// A camera's values, nine for each colour channel. The vignette has a centre x, y from the image's middle, in units of the
    /// larger side, and factors of r^2, r^4 and r^6. The response has toe, shoulder, gamma and middle, before softplus and sigmoid.
    std::array<float, 27> camera = neutral_camera();

    /// The values of `camera` that change no colour.
    static std::array<float, 27> neutral_camera();
    bool operator==(const Ppisp&) const = default;
};

/// A bilateral grid: GRID_CELLS affine maps of 12 floats, in the order of shaders/shared/layouts.h.
struct ColorGrid {
    std::vector<float> cells = identity_cells();

    /// GRID_CELLS identity maps.
    static std::vector<float> identity_cells();
    bool operator==(const ColorGrid&) const = default;
};

using Appearance = std::variant<Exposure, Ppisp, ColorGrid>;

/// Throws InputError unless a ColorGrid has all of its cells. Functions that take an Appearance call this check.
void check(const Appearance& appearance);
/// Checks each appearance. Also throws InputError unless all appearances have one model.
void check(const std::vector<Appearance>& appearances);

/// Applies the appearance to the first three channels, which are RGB as the splats store it. Other channels stay unchanged. Ppisp
/// clamps to 0..1. Throws InputError for fewer than 3 channels.
Image with_appearance(Image image, const Appearance& appearance);

/// The appearance of views that training has not seen. Neighbouring images of a camera with automatic exposure look alike. So a new
/// view gets a mean of the training images' appearances, with weights of 1 / distance^4 between the cameras (Shepard 1968).
/// That rule is tested first: it predicts the brightness of each training image from the others. If it predicts worse than one
/// appearance for all places, all views get that one: the mean over all images, or with Exposure none, the splats' own colours.
class NewViewAppearance {
  public:
    /// Has no appearances: at() returns no value.
    NewViewAppearance() = default;
    /// centers: of the images' cameras, in world coordinates; empty: unknown. Throws InputError for appearances of several models,
    /// for another number of centres, and for centres that are not finite.
    explicit NewViewAppearance(std::vector<Appearance> of_images, std::vector<glm::dvec3> centers = {});

    /// The appearance of a view whose camera has this centre in world coordinates. Empty without appearances.
    std::optional<Appearance> at(const glm::dvec3& center) const;

    /// Whether the appearance depends on the camera's centre.
    bool is_local() const { return !centers_.empty(); }

  private:
    std::vector<Appearance> of_images_;
    std::vector<glm::dvec3> centers_;  // empty: one appearance for all places
    std::optional<Appearance> of_all_;
};

/// Reads the appearances of training images, by Frame::name, from a run's appearance.json, or from the exposures.json of an older
/// run. Throws InputError if the file cannot be read, or values are missing or not finite.
std::map<std::string, Appearance> load_appearances(const std::filesystem::path& path);
/// Writes appearance.json. names: one for each appearance. All appearances have one model. Throws RunError (disk), InputError
/// (other faults).
void save_appearances(const std::filesystem::path& path, const std::vector<std::string>& names,
                      const std::vector<Appearance>& appearances);

}  // namespace ewa
