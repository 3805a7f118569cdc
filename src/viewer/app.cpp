// SPDX-License-Identifier: Apache-2.0
#include "viewer/app.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include <nlohmann/json.hpp>

#include "core/folders.h"
#include "core/process.h"
#include "ewa/error.h"
#include "folders/run_folder.h"
#include "viewer/editor/modal.h"
#include "viewer/editor/offers.h"
#include "viewer/editor/photo_check.h"
#include "viewer/editor/toolbar.h"
#include "viewer/latest.h"

namespace ewa::viewer {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kPollSeconds = 0.05;   // while a better frame, a file or a screenshot is on its way
constexpr double kDialogSeconds = 0.3;  // from one frame of an open dialog to the next
constexpr int kMostDevicesLost = 5;     // a device that is lost more often is broken
constexpr float kScaleStep = 1.25f, kLeastScale = 0.05f, kMostScale = 2;

void toggle(bool& setting) {
    setting = !setting;
}

/// The file of an opened scene's splats; empty if they are in no single one.
std::filesystem::path file_of(const OpenedScene& scene) {
    const std::filesystem::path file = scene.run.empty() ? scene.path : scene.run / folders::kSplatsFile;
    return core::is_file(file) ? file : std::filesystem::path();
}

}  // namespace

App::App(const Startup& startup)
    : state_(startup),
      navigation_(state_),
      shown_(state_, navigation_),
      session_(state_, navigation_, shown_),
      editor_(core::own_program().parent_path() / "ewa", state_.wake, startup.budget.value_or(kUsualBudget)),
      tools_(state_, navigation_, shown_, editor_),
      dialogs_(state_, editor_, session_.dialog),
      film_(state_, navigation_, shown_, dialogs_, session_.dialog) {
    change_text();
    state_.loop.last_frame = Clock::now();
    state_.message.hint();
    // A screenshot is framed as `ewa render` does.
    if (!state_.scripted())
        navigation_.view.restart(start_view(startup.scene, startup.frame, state_.picture_area().size()));
    session_.start();
    state_.loop.times.window_open = state_.loop.times.now();
}

KeptSettings App::kept() const {
    KeptSettings kept = state_.settings;
    if (state_.startup.size) return kept;
    const double scale = double(state_.window.scale()) / double(state_.window.density());
    const Size size = state_.window.size();
    if (size.width > 0 && size.height > 0)
        kept.window = Size{int(std::lround(size.width / scale)), int(std::lround(size.height / scale))};
    return kept;
}

void App::run() {
    Loop& loop = state_.loop;
    while (!loop.done) {
        if (state_.window.closed()) {
            if (state_.scripted() || dialogs_.leaving()) break;
            state_.window.stay();
            dialogs_.leave([&loop] { loop.done = true; });
            state_.redraw(Loop::kRedraws);
        }
        const auto keys = state_.window.wait(patience());
        const auto now = Clock::now();
        const double seconds = std::chrono::duration<double>(now - loop.last_frame).count();
        loop.last_frame = now;
        if (state_.window.stirred()) loop.redraws = Loop::kRedraws;
        // Some dialogs show the seconds. Others change their size with news.
        const bool news = state_.woken.exchange(false), dialog = dialogs_.open();
        if (news || dialog) state_.redraw(news && dialog ? Loop::kRedraws : 1);
        if (state_.message.expire(now)) state_.redraw();
        if (!state_.scripted()) {
            for (const KeyPress& key : keys) handle_key(key);
            if (!dialogs_.open()) navigation_.move(std::min(seconds, 0.1));
            film_.advance(seconds);
            if (const auto dropped = state_.window.take_dropped(); !dropped.empty())
                open(dropped, state_.scene);
            dialogs_.take();
            take_chosen();
            change_text();
        }
        session_.take_opened();
        session_.take_found();
        shown_.take_renders();
        shown_.take_comparison(screen_->presenter);
        session_.take_saved();
        // New splats wait for the edits in progress, which would be lost.
        if (!live() || !editor_.busy()) session_.take_live(keeps_edits());
        if (!state_.scripted()) sync_editor();
        film_.edits = editor_.snapshot().done;
        film_.take();
        if (loop.redraws > 0) draw();
        shown_.ask();
    }
    const Startup& startup = state_.startup;
    if (startup.verbose) loop.times.print(shown_.renders.shown().get());
    if (state_.scripted() && !loop.done)
        throw RunError("the window was closed before " + startup.picture.string() + " was written");
}

