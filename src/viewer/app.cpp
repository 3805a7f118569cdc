// SPDX-License-Identifier: Apache-2.0
#include "viewer/app.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "ewa/error.h"
#include "viewer/framing.h"

namespace ewa::viewer {
namespace {

constexpr double kRestSeconds = 0.2;  // without a change, until the full picture is asked for
constexpr double kHintSeconds = 15, kNoteSeconds = 10;
constexpr int kFirstDivisor = 2;  // something to see at once, then all of it
constexpr Size kUsualSize{1280, 800};

/// The window's size where none is asked for: the camera's, made smaller in proportion where the desktop has
/// less room. With a picture to write the camera's size is kept, since that is the picture's. A window to
/// look at is not smaller than the panel needs.
Size window_size(const Startup& startup, const WindowSystem& system) {
    if (startup.size) return *startup.size;
    Size size = kUsualSize;
    if (startup.scene.dataset) {
        const Camera& camera = startup.scene.dataset->frames[size_t(startup.frame.value_or(0))].camera;
        size = {camera.width, camera.height};
    }
    if (startup.picture) return size;
    const Size room = system.room();
    if (room.width <= 0 || room.height <= 0) return size;
    const double grow = std::max(
        1.0, std::min(double(kUsualSize.width) / size.width, double(kUsualSize.height) / size.height));
    const double scale = std::min({grow, double(room.width) / size.width, double(room.height) / size.height});
    return {std::max(1, int(std::lround(size.width * scale))),
            std::max(1, int(std::lround(size.height * scale)))};
}

Viewpoint start_view(const Scene& scene, std::optional<int> frame, Size size) {
    if (scene.dataset) return dataset_view(*scene.gaussians, *scene.dataset, frame.value_or(0));
    return framing_view(*scene.gaussians, size.width, size.height);
}

bool same_place(const Camera& a, const Camera& b) {
    return a.rotation == b.rotation && a.translation == b.translation;
}

bool same_view(const PictureRequest& a, const PictureRequest& b) {
    const Camera &p = a.camera, &q = b.camera;
    return a.look == b.look && p.width == q.width && p.height == q.height && p.fx == q.fx && p.fy == q.fy &&
           p.cx == q.cx && p.cy == q.cy && same_place(p, q);
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

std::filesystem::path free_name(const std::string& stem, const std::string& extension) {
    for (int i = 1;; ++i) {
        const std::filesystem::path path = stem + "-" + std::to_string(i) + extension;
        if (!std::filesystem::exists(path)) return path;
    }
}

App::App(const Startup& startup)
    : startup_(startup),
      window_(system_, startup.scene.title + " - ewa", window_size(startup, system_), !startup.picture),
      screen_(std::make_unique<Screen>(system_, window_, startup.device_name)),
      view_(start_view(startup.scene, startup.frame, startup.size.value_or(kUsualSize))),
      settings_(startup.settings),
      views_(startup.views),
      device_name_(startup.device_name),
      capture_(startup.picture.has_value()),
      redraws_(kRedraws),
      photos_(load_photo, [this] { system_.wake(); }),
      comparisons_(compare_with_photo, [this] { system_.wake(); }),
      thread_(startup.open_device, [this] { system_.wake(); }) {
    last_frame_ = Clock::now();
    hint_until_ = in(kHintSeconds);
    adopt(startup.scene, startup.frame);
    settings_.look = startup.settings.look;
    if (startup.film) start_film();
    if (startup.watch) watch(*startup.watch);
    window_after_ = std::chrono::duration<double>(Clock::now() - startup.started).count();
}

void App::watch(const live::WhatToWatch& what) {
    watcher_.reset();  // the old one first: it may say nothing any more
    run_ = {};
    watcher_ = std::make_unique<live::Watcher>(what, [this] { system_.wake(); });
}

/// News of the run. Its splats take the place of those that are shown.
void App::take_live() {
    if (startup_.trainer && run_.status.state != live::State::done) {
        if (const auto status = startup_.trainer->status(); status && *status != 0 && note_.empty())
            say("the training has ended with status " + std::to_string(*status) +
                "; the terminal has its reason");
    }
    if (!watcher_ || watcher_->number() == run_.number) return;
    const auto before = run_.splats;
    run_ = watcher_->update();
    redraws_ = std::max(redraws_, 1);
    if (run_.splats == before || !run_.splats || run_.splats->size() == 0) return;
    scene_.gaussians = run_.splats;
    scene_number_ = thread_.set_scene(scene_.gaussians);
    const int degree = sh_degree_present(*scene_.gaussians);
    if (settings_.look.sh_degree == scene_sh_degree_) settings_.look.sh_degree = degree;
    scene_sh_degree_ = degree;
    plan_ = plan_lines(*scene_.gaussians, RenderOptions{});
    // With the first splats it is known what there is to turn about; a camera that the user has chosen stays.
    if (!viewed_ && (!scene_.dataset || stands_at_ == start_frame_))
        view_.restart(start_view(scene_, start_frame_, window_.framebuffer()));
    viewed_ = true;
}

void App::adopt(Scene scene, std::optional<int> frame) {
    scene_ = std::move(scene);
    scene_number_ = thread_.set_scene(scene_.gaussians);
    scene_sh_degree_ = sh_degree_present(*scene_.gaussians);
    plan_ = plan_lines(*scene_.gaussians, RenderOptions{});
    settings_.look.kernel = scene_.look.kernel;
    settings_.look.background = scene_.look.background;
    settings_.look.sh_degree = scene_sh_degree_;
    note_.clear();
    if (!scene_.remark.empty()) say(scene_.remark);
    viewed_ = scene_.gaussians->size() > 0;
    ++opened_;
    photo_.reset();  // frames are numbers, and those of another dataset are other pictures
    photo_asked_.reset();
    stands_at_.reset();
    start_frame_.reset();
    if (scene_.dataset) {
        camera_size_ = camera_size(*scene_.dataset, view_.radius());
        start_frame_ = stands_at_ = frame.value_or(0);
    }
    redraws_ = kRedraws;
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
    if (!opening_.valid() || opening_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
    try {
        Scene scene = opening_.get();
        view_.restart(start_view(scene, {}, window_.framebuffer()));
        window_.set_title(scene.title + " - ewa");
        adopt(std::move(scene), {});
        watcher_.reset();
        if (!scene_.run.empty()) watch({scene_.run, {}, {}, scene_.splats_time});
    } catch (const std::exception& error) {
        say(error.what());
    }
}

void App::run() {
    while (!done_ && !window_.closed()) {
        const auto keys = window_.wait(patience());
        const auto now = Clock::now();
        const double seconds = std::chrono::duration<double>(now - last_frame_).count();
        last_frame_ = now;
        if (window_.stirred()) redraws_ = kRedraws;
        for (Clock::time_point* until : {&hint_until_, &note_until_}) {
            if (*until == Clock::time_point{} || now < *until) continue;
            *until = {};
            redraws_ = std::max(redraws_, 1);
        }
        if (!scripted()) {
            for (const KeyPress& key : keys) handle_key(key);
            move_by_itself(std::min(seconds, 0.1));
            if (const auto dropped = window_.take_dropped(); !dropped.empty()) open(dropped);
        }
        take_opened();
        take_news();
        take_live();
        if (film_) film();
        if (redraws_ > 0) draw();
        ask();
    }
    if (startup_.verbose) tell_times();
    if (scripted() && !done_)
        throw RunError("the window was closed before " +
                       startup_.picture.value_or(startup_.film.value_or("")).string() + " was written");
}

/// How long to wait for input, in seconds.
double App::patience() const {
    if (redraws_ > 0 || flying() || settings_.turntable) return 1.0 / 60;
    return asked_.divisor > 1 || opening_.valid() || saving_.valid() ? kRestSeconds / 4 : 1.0;
}

void App::say(const std::string& note) {
    note_ = note;
    note_until_ = in(kNoteSeconds);
    redraws_ = std::max(redraws_, kRedraws);
}

PictureRequest App::wanted() const {
    const Rectangle place = arrangement().rendering;
    return {view_.camera(place.width, place.height), settings_.look, 1, asked_.serial + 1, {}};
}

void App::ask() {
    const Size size = window_.framebuffer();
    if (size.width == 0 || size.height == 0 || film_) return;
    PictureRequest request = wanted();
    const auto now = Clock::now();
    const bool first = asked_.serial == 0, other_scene = asked_scene_ != scene_number_;
    if (first || other_scene || !same_view(request, asked_)) {
        changed_ = now;
        request.divisor = scripted() ? 1 : first ? kFirstDivisor : pace_.divisor();
    } else if (asked_.divisor == 1 || now - changed_ < std::chrono::duration<double>(kRestSeconds)) {
        return;
    }
    // A full picture in the making is not what a moving camera should wait behind; it is not asked for anew
    // either.
    asked_ = request;
    asked_scene_ = scene_number_;
    thread_.ask(asked_);
}

void App::take_news() {
    const RenderThread::News news = thread_.take_news();
    if (news.device) device_name_ = *news.device;
    if (news.failure) {
        if (scripted() || !shown_) std::rethrow_exception(news.failure);
        film_.reset();
        if (note_ != reason(news.failure)) say(reason(news.failure));
    }
    if (news.points > points_) {
        points_ = news.points;
        if (news.point) {
            view_.focus(*news.point);
            leave_camera();
        } else {
            say("there is nothing to look at");
        }
        redraws_ = kRedraws;
    }
    for (const auto& file : news.written)
        if (!film_) say("wrote " + std::filesystem::absolute(file).string());
    if (const auto photo = photos_.result(); photo != photo_ && photo && photo->scene == opened_) {
        photo_ = photo;
        if (photo_->failure.empty()) screen_->presenter.set_picture(Layer::photograph, photo_->picture);
        redraws_ = kRedraws;
    }
    if (const auto compared = comparisons_.result(); compared != compared_) {
        compared_ = compared;
        redraws_ = std::max(redraws_, 2);
    }
    if (saving_.valid() && saving_.wait_for(std::chrono::seconds(0)) == std::future_status::ready)
        say(saving_.get());
    if (news.picture == shown_) return;
    shown_ = news.picture;
    pace_.drawn(shown_->request.divisor, shown_->milliseconds);
    redraws_ = std::max(redraws_, 2);  // a panel that has more to say takes its new size a frame later
}

/// Of what is on the screen since the last picture was.
void App::count_picture() {
    if (!shown_ || shown_ == counted_) return;
    const std::chrono::duration<double> now = Clock::now() - startup_.started;
    if (!first_picture_) first_picture_ = now.count();
    const bool moved = counted_ && !same_place(shown_->request.camera, counted_->request.camera);
    fluency_.shown(now.count(), moved, shown_->request.divisor);
    counted_ = shown_;
}

void App::tell_times() const {
    if (first_picture_)
        std::fprintf(stderr, "first picture after %.0f ms: scene read %.0f, device open %.0f, window %.0f\n",
                     1000 * *first_picture_, 1000 * startup_.read_after, 1000 * startup_.device_after,
                     1000 * window_after_);
    if (shown_)
        std::fprintf(stderr, "last picture: %d x %d px in %.1f ms\n", shown_->picture.width,
                     shown_->picture.height, shown_->milliseconds);
    if (fluency_.count() == 0) return;
    std::fprintf(stderr, "moving: %llu pictures in %.1f s, %.1f a second;",
                 static_cast<unsigned long long>(fluency_.count()), fluency_.seconds(),
                 double(fluency_.count()) / fluency_.seconds());
    for (const auto& [divisor, count] : fluency_.by_divisor())
        std::fprintf(stderr, " %llu at 1/%d", static_cast<unsigned long long>(count), divisor);
    std::fprintf(stderr, "\n");
}

bool App::settled() const {
    return shown_ && shown_->request.serial == asked_.serial && shown_->request.divisor == 1 &&
           shown_->scene == scene_number_ && points_ == points_asked_;
}

}  // namespace ewa::viewer
