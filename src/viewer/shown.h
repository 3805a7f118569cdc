// SPDX-License-Identifier: Apache-2.0
// The picture on the screen, and how it compares with the image of its camera.
#pragma once
#include <memory>
#include <optional>
#include <vector>

#include "viewer/comparison.h"
#include "viewer/measurement.h"
#include "viewer/navigation.h"
#include "viewer/renders.h"
#include "viewer/screen.h"
#include "viewer/view_quality.h"
#include "viewer/view_state.h"

namespace ewa::viewer {

/// Its threads call wake() of the window system. It must end before that does.
class Shown {
  public:
    Shown(ViewState& state, Navigation& navigation);

    void enter_scene();
    /// Takes the results of the threads. Throws their errors in a script, and for the first frame.
    void take_renders();
    void take_comparison(Presenter& presenter);
    /// Asks for a render of the view, unless the window is minimised, or a film sets the cameras.
    void ask();
    /// Looks at the point, or makes it one of `measurement`.
    void ask_point(const glm::dvec2& pixel, PointUse use);
    /// Turns measuring on or off. Off: drops the points, and requests that still wait.
    void set_measuring(bool on);
    /// Writes the render alone, in floating point.
    void write_exr();

    /// Before a frame of the window: loads the image that it needs.
    void load_image();
    /// After its input: gives the presenter the render or its difference to the image. The last difference stays until
    /// the next is ready.
    void choose_picture(Presenter& presenter);
    void measure_view();
    /// Gives a new presenter the pictures.
    void fill(Presenter& presenter);
    std::vector<Layer> layers() const;
    /// Whether all that the settings ask for is shown.
    bool complete() const;

    Comparison comparison() const {
        return navigation_.at_camera ? state_.settings.comparison : Comparison::none;
    }
    bool comparing() const;  // the image of the camera is shown or compared
    bool wiping() const { return comparing() && state_.settings.comparison == Comparison::wipe; }
    void change_comparison();
    Arrangement arrangement() const;
    Camera camera() const;  // of the size of the render's place
    /// The look of the settings. For other cameras than pinholes, without modes that need a pinhole.
    Look look_for(const Camera& camera) const;
    std::string image_failure() const;    // why the camera has no image; else empty
    const std::optional<double>& psnr();  // for the panel, dB

    Renders renders;
    Measurement measurement;

  private:
    void take_point(const SurfacePoint& point);
    void forget_points();
    std::optional<Camera> requested_camera() const;
    std::optional<ComparisonRequest> comparison_wanted() const;
    bool full_colours() const;  // the last frame shows them, as asked

    ViewState& state_;
    Navigation& navigation_;
    std::shared_ptr<const ByteImage> picture_;  // the presenter's: a render or a difference
    bool difference_ = false;
    bool measuring_ = false;
    std::optional<double> psnr_;  // in the panel
    ImageComparison images_;
    ViewQuality quality_;
};

}  // namespace ewa::viewer