/// How long to wait for input, in seconds.
double App::patience() const {
    if (state_.loop.redraws > 0 || navigation_.flying() || state_.settings.turntable || film_.playing())
        return 1.0 / 60;
    const bool waits = shown_.renders.reduced() || session_.waiting() || editor_.busy() || editor_.saving() ||
                       added_.running();
    return waits ? kPollSeconds : dialogs_.open() ? kDialogSeconds : 1.0;
}

/// Opens the screen, also with another size of the text or another theme.
void App::change_text() {
    const double text = state_.text_height();
    const bool light = state_.settings.light;
    if (screen_ && screen_->text == text && screen_->light == light) return;
    screen_.reset();
    screen_ = std::make_unique<Screen>(state_.system, state_.window, state_.device_name, text, light);
    shown_.fill(screen_->presenter);
    state_.redraw(Loop::kRedraws);
}

void App::handle_key(const KeyPress& press) {
    const int key = press.key;
    PanelSettings& settings = state_.settings;
    // A text field does not use these keys, so they act while one is edited. The other keys belong to the field.
    // Asked again while the dialog of unsaved edits is open, the window closes. The journal has the edits.
    if (key == GLFW_KEY_Q && press.control) return state_.window.close();
    const bool confirms = key == GLFW_KEY_ENTER || key == GLFW_KEY_KP_ENTER,
               answers = confirms || key == GLFW_KEY_ESCAPE;
    if (dialogs_.open()) {
        if (answers) press_modal(confirms ? Choice::confirm : Choice::cancel);
        return;
    }
    if (answers && ImGui::IsPopupOpen("", ImGuiPopupFlags_AnyPopup)) return;
    if (key == GLFW_KEY_S && press.control) return press.shift ? dialogs_.save_as() : dialogs_.save();
    if (key == GLFW_KEY_O && press.control)
        return session_.dialog.ask(press.shift ? Wanted::folder : Wanted::file);
    if (key == GLFW_KEY_ESCAPE && std::exchange(state_.help, false)) return;
    if (key == GLFW_KEY_ESCAPE) session_.search.cancel();
    if (key == GLFW_KEY_F1) state_.message.hint_until = {};
    if (key == GLFW_KEY_F1) toggle(state_.help);
    if (key == GLFW_KEY_F2) toggle(state_.panel_wanted());
    if (key == GLFW_KEY_F12 && press.shift) shown_.write_exr();
    if (key == GLFW_KEY_F12 && !press.shift) state_.loop.capture = true;
    if (ImGui::GetIO().WantTextInput) return;
    if (key == GLFW_KEY_TAB && editor_.scenes() > 0) {
        settings.tab = settings.tab == PanelTab::edit ? PanelTab::view : PanelTab::edit;
        if (settings.tab == PanelTab::view) editor_.settings.tool = Tool::view;
        return;
    }
    const bool undoes = press.control && (key == GLFW_KEY_Z || key == GLFW_KEY_Y),
               edits_points = state_.scene.points && (press.control || key == GLFW_KEY_DELETE);
    if (undoes && film_.undo(key == GLFW_KEY_Z && !press.shift)) return state_.redraw(Loop::kRedraws);
    if ((editing() || undoes || edits_points) && tools_.handle_key(press))
        return state_.redraw(Loop::kRedraws);
    float& scale = settings.look.splat_scale;
    if (key == GLFW_KEY_MINUS || key == GLFW_KEY_KP_SUBTRACT)
        scale = std::max(kLeastScale, scale / kScaleStep);
    if (key == GLFW_KEY_EQUAL || key == GLFW_KEY_KP_ADD) scale = std::min(kMostScale, scale * kScaleStep);
    if (key == GLFW_KEY_C) toggle(settings.cameras);
    if (key == GLFW_KEY_M) toggle(settings.measure);
    if (key == GLFW_KEY_V) shown_.change_comparison();
    if (!film_.handle_key(press)) navigation_.handle_key(press);
}

