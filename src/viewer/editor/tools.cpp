// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/tools.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <iterator>
#include <utility>

#include "edit/edits.h"
#include "edit/steps.h"
#include "viewer/editor/edit_words.h"
#include "viewer/editor/pick_tools.h"
#include "viewer/editor/select_tools.h"
#include "viewer/editor/shape_handles.h"
#include "viewer/editor/texts.h"
#include "viewer/editor/transform_gizmo.h"

namespace ewa::viewer {
namespace {

constexpr double kGrowShare = 0.01;   // of the selection's size
constexpr double kFocusMargin = 1.2;  // size of the picture, in sizes of the focused selection

bool selects_in_image(Tool tool) {
    return tool == Tool::rectangle || tool == Tool::lasso || tool == Tool::polygon || tool == Tool::brush;
}

bool is_gizmo(Tool tool) {
    return tool == Tool::move || tool == Tool::rotate || tool == Tool::scale;
}

bool is_shape(Tool tool) {
    return tool == Tool::sphere || tool == Tool::box;
}

bool picks_points(Tool tool) {
    return tool == Tool::flood || tool == Tool::eyedropper || tool == Tool::level || tool == Tool::origin;
}

bool is_key(const KeyPress& press, int key, int keypad) {
    return press.key == key || press.key == keypad;
}

bool is_key(const KeyPress& press, const char* keys) {
    const int key = press.key == GLFW_KEY_KP_ADD        ? GLFW_KEY_EQUAL
                    : press.key == GLFW_KEY_KP_SUBTRACT ? GLFW_KEY_MINUS
                                                        : press.key;
    return has_key(keys, key, press.shift, press.control);
}

}  // namespace

struct Tools::State {
    explicit State(const ToolRoom& parts) : room(parts) {}

    Tool tool() const { return room.settings().tool; }
    bool idle() const { return tool() == Tool::view || room.state.scripted(); }
    bool cancel() {
        // Each of them is asked.
        const std::array any{select.cancel(), shapes.cancel(), gizmo.cancel(), picks.cancel()};
        return any[0] || any[1] || any[2] || any[3];
    }
    void follow_tool();
    void follow_history();
    void carry(const edit::Step& step, bool back);
    bool use_mouse(const ToolPicture& picture);
    bool tool_key(const KeyPress& press);
    bool control_key(const KeyPress& press);
    bool edit_key(const KeyPress& press);
    bool step_key(const KeyPress& press) const;
    void resize(const char* name) const;
    bool focus() const;

