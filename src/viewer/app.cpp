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

/// The size of the window if none is asked for: that of the camera, scaled down to fit the desktop and up to
/// the size that the panel needs. A screenshot keeps the camera's size, which is the size of its file.
Size window_size(const Startup& startup, const WindowSystem& system) {
    if (startup.size) return *startup.size;
    const Size size = camera_size_or_usual(startup);
    if (startup.picture) return size;
    const Size desktop = system.work_area();
    if (desktop.width <= 0 || desktop.height <= 0) return size;
    const double grow = std::max(
        1.0, std::min(double(kUsualSize.width) / size.width, double(kUsualSize.height) / size.height));
    const double scale =
        std::min({grow, double(desktop.width) / size.width, double(desktop.height) / size.height});
    return {std::max(1, int(std::lround(size.width * scale))),
            std::max(1, int(std::lround(size.height * scale)))};
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
bool ready(const std::future<Result>& future) {
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
    return framing_view(*scene.gaussians, size.width, size.height);
}

std::filesystem::path free_name(const std::string& stem, const std::string& extension) {
    for (int i = 1;; ++i) {
        const std::filesystem::path path = stem + "-" + std::to_string(i) + extension;
        if (!std::filesystem::exists(path)) return path;
    }
}

bool Message::expire(Clock::time_point now) {
    bool expired = false;
    for (Clock::time_point* until : {&hint_until, &note_until}) {
        if (*until == Clock::time_point{} || now < *until) continue;
        *until = {};
        expired = true;
    }
    return expired;
}

App::App(const Startup& startup)
    : startup_(startup),
      window_(system_, startup.scene.title + " - ewa", window_size(startup, system_), !startup.picture),
      screen_(std::make_unique<Screen>(system_, window_, startup.device_name)),
      view_(start_view(startup.scene, startup.frame, startup.size.value_or(kUsualSize))),
      settings_(startup.settings),
      views_(startup.views),
      times_(startup.times),
      device_name_(startup.device_name),
      capture_(startup.picture.has_value()),
      comparison_([this] { system_.wake(); }),
      renders_(startup.open_device, [this] { system_.wake(); }),
      live_(startup.trainer, [this] { system_.wake(); }) {
    last_frame_ = Clock::now();
    message_.hint_until = in(kHintSeconds);
    adopt(startup.scene, startup.frame);
    settings_.look = startup.settings.look;
    if (startup.film) start_film();
    if (startup.watch) live_.watch(*startup.watch);
    times_.window_open = times_.now();
}

void App::adopt(OpenedScene scene, std::optional<int> frame) {
    scene_ = std::move(scene);
    scene_.set_gaussians(scene_.gaussians);
    renders_.set_scene(scene_.gaussians);
    settings_.look.kernel = scene_.look.kernel;
    settings_.look.background = scene_.look.background;
    settings_.look.sh_degree = scene_.sh_degree;
    message_.note.clear();
    if (!scene_.remark.empty()) say(scene_.remark);
    framed_ = scene_.gaussians->size() > 0;
    comparison_.forget_scene();
    leave_camera();
    start_frame_.reset();
    if (scene_.dataset) {
        camera_size_ = camera_size(*scene_.dataset, view_.radius());
        start_frame_ = at_camera_ = frame.value_or(0);
    }
    redraw(kRedraws);
}

void App::open(const std::filesystem::path& path) {
    if (opening_.valid()) return say("another file is being opened");
    say("opening " + path.string());
    opening_ = std::async(std::launch::async, [this, path] {
        const Wake wake{system_};
        return open_scene(path, {});
    });
}

void App::take_opened() {
    if (!ready(opening_)) return;
    try {
        OpenedScene scene = opening_.get();
        view_.restart(start_view(scene, {}, window_.framebuffer()));
        window_.set_title(scene.title + " - ewa");
        adopt(std::move(scene), {});
        live_.stop();
        if (!scene_.run.empty()) live_.watch({scene_.run, {}, {}, scene_.splats_time});
    } catch (const std::exception& error) {
        say(error.what());
    }
}

/// New splats of the run replace those that are shown.
void App::take_live() {
    if (const auto status = live_.failure(); status && message_.note.empty())
        say("the training ended with status " + std::to_string(*status) +
            "; see the terminal for the reason");
    // A screenshot waits for its full frame, which new splats would start again.
    if (capture_ && framed_) return;
    const LiveRun::News news = live_.take();
    if (news.any) redraw();
    if (!news.splats) return;
    const int degree_before = scene_.sh_degree;
    scene_.set_gaussians(news.splats);
    renders_.set_scene(news.splats);
    if (settings_.look.sh_degree == degree_before) settings_.look.sh_degree = scene_.sh_degree;
    // The first splats tell what to look at, unless the user has moved the camera.
    if (!framed_ && (!scene_.dataset || at_camera_ == start_frame_))
        view_.restart(start_view(scene_, start_frame_, window_.framebuffer()));
    framed_ = true;
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
            if (const auto dropped = window_.take_dropped(); !dropped.empty()) open(dropped);
        }
        take_opened();
        take_renders();
        take_comparison();
        if (ready(saving_)) say(saving_.get());
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
    if (news.frame) redraw(2);  // a panel that has more to show takes its new size one frame later
}

void App::take_comparison() {
    const ImageComparison::News news = comparison_.take();
    if (news == ImageComparison::News::none) return;
    if (news == ImageComparison::News::comparison) return redraw(2);
    if (comparison_.image()->failure.empty())
        screen_->presenter.set_picture(Layer::image, comparison_.image()->picture);
    redraw(kRedraws);
}

}  // namespace ewa::viewer
