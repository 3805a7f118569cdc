// SPDX-License-Identifier: Apache-2.0
#include "viewer/view_state.h"

#include <cmath>

namespace ewa::viewer {
namespace {

/// The size of the new window. A screenshot keeps the camera's size, which is the size of its file.
Size initial_size(const Startup& startup, const WindowSystem& system) {
    if (startup.size) return *startup.size;
    const Size picture = camera_size_or_usual(startup);
    if (!startup.picture.empty()) return picture;
    const Size desktop = system.work_area();
    const double scale = double(system.scale());
    if (startup.settings.window) {
        const auto side = [&](int last, int most) {
            const int length = std::max(1, int(std::lround(last * scale)));
            return most > 0 ? std::min(length, most) : length;
        };
        return {side(startup.settings.window->width, desktop.width),
                side(startup.settings.window->height, desktop.height)};
    }
    const bool beside = startup.settings.comparison == Comparison::beside;
    const double text = kTextHeight * scale * double(startup.settings.text_scale);
    return window_size({(beside ? 2 : 1) * picture.width, picture.height}, int(kPanelWidth * text), desktop,
                       scale);
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

ViewState::ViewState(const Startup& asked)
    : startup(asked),
      window(system, window_title(asked.scene), initial_size(asked, system), asked.picture.empty()),
      scene(asked.scene),
      settings(asked.settings),
      device_name(asked.device.name),
      loop{.capture = !asked.picture.empty(), .times = asked.times} {}

void ViewState::say(const std::string& note, bool until_edit) {
    message.say(note, until_edit);
    redraw(Loop::kRedraws);
}

double ViewState::text_height() const {
    return kTextHeight * double(window.scale()) * double(settings.text_scale);
}

int ViewState::panel_width() const {
    return viewer::panel_width(window.framebuffer().width, text_height());
}

bool ViewState::panel_fits() const {
    return free_area(window.framebuffer(), panel_width()).x > 0;
}

Rectangle ViewState::panel_area() const {
    Rectangle area = panel_fits() ? Rectangle{0, 0, 0, window.framebuffer().height} : picture_area();
    area.width = panel_fits() ? panel_width() : std::min(panel_width(), area.width);
    return area;
}

Rectangle ViewState::frame_area() const {
    return free_area(window.framebuffer(), panel_shown() ? panel_width() : 0);
}

bool ViewState::bars_shown() const {
    const Rectangle area = frame_area();
    return !scripted() && !empty() && std::min(area.width, area.height) >= kBarsNeed * text_height();
}

Rectangle ViewState::picture_area() const {
    Rectangle area = frame_area();
    if (!bars_shown()) return area;
    const BarSizes bars = bar_sizes(text_height());
    area.x += bars.left;
    area.y += bars.top;
    area.width = std::max(1, area.width - bars.left);
    area.height = std::max(1, area.height - bars.top - bars.bottom);
    return area;
}

}  // namespace ewa::viewer
