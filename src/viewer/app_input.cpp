// SPDX-License-Identifier: Apache-2.0
// Keys and the mouse.
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>

#include "viewer/app.h"
#include "viewer/overlay.h"

namespace ewa::viewer {
namespace {

constexpr double kRadiansPerPixel = 0.005;
constexpr double kFlySpeed = 0.8;        // distances to the pivot per second
constexpr double kTurntableSpeed = 0.4;  // radians per second
constexpr float kScaleStep = 1.25f, kLeastScale = 0.05f, kMostScale = 2;
constexpr float kStillPixels = 4;  // a shorter drag is a click

}  // namespace

void App::handle_number(int number, const KeyPress& press) {
    if (press.control)
        save_view(size_t(number));
    else if (press.shift)
        go_to_number(size_t(number));
    else if (number <= 5)
        settings_.look.mode = Mode(number - 1);
}

void App::handle_key(const KeyPress& press) {
    const int key = press.key;
    // A text field does not use these keys, so they act while one is edited. The other keys belong to the
    // field.
    if (key == GLFW_KEY_Q && press.control) return window_.close();
    switch (key) {
        case GLFW_KEY_F1:
            show_help_ = !show_help_;
            message_.hint_until = {};
            return;
        case GLFW_KEY_F2:
            show_panel_ = !show_panel_;
            return;
        case GLFW_KEY_F12:
            return press.shift ? save_exr() : void(capture_ = true);
        default:
            break;
    }
    if (ImGui::GetIO().WantTextInput) return;
    if (key >= GLFW_KEY_1 && key <= GLFW_KEY_9) return handle_number(key - GLFW_KEY_1 + 1, press);
    float& scale = settings_.look.splat_scale;
    switch (key) {
        case GLFW_KEY_R:
            reset_view();
            settings_.turntable = false;
            return;
        case GLFW_KEY_MINUS:
        case GLFW_KEY_KP_SUBTRACT:
            scale = std::max(kLeastScale, scale / kScaleStep);
            return;
        case GLFW_KEY_EQUAL:
        case GLFW_KEY_KP_ADD:
            scale = std::min(kMostScale, scale * kScaleStep);
            return;
        case GLFW_KEY_T:
            settings_.turntable = !settings_.turntable;
            return;
        case GLFW_KEY_U:
            view_.set_up(next_up(view_.up()));
            return;
        case GLFW_KEY_C:
            settings_.cameras = !settings_.cameras;
            return;
        case GLFW_KEY_G:
            return go_to_nearest_camera();
        case GLFW_KEY_LEFT:
            return step_camera(-1);
        case GLFW_KEY_RIGHT:
            return step_camera(1);
        case GLFW_KEY_V:
            return change_comparison();
        default:
            return;
    }
}

bool App::flying() const {
    if (ImGui::GetIO().WantTextInput || window_.held(GLFW_KEY_LEFT_CONTROL) ||
        window_.held(GLFW_KEY_RIGHT_CONTROL))
        return false;
    const auto keys = {GLFW_KEY_W, GLFW_KEY_A, GLFW_KEY_S, GLFW_KEY_D, GLFW_KEY_Q, GLFW_KEY_E};
    return std::any_of(keys.begin(), keys.end(), [&](int key) { return window_.held(key); });
}

void App::move_by_itself(double seconds) {
    if (capture_) return;  // the screenshot shows the view at the key press, once its full frame is ready
    if (settings_.turntable) {
        view_.orbit(kTurntableSpeed * seconds, 0);
        leave_camera();
        redraw();
    }
    if (!flying()) return;
    const auto either = [&](int minus, int plus) {
        return double(window_.held(plus)) - double(window_.held(minus));
    };
    const bool fast = window_.held(GLFW_KEY_LEFT_SHIFT) || window_.held(GLFW_KEY_RIGHT_SHIFT);
    const glm::dvec3 way(either(GLFW_KEY_A, GLFW_KEY_D), either(GLFW_KEY_E, GLFW_KEY_Q),
                         either(GLFW_KEY_S, GLFW_KEY_W));
    view_.fly(way * (seconds * kFlySpeed * (fast ? 4 : 1)));
    leave_camera();
    redraw();
}

void App::handle_drag(double right, double down) {
    const ImGuiIO& io = ImGui::GetIO();
    const Rectangle place = arrangement().rendering;
    const bool left_button = ImGui::IsMouseDown(ImGuiMouseButton_Left);
    if (left_button && io.KeyCtrl) {
        view_.look(right * kRadiansPerPixel, down * kRadiansPerPixel);
    } else if (left_button) {
        // Ignore the small motion of a click, so that a double click does not move the camera.
        if (!ImGui::IsMouseDragging(ImGuiMouseButton_Left, kStillPixels)) return;
        view_.orbit(right * kRadiansPerPixel, down * kRadiansPerPixel);
    } else if (ImGui::IsMouseDown(ImGuiMouseButton_Right) || ImGui::IsMouseDown(ImGuiMouseButton_Middle)) {
        view_.pan(right * io.DisplayFramebufferScale.x, down * io.DisplayFramebufferScale.y, place.width,
                  place.height);
    } else {
        return;
    }
    settings_.turntable = false;
    leave_camera();
}

void App::handle_mouse() {
    const ImGuiIO& io = ImGui::GetIO();
    if (io.WantCaptureMouse || scripted()) return;
    const Arrangement places = arrangement();
    const bool wiping = comparing() && settings_.comparison == Comparison::wipe;
    if (ImGui::IsMouseClicked(ImGuiMouseButton_Left))
        dragging_wipe_ = wiping && over_wipe(places.image, settings_.wipe);
    if (!ImGui::IsMouseDown(ImGuiMouseButton_Left)) dragging_wipe_ = false;
    if (dragging_wipe_ || (wiping && over_wipe(places.image, settings_.wipe)))
        ImGui::SetMouseCursor(ImGuiMouseCursor_ResizeEW);
    const double x = io.MousePos.x * double(io.DisplayFramebufferScale.x);
    const double y = io.MousePos.y * double(io.DisplayFramebufferScale.y);
    if (dragging_wipe_) {
        settings_.wipe = float(std::clamp((x - places.image.x) / places.image.width, 0.0, 1.0));
        return;
    }
    if (io.MouseDelta.x != 0 || io.MouseDelta.y != 0) handle_drag(io.MouseDelta.x, io.MouseDelta.y);
    if (io.MouseWheel != 0) {
        view_.zoom(io.MouseWheel);
        leave_camera();
    }
    if (ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left)) {
        renders_.ask_point(view_.camera(places.rendering.width, places.rendering.height),
                           {x - places.rendering.x, y - places.rendering.y});
        return;
    }
    if (pointed_camera_ && ImGui::IsMouseReleased(ImGuiMouseButton_Left) &&
        io.MouseDragMaxDistanceSqr[ImGuiMouseButton_Left] < kStillPixels * kStillPixels)
        go_to_camera(*pointed_camera_);
}

}  // namespace ewa::viewer
