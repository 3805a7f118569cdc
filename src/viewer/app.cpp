// SPDX-License-Identifier: Apache-2.0
#include "viewer/app.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>
#include <cmath>

#include "ewa/error.h"

namespace ewa::viewer {
namespace {

constexpr double kHintSeconds = 15, kNoteSeconds = 10;
constexpr double kPollSeconds = 0.05;  // while a better frame, a file or a screenshot is on its way

/// The size of the new window. A screenshot keeps the camera's size, which is the size of its file.
Size initial_size(const Startup& startup, const WindowSystem& system) {
    if (startup.size) return *startup.size;
    const Size picture = camera_size_or_usual(startup);
    if (startup.picture || startup.film) return picture;
    const Size desktop = system.work_area();
    const double scale = double(system.scale());
    if (startup.last_size) {
        const auto side = [&](int last, int most) {
            const int length = std::max(1, int(std::lround(last * scale)));
            return most > 0 ? std::min(length, most) : length;
        };
        return {side(startup.last_size->width, desktop.width),
                side(startup.last_size->height, desktop.height)};
    }
    const bool beside = startup.settings.comparison == Comparison::beside;
    const double text = kTextHeight * scale * double(startup.settings.text_scale);
    return window_size({(beside ? 2 : 1) * picture.width, picture.height}, int(kPanelWidth * text), desktop,
                       scale);
}

std::chrono::steady_clock::time_point in(double seconds) {
    using Clock = std::chrono::steady_clock;
    return Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

std::string reason(const std::exception_ptr& failure) {
    try {
        std::rethrow_exception(failure);
    } catch (const std::exception& error) {
        return error.what();
    }
}

}  // namespace

Size camera_size_or_usual(const Startup& startup) {
    if (!startup.scene.dataset) return kUsualSize;
    const Camera& camera = startup.scene.dataset->frames[size_t(startup.frame.value_or(0))].camera;
    return {camera.width, camera.height};
}

Viewpoint start_view(const OpenedScene& scene, std::optional<int> frame, Size size) {
    if (scene.dataset) return dataset_view(*scene.gaussians, *scene.dataset, frame.value_or(0));
    return framing_view(*scene.gaussians, nullptr, size.width, size.height);
}

std::string window_title(const OpenedScene& scene) {
    return scene.title.empty() ? "ewa" : scene.title + " - ewa";
}

std::filesystem::path free_name(const std::string& stem, const std::string& extension) {
    for (int i = 1;; ++i) {
        const std::filesystem::path path = stem + "-" + std::to_string(i) + extension;
        if (!std::filesystem::exists(path)) return path;
    }
}

App::App(const Startup& startup)
    : startup_(startup),
      window_(system_, window_title(startup.scene), initial_size(startup, system_), !startup.picture),
      settings_(startup.settings),
      device_name_(startup.device_name),
      loop_{.capture = startup.picture.has_value(), .times = startup.times},
      navigation_{
          .view = ViewCamera(start_view(startup.scene, startup.frame, startup.size.value_or(kUsualSize))),
          .views = startup.views},
      shown_([this] { system_.wake(); }),
      renders_(startup.open_device, [this] { system_.wake(); }),
      session_([this] { system_.wake(); }) {
    change_text();
    loop_.last_frame = Clock::now();
    message_.hint_until = in(kHintSeconds);
    // A screenshot is framed as `ewa render` does.
    if (!scripted())
        navigation_.view.restart(start_view(startup.scene, startup.frame, picture_area().size()));
    adopt(startup.scene, startup.frame);
    settings_.look = startup.settings.look;
    if (startup.film) start_film();
    if (startup.watch) watch(*startup.watch, startup.trainer);
    if (!startup.scene.photos.empty()) find_cameras(startup.scene.photos);
    loop_.times.window_open = loop_.times.now();
}

KeptSettings App::kept() const {
    KeptSettings kept{.window = {},
                      .text_scale = settings_.text_scale,
                      .gain = settings_.gain,
                      .film_seconds = settings_.film_seconds};
    const double scale = double(window_.scale()) / double(window_.density());
    const Size size = window_.size();
    if (size.width > 0 && size.height > 0)
        kept.window = Size{int(std::lround(size.width / scale)), int(std::lround(size.height / scale))};
    return kept;
}

void App::run() {
    while (!loop_.done && !window_.closed()) {
        const auto keys = window_.wait(patience());
        const auto now = Clock::now();
        const double seconds = std::chrono::duration<double>(now - loop_.last_frame).count();
        loop_.last_frame = now;
        if (window_.stirred()) loop_.redraws = Loop::kRedraws;
        if (message_.expire(now)) redraw();
        if (!scripted()) {
            for (const KeyPress& key : keys) handle_key(key);
            move_by_itself(std::min(seconds, 0.1));
            if (const auto dropped = window_.take_dropped(); !dropped.empty()) open(dropped, scene_);
            take_chosen();
            change_text();
        }
        take_opened();
        take_found();
        take_renders();
        take_comparison();
        if (Session::finished(session_.saving)) say(session_.saving.get());
        take_live();
        if (navigation_.film) continue_film();
        if (loop_.redraws > 0) draw();
        if (const auto camera = requested_camera()) renders_.ask(*camera, settings_.look, scripted());
    }
    if (startup_.verbose) loop_.times.print(renders_.shown().get());
    if (scripted() && !loop_.done)
        throw RunError("the window was closed before " +
                       startup_.picture.value_or(startup_.film.value_or("")).string() + " was written");
}

/// How long to wait for input, in seconds.
double App::patience() const {
    if (loop_.redraws > 0 || flying() || settings_.turntable) return 1.0 / 60;
    return renders_.reduced() || session_.opening.valid() || session_.saving.valid() ? kPollSeconds : 1.0;
}

void App::say(const std::string& note) {
    message_.note = note;
    message_.note_until = in(kNoteSeconds);
    redraw(Loop::kRedraws);
}

/// Empty while the window is minimised, and while a film has cameras of its own.
std::optional<Camera> App::requested_camera() const {
    const Size size = window_.framebuffer();
    if (size.width == 0 || size.height == 0 || navigation_.film) return std::nullopt;
    const Rectangle place = arrangement().rendering;
    return navigation_.view.camera(place.width, place.height);
}

void App::take_renders() {
    const Renders::News news = renders_.take();
    if (news.device) device_name_ = *news.device;
    if (news.failure) {
        if (scripted() || !renders_.shown()) std::rethrow_exception(news.failure);
        navigation_.film.reset();
        if (message_.note != reason(news.failure)) say(reason(news.failure));
    }
    if (news.point_answered) {
        if (news.point) {
            navigation_.view.focus(*news.point);
            navigation_.leave_camera();
        } else {
            say("no splat is opaque enough here to look at");
        }
        redraw(Loop::kRedraws);
    }
    for (const auto& file : news.written)
        if (!navigation_.film) say("wrote " + std::filesystem::absolute(file).string());
    shown_.quality.take(news.full);
    if (news.frame) redraw();
}

void App::take_comparison() {
    if (navigation_.at_camera && shown_.quality.psnr(*navigation_.at_camera) != shown_.psnr) redraw();
    const ImageComparison::News news = shown_.comparison.take();
    if (news == ImageComparison::News::none) return;
    if (news == ImageComparison::News::comparison) return redraw();
    if (shown_.comparison.image()->failure.empty())
        screen_->presenter.set_picture(Layer::image, shown_.comparison.image()->picture);
    redraw(Loop::kRedraws);
}

}  // namespace ewa::viewer
