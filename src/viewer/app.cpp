// SPDX-License-Identifier: Apache-2.0
#include "viewer/app.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>

#include "ewa/error.h"
#include "viewer/framing.h"

namespace ewa::viewer {
namespace {

constexpr double kRestSeconds = 0.2;  // without a change, until the full picture is asked for
constexpr double kRadiansPerPixel = 0.005;
constexpr double kFlySpeed = 0.8;  // distances to the pivot, a second
constexpr int kRedraws = 3;
constexpr Size kUsualSize{1280, 800};

/// The window's size where none is asked for: the camera's, made smaller in proportion where the desktop has
/// less room. With a picture to write the camera's size is kept, since that is the picture's.
Size window_size(const Opened& opened, const WindowSystem& system) {
    if (opened.size) return *opened.size;
    Size size = kUsualSize;
    if (opened.dataset) {
        const Camera& camera = opened.dataset->frames[size_t(opened.frame)].camera;
        size = {camera.width, camera.height};
    }
    const Size room = system.room();
    if (opened.picture || room.width <= 0 || room.height <= 0) return size;
    const double scale = std::min({1.0, double(room.width) / size.width, double(room.height) / size.height});
    return {std::max(1, int(size.width * scale)), std::max(1, int(size.height * scale))};
}

Viewpoint start_view(const Opened& opened, int frame) {
    if (opened.dataset) return dataset_view(opened.gaussians, *opened.dataset, frame);
    const Size size = opened.size.value_or(kUsualSize);
    return framing_view(opened.gaussians, size.width, size.height);
}

bool same_view(const PictureRequest& a, const PictureRequest& b) {
    const Camera &p = a.camera, &q = b.camera;
    return a.look == b.look && p.width == q.width && p.height == q.height && p.fx == q.fx && p.fy == q.fy &&
           p.cx == q.cx && p.cy == q.cy && p.rotation == q.rotation && p.translation == q.translation;
}

/// The first of ewa-view-1.png, ewa-view-2.png … that is not there yet.
std::filesystem::path free_name() {
    for (int i = 1;; ++i) {
        const std::filesystem::path path = "ewa-view-" + std::to_string(i) + ".png";
        if (!std::filesystem::exists(path)) return path;
    }
}

std::string reason(const std::exception_ptr& failure) {
    try {
        std::rethrow_exception(failure);
    } catch (const std::exception& error) {
        return error.what();
    }
}

}  // namespace

App::App(const Opened& opened)
    : opened_(opened),
      window_(system_, opened.file.filename().string() + " - ewa", window_size(opened, system_),
              !opened.picture),
      present_device_(system_, window_, device_info(*opened.device).name),
      presenter_(present_device_),
      gui_(window_, present_device_, presenter_),
      view_(start_view(opened, opened.frame)),
      scene_sh_degree_(sh_degree_present(opened.gaussians)),
      frame_(opened.frame),
      capture_(opened.picture.has_value()),
      redraws_(kRedraws),
      thread_(opened.device, opened.gaussians, [this] { system_.wake(); }) {
    look_.sh_degree = scene_sh_degree_;
    last_frame_ = Clock::now();
}

void App::run() {
    while (!done_ && !window_.closed()) {
        const auto keys = window_.wait(patience());
        const auto now = Clock::now();
        const double seconds = std::chrono::duration<double>(now - last_frame_).count();
        last_frame_ = now;
        if (window_.stirred()) redraws_ = kRedraws;
        for (const int key : keys) handle_key(key);
        fly(std::min(seconds, 0.1));
        take_news();
        if (redraws_ > 0) draw();
        ask();
    }
    if (opened_.picture && !done_)
        throw RunError("the window was closed before " + opened_.picture->string() + " was written");
}

/// How long to wait for input, in seconds.
double App::patience() const {
    if (redraws_ > 0 || flying()) return 1.0 / 60;
    return asked_.divisor > 1 ? kRestSeconds / 4 : 1.0;
}

void App::handle_key(int key) {
    if (ImGui::GetIO().WantTextInput) return;
    switch (key) {
        case GLFW_KEY_R:
            view_.reset();
            break;
        case GLFW_KEY_1:
        case GLFW_KEY_2:
        case GLFW_KEY_3:
            look_.mode = Mode(key - GLFW_KEY_1);
            break;
        case GLFW_KEY_F1:
            show_help_ = !show_help_;
            break;
        case GLFW_KEY_F2:
            show_panel_ = !show_panel_;
            break;
        case GLFW_KEY_F12:
            capture_ = true;
            break;
        default:
            break;
    }
}

bool App::flying() const {
    if (ImGui::GetIO().WantTextInput) return false;
    const auto keys = {GLFW_KEY_W, GLFW_KEY_A, GLFW_KEY_S, GLFW_KEY_D, GLFW_KEY_Q, GLFW_KEY_E};
    return std::any_of(keys.begin(), keys.end(), [&](int key) { return window_.held(key); });
}

void App::fly(double seconds) {
    if (!flying()) return;
    const auto either = [&](int minus, int plus) {
        return double(window_.held(plus)) - double(window_.held(minus));
    };
    const bool fast = window_.held(GLFW_KEY_LEFT_SHIFT) || window_.held(GLFW_KEY_RIGHT_SHIFT);
    const glm::dvec3 way(either(GLFW_KEY_A, GLFW_KEY_D), either(GLFW_KEY_E, GLFW_KEY_Q),
                         either(GLFW_KEY_S, GLFW_KEY_W));
    view_.fly(way * (seconds * kFlySpeed * (fast ? 4 : 1)));
}

void App::handle_mouse() {
    const ImGuiIO& io = ImGui::GetIO();
    if (io.WantCaptureMouse) return;
    const double right = io.MouseDelta.x, down = io.MouseDelta.y;
    const Size size = window_.framebuffer();
    if (right != 0 || down != 0) {
        if (ImGui::IsMouseDown(ImGuiMouseButton_Left) && io.KeyCtrl)
            view_.look(right * kRadiansPerPixel, down * kRadiansPerPixel);
        else if (ImGui::IsMouseDown(ImGuiMouseButton_Left))
            view_.orbit(right * kRadiansPerPixel, down * kRadiansPerPixel);
        else if (ImGui::IsMouseDown(ImGuiMouseButton_Right) || ImGui::IsMouseDown(ImGuiMouseButton_Middle))
            view_.pan(right * io.DisplayFramebufferScale.x, down * io.DisplayFramebufferScale.y, size.width,
                      size.height);
    }
    if (io.MouseWheel != 0) view_.zoom(io.MouseWheel);
}

void App::ask() {
    const Size size = window_.framebuffer();
    if (size.width == 0 || size.height == 0) return;
    PictureRequest wanted{view_.camera(size.width, size.height), look_, 1, asked_.serial + 1};
    const auto now = Clock::now();
    const bool first = asked_.serial == 0;
    if (first || !same_view(wanted, asked_)) {
        changed_ = now;
        wanted.divisor = first || opened_.picture ? 1 : pace_.divisor();
    } else if (asked_.divisor == 1 || now - changed_ < std::chrono::duration<double>(kRestSeconds)) {
        return;
    }
    asked_ = wanted;
    thread_.ask(asked_);
}

void App::take_news() {
    const RenderThread::News news = thread_.news();
    if (news.failure) {
        if (opened_.picture || !shown_) std::rethrow_exception(news.failure);
        if (note_ != reason(news.failure)) {
            note_ = reason(news.failure);
            redraws_ = std::max(redraws_, 1);
        }
    }
    if (news.picture == shown_) return;
    shown_ = news.picture;
    presenter_.set_picture(shown_->picture);
    pace_.drawn(shown_->request.divisor, shown_->milliseconds);
    redraws_ = std::max(redraws_, 2);  // a panel that has more to say takes its new size a frame later
}

bool App::settled() const {
    return shown_ && shown_->request.serial == asked_.serial && shown_->request.divisor == 1;
}

void App::panel() {
    PanelFacts facts;
    facts.file = opened_.file.filename().string();
    facts.device = device_info(*opened_.device).name;
    facts.splats = opened_.gaussians.size();
    facts.scene_sh_degree = scene_sh_degree_;
    facts.dataset = opened_.dataset ? &*opened_.dataset : nullptr;
    facts.picture = shown_.get();
    facts.drawing = !settled();
    facts.note = note_;
    facts.up = view_.up();
    const PanelActions actions = draw_panel(facts, look_, frame_);
    if (actions.screenshot) capture_ = true;
    if (actions.reset) view_.reset();
    if (actions.frame) view_.restart(start_view(opened_, *actions.frame));
    if (actions.up) view_.set_up(*actions.up);
}

void App::draw() {
    --redraws_;
    gui_.begin_frame();
    if (show_panel_ && !opened_.picture) panel();
    if (show_help_) draw_help(show_help_);
    handle_mouse();
    ImDrawData* drawn = gui_.end_frame();

    const Size size = window_.framebuffer();
    Size shown_as = size;
    if (shown_) shown_as = {shown_->request.camera.width, shown_->request.camera.height};
    const bool capture = capture_ && settled() && shown_as == size;
    Image image;
    if (!presenter_.draw(size, shown_as, drawn, capture ? &image : nullptr)) {
        // Nothing can be shown while minimised; otherwise the window is just changing, and the next try is
        // soon.
        if (size.width > 0 && size.height > 0) redraws_ = std::max(redraws_, 1);
        return;
    }
    if (capture) save(image);
}

void App::save(const Image& image) {
    capture_ = false;
    if (opened_.picture) {
        save_image(*opened_.picture, image);
        done_ = true;
        return;
    }
    try {
        const std::filesystem::path path = free_name();
        save_image(path, image);
        note_ = "wrote " + std::filesystem::absolute(path).string();
    } catch (const std::exception& error) {
        note_ = error.what();
    }
    redraws_ = kRedraws;
}

}  // namespace ewa::viewer
