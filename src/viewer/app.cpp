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

template <class Result>
bool finished(const std::future<Result>& future) {
    return future.valid() && future.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
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
      view_(start_view(startup.scene, startup.frame, startup.size.value_or(kUsualSize))),
      settings_(startup.settings),
      views_(startup.views),
      times_(startup.times),
      device_name_(startup.device_name),
      capture_(startup.picture.has_value()),
      search_([this] { system_.wake(); }),
      dialog_([this] { system_.wake(); }),
      comparison_([this] { system_.wake(); }),
      quality_([this] { system_.wake(); }),
      renders_(startup.open_device, [this] { system_.wake(); }),
      live_([this] { system_.wake(); }) {
    change_text();
    last_frame_ = Clock::now();
    message_.hint_until = in(kHintSeconds);
    // A screenshot is framed as `ewa render` does.
    if (!scripted()) view_.restart(start_view(startup.scene, startup.frame, picture_area().size()));
    adopt(startup.scene, startup.frame);
    settings_.look = startup.settings.look;
    if (startup.film) start_film();
    if (startup.watch) watch(*startup.watch, startup.trainer);
    if (!startup.scene.photos.empty()) find_cameras(startup.scene.photos);
    times_.window_open = times_.now();
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
    while (!done_ && !window_.closed()) {
        const auto keys = window_.wait(patience());
        const auto now = Clock::now();
        const double seconds = std::chrono::duration<double>(now - last_frame_).count();
        last_frame_ = now;
        if (window_.stirred()) redraws_ = kRedraws;
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
        if (finished(saving_)) say(saving_.get());
        take_live();
        if (film_) continue_film();
        if (redraws_ > 0) draw();
        if (const auto camera = requested_camera()) renders_.ask(*camera, settings_.look, scripted());
    }
    if (startup_.verbose) times_.print(renders_.shown().get());
    if (scripted() && !done_)
        throw RunError("the window was closed before " +
                       startup_.picture.value_or(startup_.film.value_or("")).string() + " was written");
}

/// How long to wait for input, in seconds.
double App::patience() const {
    if (redraws_ > 0 || flying() || settings_.turntable) return 1.0 / 60;
    return renders_.reduced() || opening_.valid() || saving_.valid() ? kPollSeconds : 1.0;
}

void App::say(const std::string& note) {
    message_.note = note;
    message_.note_until = in(kNoteSeconds);
    redraw(kRedraws);
}

/// Empty while the window is minimised, and while a film has cameras of its own.
std::optional<Camera> App::requested_camera() const {
    const Size size = window_.framebuffer();
    if (size.width == 0 || size.height == 0 || film_) return std::nullopt;
    const Rectangle place = arrangement().rendering;
    return view_.camera(place.width, place.height);
}

void App::take_renders() {
    const Renders::News news = renders_.take();
    if (news.device) device_name_ = *news.device;
    if (news.failure) {
        if (scripted() || !renders_.shown()) std::rethrow_exception(news.failure);
        film_.reset();
        if (message_.note != reason(news.failure)) say(reason(news.failure));
    }
    if (news.point_answered) {
        if (news.point) {
            view_.focus(*news.point);
            leave_camera();
        } else {
            say("no splat is opaque enough here to look at");
        }
        redraw(kRedraws);
    }
    for (const auto& file : news.written)
        if (!film_) say("wrote " + std::filesystem::absolute(file).string());
    quality_.take(news.full);
    if (news.frame) redraw();
}

void App::take_comparison() {
    if (at_camera_ && quality_.psnr(*at_camera_) != shown_psnr_) redraw();
    const ImageComparison::News news = comparison_.take();
    if (news == ImageComparison::News::none) return;
    if (news == ImageComparison::News::comparison) return redraw();
    if (comparison_.image()->failure.empty())
        screen_->presenter.set_picture(Layer::image, comparison_.image()->picture);
    redraw(kRedraws);
}

}  // namespace ewa::viewer
