// SPDX-License-Identifier: Apache-2.0
// Keys and the mouse, and what they ask for: the dataset's cameras, saved views, and the film through them.
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>

#include "core/folders.h"
#include "ewa/error.h"
#include "viewer/app.h"

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
    const auto toggle = [](bool& setting) { setting = !setting; };
    // A text field does not use these keys, so they act while one is edited. The other keys belong to the
    // field.
    if (key == GLFW_KEY_Q && press.control) return window_.close();
    if (key == GLFW_KEY_O && press.control)
        return session_.dialog.ask(press.shift ? Wanted::folder : Wanted::file);
    if (key == GLFW_KEY_ESCAPE) return session_.search.cancel();
    switch (key) {
        case GLFW_KEY_F1:
            toggle(panels_.help);
            message_.hint_until = {};
            return;
        case GLFW_KEY_F2:
            return toggle(panel_fits() ? panels_.beside : panels_.over);
        case GLFW_KEY_F12:
            return press.shift ? save_exr() : void(loop_.capture = true);
        default:
            break;
    }
    if (ImGui::GetIO().WantTextInput) return;
    if (key >= GLFW_KEY_1 && key <= GLFW_KEY_9) return handle_number(key - GLFW_KEY_1 + 1, press);
    float& scale = settings_.look.splat_scale;
    switch (key) {
        case GLFW_KEY_R:
            navigation_.reset();
            settings_.turntable = false;
            return;
        case GLFW_KEY_F:
            show_whole_scene();
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
            return toggle(settings_.turntable);
        case GLFW_KEY_U:
            return navigation_.view.set_up(next_up(navigation_.view.up()));
        case GLFW_KEY_C:
            return toggle(settings_.cameras);
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
    if (loop_.capture)
        return;  // the screenshot shows the view at the key press, once its full frame is ready
    if (settings_.turntable) {
        navigation_.view.orbit(kTurntableSpeed * seconds, 0);
        navigation_.leave_camera();
        redraw();
    }
    if (!flying()) return;
    const auto either = [&](int minus, int plus) {
        return double(window_.held(plus)) - double(window_.held(minus));
    };
    const bool fast = window_.held(GLFW_KEY_LEFT_SHIFT) || window_.held(GLFW_KEY_RIGHT_SHIFT);
    const glm::dvec3 way(either(GLFW_KEY_A, GLFW_KEY_D), either(GLFW_KEY_E, GLFW_KEY_Q),
                         either(GLFW_KEY_S, GLFW_KEY_W));
    navigation_.view.fly(way * (seconds * kFlySpeed * (fast ? 4 : 1)));
    navigation_.leave_camera();
    redraw();
}

void App::handle_drag(double right, double down) {
    const ImGuiIO& io = ImGui::GetIO();
    const Rectangle place = arrangement().rendering;
    const bool left_button = ImGui::IsMouseDown(ImGuiMouseButton_Left);
    if (left_button && io.KeyCtrl) {
        navigation_.view.look(right * kRadiansPerPixel, down * kRadiansPerPixel);
    } else if (left_button) {
        // Ignore the small motion of a click, so that a double click does not move the camera.
        if (!ImGui::IsMouseDragging(ImGuiMouseButton_Left, kStillPixels)) return;
        navigation_.view.orbit(right * kRadiansPerPixel, down * kRadiansPerPixel);
    } else if (ImGui::IsMouseDown(ImGuiMouseButton_Right) || ImGui::IsMouseDown(ImGuiMouseButton_Middle)) {
        navigation_.view.pan(right * io.DisplayFramebufferScale.x, down * io.DisplayFramebufferScale.y,
                             place.width, place.height);
    } else {
        return;
    }
    settings_.turntable = false;
    navigation_.leave_camera();
}

void App::handle_mouse() {
    const ImGuiIO& io = ImGui::GetIO();
    if (io.WantCaptureMouse || scripted()) return;
    const Arrangement places = arrangement();
    const bool wiping = comparing() && settings_.comparison == Comparison::wipe;
    if (ImGui::IsMouseClicked(ImGuiMouseButton_Left))
        panels_.dragging_wipe = wiping && over_wipe(places.image, settings_.wipe);
    if (!ImGui::IsMouseDown(ImGuiMouseButton_Left)) panels_.dragging_wipe = false;
    if (panels_.dragging_wipe || (wiping && over_wipe(places.image, settings_.wipe)))
        ImGui::SetMouseCursor(ImGuiMouseCursor_ResizeEW);
    const double x = io.MousePos.x * double(io.DisplayFramebufferScale.x);
    const double y = io.MousePos.y * double(io.DisplayFramebufferScale.y);
    if (panels_.dragging_wipe) {
        settings_.wipe = float(std::clamp((x - places.image.x) / places.image.width, 0.0, 1.0));
        return;
    }
    if (io.MouseDelta.x != 0 || io.MouseDelta.y != 0) handle_drag(io.MouseDelta.x, io.MouseDelta.y);
    if (io.MouseWheel != 0) {
        navigation_.view.zoom(io.MouseWheel);
        navigation_.leave_camera();
    }
    if (ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left)) {
        renders_.ask_point(navigation_.view.camera(places.rendering.width, places.rendering.height),
                           {x - places.rendering.x, y - places.rendering.y});
        return;
    }
    if (navigation_.pointed_camera && ImGui::IsMouseReleased(ImGuiMouseButton_Left) &&
        io.MouseDragMaxDistanceSqr[ImGuiMouseButton_Left] < kStillPixels * kStillPixels)
        go_to_camera(*navigation_.pointed_camera);
}

