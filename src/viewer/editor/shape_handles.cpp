// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/shape_handles.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <iterator>
#include <numbers>
#include <utility>

#include "viewer/editor/texts.h"
#include "viewer/editor/theme.h"

namespace ewa::viewer {
namespace {

constexpr int kCircleSides = 64;
constexpr double kFirstShare = 0.1;   // size of a new shape, in radii of the scene
constexpr double kLeastShare = 1e-6;  // least size, in radii of the scene

}  // namespace

void ShapeHandles::place() {
    const Editor& editor = room_.editor;
    auto& placed = sphere() ? sphere_of_ : box_of_;
    const std::filesystem::path scene =
        editor.scenes() > 0 ? editor.scene(editor.active()).file : std::filesystem::path();
    if (placed == scene) return;
    placed = scene;
    EditSettings& settings = room_.settings();
    const ViewCamera& view = room_.navigation.view;
    const glm::dvec3 half(kFirstShare * view.radius());
    auto bounds = editor.snapshot().bounds.value_or(std::array{view.pivot() - half, view.pivot() + half});
    bounds[1] = glm::max(bounds[1], bounds[0] + half * kFirstShare);
    if (sphere()) {
        settings.sphere_center = (bounds[0] + bounds[1]) / 2.0;
        settings.sphere_radius = glm::length(bounds[1] - bounds[0]) / 2;
    } else {
        settings.box_low = bounds[0];
        settings.box_high = bounds[1];
    }
}

glm::dvec3 ShapeHandles::middle() const {
    const EditSettings& settings = room_.settings();
    return sphere() ? settings.sphere_center : (settings.box_low + settings.box_high) / 2.0;
}

std::vector<glm::dvec3> ShapeHandles::handles(const Camera& camera) const {
    const EditSettings& settings = room_.settings();
    std::vector<glm::dvec3> places{middle()};
    if (sphere()) {
        const glm::dvec3 right(camera.rotation[0][0], camera.rotation[1][0], camera.rotation[2][0]);
        places.push_back(settings.sphere_center + right * settings.sphere_radius);
        return places;
    }
    for (int face = 0; face < 6; ++face) {
        places.push_back(places[0]);
        places.back()[face / 2] = (face % 2 == 0 ? settings.box_low : settings.box_high)[face / 2];
    }
    return places;
}

std::optional<size_t> ShapeHandles::handle_at(const ToolPicture& picture) const {
    if (drag_) return drag_->handle;
    if (!picture.free) return std::nullopt;
    std::optional<size_t> nearest;
    double least = kHandleReach * picture.unit;
    const auto places = handles(picture.camera);
    for (size_t i = 0; i < places.size(); ++i) {
        const auto pixel = picture.pixel(places[i]);
        const double distance = pixel ? glm::length(*pixel - picture.pointer) : least;
        if (!(distance < least)) continue;
        least = distance;
        nearest = i;
    }
    return nearest;
}

bool ShapeHandles::mouse(const ToolPicture& picture) {
    if (ImGui::IsMouseClicked(ImGuiMouseButton_Left)) {
        const auto handle = handle_at(picture);
        const auto ray = picture.ray();
        if (!handle || !ray) return false;
        const glm::dvec3 at = handles(picture.camera)[*handle];
        drag_ = Drag{*handle, room_.settings(),
                     on_plane(*ray, at, towards_viewer(picture.camera, at)).value_or(at), middle()};
        if (*handle > 0 && !sphere()) {
            glm::dvec3 axis(0);
            axis[int(*handle - 1) / 2] = 1;
            drag_->along = along_axis(*ray, middle(), axis).value_or(0);
        }
    }
    if (drag_) move(picture);
    return drag_.has_value();
}

void ShapeHandles::move(const ToolPicture& picture) {
    EditSettings& settings = room_.settings();
    const auto ray = picture.ray();
    if (!ray) return;
    const Drag& drag = *drag_;
    const double least = kLeastShare * room_.navigation.view.radius();
    if (drag.handle > 0 && !sphere()) {
        const int axis = int(drag.handle - 1) / 2;
        glm::dvec3 direction(0);
        direction[axis] = 1;
        const auto along = along_axis(*ray, drag.center, direction);
        if (!along) return;
        if (drag.handle % 2 == 1)
            settings.box_low[axis] =
                std::min(drag.before.box_low[axis] + *along - drag.along, settings.box_high[axis] - least);
        else
            settings.box_high[axis] =
                std::max(drag.before.box_high[axis] + *along - drag.along, settings.box_low[axis] + least);
        return;
    }
    const auto point = on_plane(*ray, drag.grabbed, towards_viewer(picture.camera, drag.center));
    if (!point) return;
    if (drag.handle > 0) {
        settings.sphere_radius = std::max(least, glm::length(*point - drag.center));
        return;
    }
    const glm::dvec3 moved = *point - drag.grabbed;
    if (sphere()) {
        settings.sphere_center = drag.center + moved;
    } else {
        settings.box_low = drag.before.box_low + moved;
        settings.box_high = drag.before.box_high + moved;
    }
}

bool ShapeHandles::release() {
    const bool dragged = drag_.has_value();
    drag_.reset();
    return dragged;
}

bool ShapeHandles::cancel() {
    if (!drag_) return false;
    static_cast<SelectionShapes&>(room_.settings()) = drag_->before;
    return release();
}

void ShapeHandles::select(edit::Operation operation) const {
    const EditSettings& settings = room_.settings();
    room_.select(sphere() ? edit::sphere_shape(settings.sphere_center, settings.sphere_radius)
                          : edit::box_shape(settings.box_low, settings.box_high),
                 operation);
}

/// Three circles, or twelve edges.
std::vector<Segment> ShapeHandles::wires() const {
    const EditSettings& settings = room_.settings();
    std::vector<Segment> wires;
    for (int axis = 0; axis < 3; ++axis) {
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        for (int i = 0; sphere() && i < kCircleSides; ++i) {
            const auto at = [&](int side) {
                const double angle = 2 * std::numbers::pi * side / kCircleSides;
                glm::dvec3 point = settings.sphere_center;
                point[u] += settings.sphere_radius * std::cos(angle);
                point[v] += settings.sphere_radius * std::sin(angle);
                return point;
            };
            wires.push_back({at(i), at(i + 1)});
        }
        for (int edge = 0; !sphere() && edge < 4; ++edge) {
            Segment segment{settings.box_low, settings.box_low};
            segment.from[u] = segment.to[u] = (edge % 2 == 0 ? settings.box_low : settings.box_high)[u];
            segment.from[v] = segment.to[v] = (edge / 2 == 0 ? settings.box_low : settings.box_high)[v];
            segment.to[axis] = settings.box_high[axis];
            wires.push_back(segment);
        }
    }
    return wires;
}

/// Below the shape, inside the picture.
void ShapeHandles::buttons(const ToolPicture& picture, const std::vector<Segment>& drawn) const {
    const auto center = picture.pixel(middle());
    if (!center || drag_) return;
    double lowest = center->y;
    for (const Segment& segment : drawn)
        if (const auto pixel = picture.pixel(segment.from)) lowest = std::max(lowest, pixel->y);
    const double margin = 60 * picture.unit;
    const glm::dvec2 size(picture.place.width, picture.place.height);
    const double half = 3 * margin;  // more than half of their width
    const glm::dvec2 at = glm::max(glm::dvec2(half, 0), glm::min(glm::dvec2(center->x, lowest + margin / 4),
                                                                 size - glm::dvec2(half, margin)));
    ImGui::SetNextWindowPos(picture.gui(at), ImGuiCond_Always, {0.5f, 0});
    constexpr auto kFlags = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize |
                            ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                            ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav;
    if (ImGui::Begin("shape", nullptr, kFlags)) {
        for (size_t i = 0; i < std::size(texts::kShapeButtons); ++i) {
            if (i > 0) ImGui::SameLine();
            if (ImGui::Button(texts::kShapeButtons[i])) select(edit::Operation(i));
        }
    }
    ImGui::End();
}

void ShapeHandles::draw(const ToolPicture& picture) {
    const std::vector<Segment> lines = wires();
    {
        const ToolPen pen(picture);
        for (const Segment& segment : lines) pen.segment(segment, accent());
        const std::optional<size_t> pointed = handle_at(picture);
        const auto places = handles(picture.camera);
        for (size_t i = 0; i < places.size(); ++i) {
            const auto pixel = picture.pixel(places[i]);
            if (!pixel) continue;
            const bool face = i > 0 && !sphere();
            pen.knob(*pixel,
                     face           ? axis_color(int(i - 1) / 2, pointed == i)
                     : pointed == i ? accent()
                                    : ToolPen::kLight,
                     i > 0);
        }
    }
    buttons(picture, lines);
}

}  // namespace ewa::viewer