void App::handle_mouse() {
    const ImGuiIO& io = ImGui::GetIO();
    if (io.WantCaptureMouse || state_.scripted()) return;
    if (editor_.scenes() > 0 && tools_.handle_mouse()) return;
    const Arrangement places = shown_.arrangement();
    const bool at_wipe = shown_.wiping() && over_wipe(places.image, state_.settings.wipe);
    if (ImGui::IsMouseClicked(ImGuiMouseButton_Left)) dragging_wipe_ = at_wipe;
    if (!ImGui::IsMouseDown(ImGuiMouseButton_Left)) dragging_wipe_ = false;
    if (dragging_wipe_ || at_wipe) ImGui::SetMouseCursor(ImGuiMouseCursor_ResizeEW);
    const double x = io.MousePos.x * double(io.DisplayFramebufferScale.x);
    const double y = io.MousePos.y * double(io.DisplayFramebufferScale.y);
    if (dragging_wipe_) {
        state_.settings.wipe = float(std::clamp((x - places.image.x) / places.image.width, 0.0, 1.0));
        return;
    }
    if (io.MouseDelta.x != 0 || io.MouseDelta.y != 0)
        navigation_.drag(io.MouseDelta.x, io.MouseDelta.y, places.rendering.size());
    if (io.MouseWheel != 0) {
        navigation_.view.zoom(io.MouseWheel);
        navigation_.leave_camera();
    }
    const glm::dvec2 at(x - places.rendering.x, y - places.rendering.y);
    const bool clicked = ImGui::IsMouseReleased(ImGuiMouseButton_Left) &&
                         io.MouseDragMaxDistanceSqr[ImGuiMouseButton_Left] < kStillPixels * kStillPixels;
    if (state_.settings.measure) {
        const bool inside =
            at.x >= 0 && at.y >= 0 && at.x < places.rendering.width && at.y < places.rendering.height;
        if (clicked && inside) shown_.ask_point(at, PointUse::measure);
        return;
    }
    if (ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left)) return shown_.ask_point(at, PointUse::look_at);
    if (navigation_.pointed_camera && clicked) navigation_.go_to_camera(*navigation_.pointed_camera);
}

void App::panel() {
    const float text = state_.settings.text_scale;
    draw_panel(parts_);
    // The row that changes it stays in view.
    if (state_.settings.text_scale != text) state_.panel_beside = state_.panel_over = true;
}

void App::draw_overlays() {
    const Arrangement places = shown_.arrangement();
    const PanelSettings& settings = state_.settings;
    const OpenedScene& scene = state_.scene;
    navigation_.pointed_camera.reset();
    if (settings.cameras && scene.dataset)
        navigation_.pointed_camera = draw_cameras(scene, shown_.camera(), places.rendering,
                                                  navigation_.camera_size, navigation_.at_camera);
    shown_.set_measuring(settings.measure);
    if (editor_.scenes() > 0) tools_.draw();
    draw_measurement(shown_.measurement, shown_.camera(), places.rendering);
    if (shown_.comparing()) draw_comparison(settings.comparison, places, settings.wipe);
    const Rectangle area = film_.area_above();
    const std::optional<Headline> words = session_.headline();
    if (words && !state_.help) draw_headline(*words, area);
    const bool empty = session_.empty();
    if (empty && !state_.help) {
        const Welcome chosen = draw_welcome(area);
        if (chosen.wanted) session_.dialog.ask(*chosen.wanted);
        if (chosen.file) open({*chosen.file}, {});
    }
    if (session_.search.running() && draw_search(session_.search.progress(), area)) session_.search.cancel();
    if (session_.offers_training() && !state_.help)
        if (const auto steps = draw_training_offer(scene, state_.on_cpu, area)) session_.answer_offer(*steps);
    if (const std::string text = session_.banner(); !text.empty()) draw_banner(text, area);
    const auto now = Clock::now();
    if (!words && !empty && state_.message.hinting(now) && !state_.help)
        draw_hint({scene.dataset != nullptr, state_.panel_shown(), shown_.comparing(),
                   state_.message.hint_opacity(now)},
                  area);
}