void App::go_to_camera(int frame) {
    navigation_.view.stand(dataset_view(*scene_.gaussians, *scene_.dataset, frame));
    navigation_.at_camera = frame;
    settings_.turntable = false;
    redraw();
}

void App::go_to_nearest_camera() {
    if (!scene_.dataset) return say("there are no cameras; --cameras DATASET shows a dataset's");
    const Size size = picture_area().size();
    go_to_camera(nearest_frame(*scene_.dataset, navigation_.view.camera(size.width, size.height),
                               navigation_.view.radius()));
}

void App::step_camera(int step) {
    if (!scene_.dataset || !navigation_.at_camera) return go_to_nearest_camera();
    const int count = int(scene_.dataset->frames.size());
    go_to_camera((*navigation_.at_camera + step + count) % count);
}

void App::show_whole_scene() {
    const Size size = picture_area().size();
    Viewpoint place = framing_view(*scene_.gaussians, scene_.dataset.get(), size.width, size.height);
    navigation_.view.stand(place);
    navigation_.leave_camera();
    settings_.turntable = false;
    redraw();
}

void App::change_comparison() {
    if (!scene_.dataset) return go_to_nearest_camera();
    settings_.comparison = Comparison((int(settings_.comparison) + 1) % 4);
    if (settings_.comparison != Comparison::none && !navigation_.at_camera) go_to_nearest_camera();
}

void App::save_view(size_t number) {
    const Size size = picture_area().size();
    const std::string name = std::to_string(number);
    const io::NamedView view{name, navigation_.view.camera(size.width, size.height),
                             navigation_.view.pivot()};
    if (const auto same = navigation_.find(number); same != navigation_.views.end())
        *same = view;
    else
        navigation_.views.push_back(view);
    say("view " + name + " is saved; Shift + " + name + " goes to it");
}

void App::go_to_number(size_t number) {
    if (const auto view = navigation_.find(number); view != navigation_.views.end())
        return navigation_.go_to(view->camera, view->pivot);
    const std::string name = std::to_string(number);
    say("there is no view " + name + "; Ctrl + " + name + " saves one");
}

void App::write_views() {
    try {
        const std::filesystem::path file = free_name("ewa-views", ".json");
        io::write_views(file, navigation_.views);
        say("wrote " + std::filesystem::absolute(file).string() + "; --views opens it");
    } catch (const RunError& error) {
        say(error.what());
    }
}

void App::start_film() {
    Film film(navigation_.views, startup_.film.value_or(free_name("ewa-film", "")), picture_area().size(),
              double(settings_.film_seconds));
    try {
        core::make_folder(film.folder);
    } catch (const RunError& error) {
        if (startup_.film) throw;
        return say(error.what());
    }
    settings_.turntable = false;
    navigation_.leave_camera();
    navigation_.film = std::move(film);
}

/// Asks for the next frame once the last one is written.
void App::continue_film() {
    if (navigation_.film->waits_for != 0) {
        if (!renders_.shown() || renders_.shown()->request.serial < navigation_.film->waits_for) return;
        ++navigation_.film->next;
        redraw();
    }
    if (navigation_.film->finished()) {
        say("wrote " + std::to_string(navigation_.film->frames) + " pictures to " +
            std::filesystem::absolute(navigation_.film->folder).string());
        navigation_.film.reset();
        loop_.done = startup_.film.has_value();
        return;
    }
    navigation_.view.stand({navigation_.film->camera(), navigation_.view.pivot(), navigation_.view.up(),
                            navigation_.view.radius()});
    navigation_.film->waits_for =
        renders_.write(navigation_.view.camera(navigation_.film->size.width, navigation_.film->size.height),
                       settings_.look, navigation_.film->file());
}

}  // namespace ewa::viewer