    const ToolRoom room;
    SelectTools select{room};
    ShapeHandles shapes{room};
    TransformGizmo gizmo{room};
    PickTools picks{room};
    Tool before = Tool::view;  // the tool of the last call
    bool yields = false;       // the present drag moves the camera
    bool swallows = false;     // the present drag was cancelled, and does nothing
    int ended = -1;            // the frame of ImGui in which a drag has ended
    // Of the snapshot that the view has followed.
    uint64_t scene = 0, version = 0;
    std::vector<edit::Step> steps;  // in effect
    std::vector<glm::dvec3> ups;    // of the view before the steps that have turned the scene
};

/// Moves the view and the measurement with a step that moves the whole scene, or back.
void Tools::State::carry(const edit::Step& step, bool back) {
    for (const edit::Words& words : step.edits) {
        if (words.name != "transform" || !words.value.starts_with(edit::kAllSplats)) continue;
        const glm::dmat4 matrix = edit::parse_transform({words.value.substr(edit::kAllSplats.size())});
        const glm::dmat4 way = back ? glm::inverse(matrix) : matrix;
        room.move_view(way);
        for (glm::dvec3& point : room.shown.measurement.points)
            point = glm::dvec3(way * glm::dvec4(point, 1));
        if (glm::dmat3(matrix) == glm::dmat3(matrix[0][0])) continue;
        ViewCamera& view = room.navigation.view;
        if (!back) {
            ups.push_back(view.up());
            view.set_up({0, -1, 0});
        } else if (!ups.empty()) {
            view.set_up(ups.back());
            ups.pop_back();
        }
    }
}

/// The view follows a scene that is moved as a whole, also where an undo moves it back.
void Tools::State::follow_history() {
    const EditSnapshot& now = room.editor.snapshot();
    if (now.scene == scene && now.version == version) return;
    std::vector<edit::Step> done(now.steps.begin(), now.steps.begin() + std::ptrdiff_t(now.done));
    if (now.scene == scene) {
        const auto [undone, fresh] = std::ranges::mismatch(steps, done);
        for (auto step = steps.end(); step != undone;) carry(*--step, true);
        for (auto step = fresh; step != done.end(); ++step) carry(*step, false);
        if (undone != steps.end()) room.settings().progress.clear();
        Message& message = room.state.message;
        if (message.until_edit && fresh != done.end()) message.note.clear();
    } else {
        ups.clear();
    }
    scene = now.scene;
    version = now.version;
    steps = std::move(done);
}

/// Begins and ends what belongs to a tool. The bar and the panel change the tool, too.
void Tools::State::follow_tool() {
    bool& measure = room.state.settings.measure;
    if (room.settings().live && moves_splats(tool())) room.settings().tool = Tool::view;
    if (tool() != before) {
        cancel();
        if (before == Tool::measure) measure = false;
        if (tool() == Tool::measure) measure = true;
        before = tool();
    } else if (tool() == Tool::measure && !measure) {
        before = room.settings().tool = Tool::view;
    }
    if (is_shape(tool())) shapes.place();
}

/// The left button of a tool that is not idle.
bool Tools::State::use_mouse(const ToolPicture& picture) {
    const bool released = ImGui::IsMouseReleased(ImGuiMouseButton_Left);
    const bool left = ImGui::IsMouseDown(ImGuiMouseButton_Left) || released;
    if (selects_in_image(tool())) {
        select.mouse(picture);
        return left;
    }
    if (ended == ImGui::GetFrameCount()) return true;
    if (is_gizmo(tool()) && gizmo.mouse(picture)) return true;
    if (is_shape(tool()) && shapes.mouse(picture)) return true;
    if (!picks_points(tool()) && tool() != Tool::sphere) return false;
    if (!tool_clicked()) return ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left);
    picks.click(picture);
    return true;
}

bool Tools::State::tool_key(const KeyPress& press) {
    EditSettings& settings = room.settings();
    for (const texts::ToolText& row : texts::kTools) {
        if (!is_key(press, row.key)) continue;
        if (settings.live && moves_splats(row.tool)) {
            room.say(texts::kLiveRefuses);
            return true;
        }
        const bool off = row.tool == Tool::measure && settings.tool == Tool::measure;
        settings.tool = off ? Tool::view : row.tool;
        return true;
    }
    return false;
}

void Tools::State::resize(const char* name) const {
    const auto& bounds = room.editor.snapshot().bounds;
    if (!bounds) return;
    const double size = glm::length((*bounds)[1] - (*bounds)[0]);
    if (size > 0) room.perform("", "select", fmt::format("{}={:.9g}", name, kGrowShare * size));
}

/// The keys of kKeyedEdits.
bool Tools::State::step_key(const KeyPress& press) const {
    namespace say = texts::edit_panel;
    const auto* item =
        std::ranges::find_if(say::kKeyedEdits, [&](const auto& each) { return is_key(press, each.keys); });
    if (item == std::end(say::kKeyedEdits)) return false;
    const std::string_view value = item->value;
    if (item->of_selection && room.editor.snapshot().selected == 0 && !room.editor.busy())
        room.state.say(texts::kNothingSelected);
    if (value == say::kGrow.value || value == say::kShrink.value)
        resize(item->value);
    else
        room.perform(value.empty() ? item->name : "", item->edit, item->value);
    return true;
}

bool Tools::State::control_key(const KeyPress& press) {
    if (is_key(press, texts::kUndo.keys))
        room.editor.undo();
    else if (is_key(press, texts::kRedo.keys))
        room.editor.redo();
    else
        return step_key(press);
    return true;
}