void App::draw() {
    Loop& loop = state_.loop;
    --loop.redraws;
    shown_.load_image();
    const Comparison before = state_.settings.comparison;
    screen_->gui.begin_frame();
    if (!state_.scripted()) draw_overlays();
    if (!state_.scripted()) draw_editor();
    state_.settings.look.plain = false;
    if (state_.panel_shown()) panel();
    if (!state_.scripted()) film_.draw();
    if (state_.help) draw_help(state_.help);
    if (!state_.scripted() && state_.message.noting(Clock::now()))
        draw_note(state_.message.note, film_.area_above());
    // Last: no window may appear behind a modal one.
    if (!state_.scripted()) dialogs_.draw();
    handle_mouse();
    ImDrawData* drawn = screen_->gui.end_frame();
    if (state_.settings.comparison != before) state_.redraw(Loop::kRedraws);
    shown_.choose_picture(screen_->presenter);
    shown_.measure_view();

    const bool capture = loop.capture && shown_.complete() && !session_.saving();
    Image image;
    if (!present(drawn, capture ? &image : nullptr)) {
        // A minimised window shows nothing. Otherwise the window is changing: try again soon.
        const Size size = state_.window.framebuffer();
        if (size.width > 0 && size.height > 0) state_.redraw();
        return;
    }
    loop.times.count(shown_.renders.shown());
    if (capture) session_.save(part_of(image, state_.picture_area()));
}

bool App::editing() const {
    return editor_.scenes() > 0 &&
           (state_.settings.tab == PanelTab::edit || editor_.settings.tool != Tool::view);
}

bool App::live() const {
    const live::Update* run = session_.live_run.update();
    return run && run->status.state != live::State::done && run->connected;
}

void App::open(const std::vector<std::filesystem::path>& paths, const OpenedScene& shown) {
    dialogs_.leave([this, paths, shown] { session_.open(paths, shown); });
}

/// Opens what the user chose in the desktop's dialog. Without one the window asks.
void App::take_chosen() {
    const Wanted wanted = session_.dialog.wanted();
    if (wanted == Wanted::save) return;  // the dialogs of the editor take it
    const auto take = [this, wanted](const std::filesystem::path& path) {
        if (wanted == Wanted::scene)
            added_.start(state_.wake, [path] { return open_scene(path, {}); });
        else
            open({path}, {});
    };
    try {
        if (const auto path = session_.dialog.take()) take(*path);
    } catch (const std::exception& error) {
        dialogs_.ask_path(error.what(), take);
        state_.redraw(Loop::kRedraws);
    }
}

/// The steps that a training does not have yet: a selection lasts when newer splats of the training come.
std::vector<edit::Step> App::unsent_steps() const {
    const EditSnapshot& snapshot = editor_.snapshot();
    if (!live() || editor_.scenes() != 1 || snapshot.scene != editor_.scene(0).id) return {};
    const auto step = [&](size_t i) { return snapshot.steps.begin() + std::ptrdiff_t(i); };
    return {step(std::min(editor_.settings.sent, snapshot.done)), step(snapshot.done)};
}

/// The scene that the window shows becomes the one that is edited.
void App::enter_scene() {
    const OpenedScene& scene = state_.scene;
    entered_ = drawn_ = scene.gaussians;
    drafted_ = nullptr;
    marked_ = false;
    if (scene.points || entered_->size() == 0) return editor_.clear();
    const std::filesystem::path file = file_of(scene);
    const bool journaled = !file.empty() && !live();
    edit::Cameras cameras;
    if (scene.dataset && !scene.run.empty()) {
        cameras = [dataset = scene.dataset] {
            std::vector<Camera> all;
            for (const Frame& frame : dataset->frames) all.push_back(frame.camera);
            return all;
        };
        cameras.contradicted = contradicted_by_photos(scene, state_.startup.open_device, editor_.comparing());
    }
    const Tool tool = live() ? editor_.settings.tool : Tool::view;
    const std::vector<edit::Step> unsent = unsent_steps();
    std::vector<bool> frozen;
    if (live() && session_.live_run.update()->splats == entered_) frozen = session_.live_run.update()->frozen;
    editor_.settings.sent = sent_before_ = frozen.empty() ? 0 : 1;  // the step that locks them
    editor_.enter(scene.title, file, entered_, cameras, journaled, std::move(frozen));
    editor_.settings.tool = tool;
    for (const edit::Step& step : unsent) editor_.perform(step);
    if (journaled) dialogs_.offer_journals();
}

