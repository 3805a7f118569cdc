// SPDX-License-Identifier: Apache-2.0
// The picture on the screen, and how it compares with the image of its camera.
#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "viewer/comparison.h"
#include "viewer/measurement.h"
#include "viewer/navigation.h"
#include "viewer/renders.h"
#include "viewer/screen.h"
#include "viewer/view_quality.h"
#include "viewer/view_state.h"

namespace ewa::viewer {

/// The picture and its comparison. Its threads call WindowSystem::wake(), so the WindowSystem must outlive it.
class Shown {
  public:
    Shown(ViewState& state, Navigation& navigation);

    void enter_scene();
    /// Takes the results of the render thread. Throws its errors if a command line writes a file, and for the first frame.
    void take_renders();
    void take_comparison(Presenter& presenter);
    /// Asks for a render of the view, unless the window is minimised.
    void ask();
    /// Requests the surface point at a pixel, to turn the view to it, to add it to `measurement`, or for `take_edit_point`.
    void ask_point(const glm::dvec2& pixel, PointUse use);
    /// Turns measuring on or off. Off: drops the points, and requests that still wait.
    void set_measuring(bool on);
    /// Writes a render to a file, without the panel and other drawings.
    void write(const Camera& camera, const std::filesystem::path& file);
    /// Writes the view as an EXR file in floating point.
    void write_exr();

    /// Loads the camera's image if the next frame of the window needs it. Call it before that frame.
    void load_image();
    /// Gives the presenter the render, or its difference to the image. Call it after the frame's input. The last
    /// difference stays until the next is ready.
    void choose_picture(Presenter& presenter);
    void measure_view();
    /// Gives the render or difference, and the camera's image, to a presenter that was created again.
    void fill(Presenter& presenter);
    std::vector<Layer> layers() const;
    /// Whether the window shows the final render, and the comparison that the settings ask for.
    bool complete() const;

    Comparison comparison() const {
        return navigation_.at_camera ? state_.settings.comparison : Comparison::none;
    }
    bool comparing() const;  // the image of the camera is shown or compared
    bool wiping() const { return comparing() && state_.settings.comparison == Comparison::wipe; }
    void change_comparison();
    Arrangement arrangement() const;
    Camera camera() const { return camera(arrangement().rendering.size()); }  // of the render's place
    Camera camera(Size size) const;
    /// The look of the settings, for a screenshot without tints. If the camera's lens has distortion, splats are not drawn as points.
    Look look_for(const Camera& camera) const;
    std::string image_failure() const;   // why the camera has no image; else empty
    std::optional<double> psnr() const;  // dB

  private:
    ViewQuality quality_;  // it ends after the renders, whose thread calls it

  public:
    Renders renders;
    /// Extra renders of others that take_renders() has brought. Who has asked for them takes them out.
    std::vector<ExtraDone> extras;
    Measurement measurement;
    std::function<void(const SurfacePoint&)> take_edit_point;  // gets the answers to PointUse::edit and color

  private:
    void take_point(const SurfacePoint& point);
    void forget_points();
    std::optional<Camera> requested_camera() const;
    std::optional<ComparisonRequest> comparison_wanted() const;
    bool plain_wanted() const { return state_.loop.capture && renders.marked(); }
    bool full_colours() const;  // the last frame shows them, as asked

    ViewState& state_;
    Navigation& navigation_;
    std::shared_ptr<const ByteImage> picture_;  // the presenter's: a render or a difference
    bool difference_ = false;
    bool measuring_ = false;
    std::map<uint64_t, std::filesystem::path> files_;  // of write(), by the numbers of their renders
    ImageComparison images_;
};

}  // namespace ewa::viewer