/// Turns to the selection, at the distance at which it fills the picture.
bool Tools::State::focus() const {
    const EditSnapshot& snapshot = room.editor.snapshot();
    if (snapshot.selected == 0 || !snapshot.bounds) return false;
    const auto& [low, high] = *snapshot.bounds;
    ViewCamera& view = room.navigation.view;
    view.focus((low + high) / 2.0);
    const Rectangle place = room.shown.arrangement().rendering;
    const Camera camera = view.camera(place.width, place.height);
    const double tangent = std::min(camera.width / camera.fx, camera.height / camera.fy) / 2;
    const double wanted = kFocusMargin * glm::length(high - low) / 2 / tangent;
    if (wanted > 0 && view.distance() > 0) view.zoom(std::log(wanted / view.distance()) / std::log(0.9));
    room.navigation.leave_camera();
    room.state.settings.turntable = false;
    room.state.redraw(Loop::kRedraws);
    return true;
}

/// Keys without Ctrl.
bool Tools::State::edit_key(const KeyPress& press) {
    const int key = press.key;
    if (select.key(press) || (key == GLFW_KEY_BACKSPACE && picks.remove_last())) return true;
    if (key == GLFW_KEY_ESCAPE) {
        if (cancel()) return swallows = true;
        if (tool() == Tool::view) return false;
        room.settings().tool = Tool::view;
    } else if (is_key(press, GLFW_KEY_ENTER, GLFW_KEY_KP_ENTER)) {
        if (tool() == Tool::level)
            picks.find_ground();
        else if (is_shape(tool()))
            shapes.select(room.operation());
        else
            return false;
    } else if (key == GLFW_KEY_F && !press.shift) {
        return focus();
    } else if (key == GLFW_KEY_LEFT_BRACKET || key == GLFW_KEY_RIGHT_BRACKET) {
        select.change_brush(key == GLFW_KEY_LEFT_BRACKET ? -1 : 1);
    } else {
        return step_key(press) || tool_key(press);
    }
    return true;
}

Tools::Tools(ViewState& state, Navigation& navigation, Shown& shown, Editor& editor)
    : state_(std::make_unique<State>(ToolRoom{state, navigation, shown, editor})) {
    shown.take_edit_point = [this](const SurfacePoint& point) { take_point(point); };
}

Tools::~Tools() {
    state_->room.shown.take_edit_point = nullptr;
}

bool Tools::handle_mouse() {
    State& s = *state_;
    s.follow_tool();
    if (s.idle()) return false;
    const ImGuiIO& io = ImGui::GetIO();
    const ToolPicture picture(s.room.shown);
    if (s.tool() == Tool::brush && io.KeyCtrl && io.MouseWheel != 0) {
        s.select.change_brush(double(io.MouseWheel));
        return true;
    }
    if (ImGui::IsMouseClicked(ImGuiMouseButton_Left)) s.yields = io.KeyAlt || !picture.inside;
    const bool yields = s.yields, swallows = s.swallows;
    if (!ImGui::IsMouseDown(ImGuiMouseButton_Left)) s.yields = s.swallows = false;
    return !yields && (swallows || s.use_mouse(picture));
}

bool Tools::handle_key(const KeyPress& press) {
    State& s = *state_;
    s.follow_tool();
    const bool used = press.control ? s.control_key(press) : s.edit_key(press);
    s.follow_tool();
    if (used) s.room.state.redraw(Loop::kRedraws);
    if (used && s.room.state.scene.points) s.room.say(texts::kPointsEdited);
    return used;
}

void Tools::draw() {
    State& s = *state_;
    s.follow_tool();
    s.follow_history();
    if (s.idle()) return;
    const ToolPicture picture(s.room.shown);
    if (!ImGui::IsMouseDown(ImGuiMouseButton_Left)) {
        // Also where an item of ImGui has the pointer when the button goes up.
        s.select.release(picture);
        const bool gizmo = s.gizmo.release(), shape = s.shapes.release();
        if (gizmo || shape) s.ended = ImGui::GetFrameCount();
    }
    if (selects_in_image(s.tool())) s.select.draw(picture);
    if (is_gizmo(s.tool())) s.gizmo.draw(picture);
    if (is_shape(s.tool())) s.shapes.draw(picture);
    s.picks.draw(picture);
}

bool Tools::take_point(const SurfacePoint& point) {
    return state_->picks.take_point(point);
}

}  // namespace ewa::viewer