/// Opens a file beside those that are edited.
void App::add_scene() {
    if (std::exchange(editor_.wants_scene, false) && !added_.running()) session_.dialog.ask(Wanted::scene);
    try {
        if (!added_.ready()) return;
        const OpenedScene scene = added_.take();
        if (scene.points || scene.gaussians->size() == 0) throw InputError(scene.title + " has no splats");
        editor_.add(scene.title, file_of(scene), scene.gaussians);
        dialogs_.offer_journals();
    } catch (const std::exception& error) {
        state_.say(error.what());
    }
}

/// Lets the editor know of a new scene, and the render thread of edits.
void App::sync_editor() {
    const OpenedScene& scene = state_.scene;
    if (!scene.path.empty() && scene.path != opened_) remember_file(opened_ = scene.path);
    if (scene.gaussians != entered_) enter_scene();
    // A CPU takes a second for a draft of the usual size.
    if (state_.on_cpu.value_or(false) && !state_.startup.budget) editor_.set_budget(kCpuBudget);
    if (editor_.scenes() > 0) add_scene();
    const Editor::News news = editor_.take();
    if (news.any) state_.redraw(Loop::kRedraws);
    if (!news.note.empty()) state_.say(news.note);
    editor_.settings.live = live();
    if (live()) send_edits();
    if (editor_.scenes() == 0 || !news.snapshot) return;
    const EditSnapshot& now = editor_.snapshot();
    if (now.drawn != drawn_) {
        drawn_ = now.drawn;
        marked_ = false;
        drafted_ = nullptr;
        shown_.renders.set_scene(drawn_);
    }
    const bool any = std::ranges::any_of(*now.marks, [](uint8_t mark) { return mark != 0; });
    // A level that the file has shows no edits.
    const bool level = scene.coarse && drawn_ == entered_ && !any && !marked_;
    if (!level && now.draft.splats != drafted_)
        shown_.renders.set_draft({drafted_ = now.draft.splats, now.draft.rows});
    if (any || marked_) shown_.renders.set_marks(now.marks);
    marked_ = any;
}

/// Whether newer splats of a run that is followed by its files would take unsaved edits away.
bool App::keeps_edits() const {
    return editor_.scenes() > 0 && editor_.scene(0).journaled && editor_.unsaved() &&
           (editor_.scenes() > 1 || editor_.snapshot().done > 0);
}

/// A training gets the steps that it does not have yet, once one of them removes or freezes splats.
void App::send_edits() {
    const live::Update& run = *session_.live_run.update();
    const EditSnapshot& snapshot = editor_.snapshot();
    size_t& sent = editor_.settings.sent;
    if (editor_.busy() || editor_.scenes() == 0 || snapshot.scene != editor_.scene(editor_.active()).id)
        return;
    if (run.edits != std::exchange(answered_, run.edits) && !run.edit_refusal.empty()) {
        state_.say(run.edit_refusal);
        sent = std::min(sent_before_, snapshot.done);
        for (size_t i = sent; i < snapshot.done; ++i) editor_.undo();
        return;
    }
    nlohmann::json edits = nlohmann::json::array();
    bool changes = false;
    for (size_t i = sent; i < snapshot.done; ++i)
        for (const edit::Words& words : snapshot.steps[i].edits) {
            edits.push_back({words.name, words.value});
            changes = changes || !(words.name == "select" || words.name.ends_with("hide"));
        }
    if (!changes) return;
    sent_before_ = std::exchange(sent, snapshot.done);
    session_.live_run.edit(nlohmann::json{{"edits", std::move(edits)}}.dump());
}

/// The bars.
void App::draw_editor() {
    if (editor_.settings.tool != last_tool_ && editor_.settings.tool != Tool::view)
        state_.settings.tab = PanelTab::edit;
    last_tool_ = editor_.settings.tool;
    if (state_.bars_shown()) draw_bars(parts_);
}

bool App::present(ImDrawData* drawn, Image* capture) {
    int& lost = state_.loop.devices_lost;
    try {
        return screen_->presenter.draw(state_.window.framebuffer(), shown_.layers(), drawn, capture);
    } catch (const vk::DeviceLostError&) {
        if (++lost > kMostDevicesLost) throw;
    } catch (const vk::SurfaceLostKHRError&) {
        if (++lost > kMostDevicesLost) throw;
    }
    screen_.reset();
    change_text();
    state_.say("the device or surface of the window was lost and has been opened again");
    return false;
}

}  // namespace ewa::viewer
