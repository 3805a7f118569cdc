// SPDX-License-Identifier: Apache-2.0
#include "viewer/shown.h"

#include <cstdio>
#include <exception>

#include "scene/framing.h"
#include "scene/native_lens.h"

namespace ewa::viewer {
namespace {

std::string reason(const std::exception_ptr& failure) {
    try {
        std::rethrow_exception(failure);
    } catch (const std::exception& error) {
        return error.what();
    }
}

}  // namespace

Shown::Shown(ViewState& state, Navigation& navigation)
    : quality_(state.wake),
      renders(state.startup.open_device, state.wake),
      state_(state),
      navigation_(navigation),
      images_(state.wake) {}

void Shown::enter_scene() {
    renders.set_scene(state_.scene.gaussians, {state_.scene.coarse, nullptr});
    images_.forget_scene();
    forget_points();
    quality_.forget();
}

void Shown::take_renders() {
    const RenderThread::News news = renders.take();
    if (news.device) {
        state_.device_name = news.device->name;
        state_.on_cpu = news.device->type == "cpu";
    }
    if (news.failure) {
        if (state_.scripted() || !renders.shown()) std::rethrow_exception(news.failure);
        if (state_.message.note != reason(news.failure)) state_.say(reason(news.failure));
    }
    for (const SurfacePoint& point : news.points) take_point(point);
    for (const ExtraDone& one : news.extras) {
        const auto file = files_.extract(one.number);
        if (!file)
            extras.push_back(one);
        else
            state_.say(one.failure ? reason(one.failure)
                                   : "wrote " + std::filesystem::absolute(file.mapped()).string());
    }
}

void Shown::forget_points() {
    measurement = {};
    renders.forget_points();
}

void Shown::set_measuring(bool on) {
    if (measuring_ && !on) forget_points();
    measuring_ = on;
}

void Shown::take_point(const SurfacePoint& point) {
    state_.redraw(Loop::kRedraws);
    if (point.use == PointUse::edit || point.use == PointUse::color) {
        if (take_edit_point) take_edit_point(point);
        return;
    }
    const bool measured = point.use == PointUse::measure;
    if (!point.place) {
        state_.say("no splat is opaque enough here", true);
    } else if (measured) {
        measurement.add(*point.place);
        if (!measurement.complete()) return;
        state_.say("Distance " + measurement.label(), true);
        std::puts(measurement.text().c_str());  // to be copied
        std::fflush(stdout);
    } else {
        navigation_.view.focus(*point.place);
        navigation_.leave_camera();
    }
}

void Shown::ask_point(const glm::dvec2& pixel, PointUse use) {
    renders.ask_point(camera(), pixel, use);
}

void Shown::take_comparison(Presenter& presenter) {
    if (!images_.take()) return;
    if (images_.image()->failure.empty()) presenter.set_picture(Layer::image, images_.image()->picture);
    state_.redraw(Loop::kRedraws);
}

std::optional<Camera> Shown::requested_camera() const {
    const Size size = state_.window.framebuffer();
    if (size.width == 0 || size.height == 0) return std::nullopt;
    return camera();
}

void Shown::ask() {
    if (const auto asked = requested_camera()) renders.ask(*asked, look_for(*asked), state_.scripted());
}

void Shown::write(const Camera& camera, const std::filesystem::path& file) {
    files_[renders.ask_extra({.camera = camera, .look = look_for(camera), .file = file})] = file;
}

void Shown::write_exr() {
    if (const auto asked = requested_camera()) write(*asked, free_name("ewa-view", ".exr"));
}

Arrangement Shown::arrangement() const {
    Size image{1, 1};
    if (navigation_.at_camera) {
        const Camera& camera = navigation_.frame().camera;
        image = {camera.width, camera.height};
    }
    return arrange(comparison(), state_.picture_area(), image);
}

Camera Shown::camera(Size size) const {
    const Camera camera = navigation_.view.camera(size.width, size.height);
    const PanelSettings& settings = state_.settings;
    // Spheres are drawn through pinholes only.
    if (!settings.parallel || comparing() || settings.look.points) return camera;
    return scene::through_lens(scene::pinhole_at(camera), {.lens = Lens::orthographic}, 0,
                               navigation_.view.pivot());
}

Look Shown::look_for(const Camera& camera) const {
    Look look = state_.settings.look;
    look.plain = plain_wanted();
    if (camera.distortion.none()) return look;
    look.points = false;
    return look;
}

bool Shown::comparing() const {
    return comparison() != Comparison::none && images_.image_of(*navigation_.at_camera);
}

void Shown::change_comparison() {
    Comparison& chosen = state_.settings.comparison;
    if (state_.scene.dataset) chosen = Comparison((int(chosen) + 1) % 4);
    if (!state_.scene.dataset || (chosen != Comparison::none && !navigation_.at_camera))
        navigation_.go_to_nearest_camera();
}

std::string Shown::image_failure() const {
    return navigation_.at_camera ? images_.failure_of(*navigation_.at_camera) : std::string();
}

std::optional<double> Shown::psnr() const {
    return comparing() ? quality_.psnr(*navigation_.at_camera) : std::nullopt;
}

void Shown::load_image() {
    if (comparison() == Comparison::none) return;
    images_.load(*navigation_.at_camera, navigation_.frame(), arrangement().image.size(),
                 state_.settings.look.background);
}

bool Shown::full_colours() const {
    return renders.settled() && renders.shown()->request.look.mode == Mode::color;
}

/// The PSNR is of colours, at the size of the image.
void Shown::measure_view() {
    if (state_.scripted() || !comparing() || !full_colours()) return;
    const Frame& frame = navigation_.frame();
    const auto own = state_.scene.appearances.find(frame.name);
    quality_.measure(renders, *navigation_.at_camera, frame, state_.settings.look,
                     own == state_.scene.appearances.end()
                         ? state_.scene.of_new_views.at(frame.camera.position()).value_or(kIdentityExposure)
                         : own->second);
}

/// The full frame can be compared if it shows colours from the camera of the image.
std::optional<ComparisonRequest> Shown::comparison_wanted() const {
    if (state_.settings.comparison != Comparison::difference || !comparing() || !full_colours())
        return std::nullopt;
    const auto& shown = renders.shown();
    const Arrangement places = arrangement();
    const Size size = places.rendering.size();
    if (Size{shown->picture.width, shown->picture.height} != size) return std::nullopt;
    return ComparisonRequest{shown, images_.image_of(*navigation_.at_camera),
                             fitted(places.image.size(), {0, 0, size.width, size.height}),
                             state_.settings.gain};
}

void Shown::choose_picture(Presenter& presenter) {
    const auto& shown = renders.shown();
    if (!shown) return;
    const auto wanted = comparison_wanted();
    images_.compare(wanted);
    std::shared_ptr<const ByteImage> picture(shown, &shown->picture);
    if (wanted) {
        if (const auto compared = images_.compared())
            picture = std::shared_ptr<const ByteImage>(compared, &compared->difference);
        else if (difference_)
            return;
    }
    difference_ = picture.get() != &shown->picture;
    if (picture == picture_) return;
    picture_ = picture;
    presenter.set_picture(Layer::rendering, *picture);
}

void Shown::fill(Presenter& presenter) {
    if (const auto image = images_.image(); image && image->failure.empty())
        presenter.set_picture(Layer::image, image->picture);
    picture_.reset();
    choose_picture(presenter);
}

std::vector<Layer> Shown::layers() const {
    const Arrangement places = arrangement();
    std::vector<Layer> layers;
    if (renders.shown()) {
        // The last frame may have another size. It keeps its shape until the next one is ready.
        const Camera& camera = renders.shown()->request.camera;
        layers.push_back({Layer::rendering, fitted({camera.width, camera.height}, places.rendering)});
    }
    if (comparing() && state_.settings.comparison == Comparison::beside)
        layers.push_back({Layer::image, places.image});
    if (wiping()) {
        Rectangle part = places.image;
        part.width = int(float(part.width) * state_.settings.wipe + 0.5f);
        layers.push_back({Layer::image, part, 0, double(part.width) / places.image.width});
    }
    return layers;
}

bool Shown::complete() const {
    return renders.settled() && renders.shown()->request.look.plain == plain_wanted() &&
           (comparison() == Comparison::none || images_.loaded(*navigation_.at_camera)) &&
           (!images_.requested() || images_.compared());
}

}  // namespace ewa::viewer
