// SPDX-License-Identifier: Apache-2.0
// A frame of the window.
#include <imgui.h>

#include <algorithm>
#include <utility>

#include "ewa/error.h"
#include "viewer/app.h"
#include "viewer/overlay.h"

namespace ewa::viewer {
namespace {

constexpr int kMostDevicesLost = 5;  // one that is lost again and again is broken

}  // namespace

void App::panel() {
    PanelFacts facts;
    facts.title = scene_.title;
    facts.device = device_name_;
    facts.splats = scene_.gaussians->size();
    facts.scene_sh_degree = scene_sh_degree_;
    facts.dataset = scene_.dataset.get();
    facts.picture = shown_.get();
    facts.plan = &plan_;
    facts.views = &views_;
    facts.drawing = !settled();
    facts.note = note_;
    if (photo_ && stands_at_ && photo_->frame == *stands_at_) facts.photo_failure = photo_->failure;
    if (comparing() && compared()) facts.psnr = compared_->psnr;
    const std::chrono::duration<double> now = Clock::now() - startup_.started;
    facts.pictures_a_second = fluency_.rate(now.count());
    facts.first_picture = first_picture_;
    if (film_) {
        facts.film_frame = film_->next;
        facts.film_frames = film_->frames;
    }
    if (watcher_) facts.run = &run_;
    facts.up = view_.up();
    facts.stands_at = stands_at_;
    const PanelActions actions = draw_panel(facts, settings_);
    panel_right_ = int(actions.right * ImGui::GetIO().DisplayFramebufferScale.x);
    obey(actions);
}

void App::obey(const PanelActions& actions) {
    if (actions.screenshot) capture_ = true;
    if (actions.exr) save_exr();
    if (actions.reset) {
        view_.reset();
        stands_at_ = start_frame_;
    }
    if (actions.frame) go_to_camera(*actions.frame);
    if (actions.command && watcher_) watcher_->command(*actions.command);
    if (actions.up) view_.set_up(*actions.up);
    if (actions.save_view) {
        size_t number = 1;
        while (std::any_of(views_.begin(), views_.end(),
                           [&](const io::NamedView& view) { return view.name == std::to_string(number); }))
            ++number;
        save_view(number);
    }
    if (actions.view && *actions.view < views_.size()) {
        const io::NamedView& view = views_[*actions.view];
        view_.stand({view.camera, view.pivot, view_.up(), view_.radius()});
        leave_camera();
    }
    if (actions.forget && *actions.forget < views_.size())
        views_.erase(views_.begin() + std::ptrdiff_t(*actions.forget));
    if (actions.film && views_.size() >= 2) start_film();
    if (actions.stop_film) film_.reset();
    if (!actions.write_views) return;
    try {
        const std::filesystem::path file = free_name("ewa-views", ".json");
        io::write_views(file, views_);
        say("wrote " + std::filesystem::absolute(file).string() + "; --views opens it");
    } catch (const RunError& error) {
        say(error.what());
    }
}

void App::overlays() {
    const Arrangement places = arrangement();
    pointed_camera_.reset();
    if (settings_.cameras && scene_.dataset) {
        const Camera seen = view_.camera(places.rendering.width, places.rendering.height);
        pointed_camera_ = draw_cameras({*scene_.dataset, seen, places.rendering, camera_size_, stands_at_});
    }
    if (comparing()) draw_comparison(settings_.comparison, places, settings_.wipe);
    if (Clock::now() < hint_until_ && !show_help_) draw_hint(scene_.dataset != nullptr);
}

void App::draw() {
    --redraws_;
    ask_for_photo();
    const Comparison before = settings_.comparison;
    screen_->gui.begin_frame();
    if (!scripted()) overlays();
    const int covered = std::exchange(panel_right_, 0);
    if (show_panel_ && !scripted()) panel();
    if (panel_right_ != covered) redraws_ = std::max(redraws_, 1);
    if (show_help_) draw_help(show_help_);
    if (!scripted() && Clock::now() < note_until_) draw_note(note_);
    handle_mouse();
    ImDrawData* drawn = screen_->gui.end_frame();
    if (settings_.comparison != before) redraws_ = std::max(redraws_, kRedraws);
    choose_picture();

    const bool photo_ready = settings_.comparison == Comparison::none || !stands_at_ || comparing() ||
                             (photo_ && photo_->frame == *stands_at_);
    const bool difference_ready = !comparison_asked_ || comparison_asked_->gain == 0 || compared();
    const bool capture =
        capture_ && settled() && photo_ready && difference_ready && !film_ && !saving_.valid();
    Image image;
    if (!present(drawn, capture ? &image : nullptr)) {
        // Nothing can be shown while minimised; otherwise the window is just changing, and the next try is
        // soon.
        const Size size = window_.framebuffer();
        if (size.width > 0 && size.height > 0) redraws_ = std::max(redraws_, 1);
        return;
    }
    count_picture();
    if (capture) save(std::move(image));
}

bool App::present(ImDrawData* drawn, Image* capture) {
    const Arrangement places = arrangement();
    std::vector<Layer> layers;
    if (shown_) {
        // The last picture may have been made for another size: it keeps its shape until the next one is
        // there.
        const Camera& camera = shown_->request.camera;
        layers.push_back({Layer::rendering, fitted({camera.width, camera.height}, places.rendering)});
    }
    if (comparing() && settings_.comparison == Comparison::beside)
        layers.push_back({Layer::photograph, places.photograph});
    if (comparing() && settings_.comparison == Comparison::wipe) {
        Rectangle part = places.photograph;
        part.width = int(float(part.width) * settings_.wipe + 0.5f);
        layers.push_back({Layer::photograph, part, 0, double(part.width) / places.photograph.width});
    }
    try {
        return screen_->presenter.draw(window_.framebuffer(), layers, drawn, capture);
    } catch (const vk::DeviceLostError&) {
        if (++devices_lost_ > kMostDevicesLost) throw;
    } catch (const vk::SurfaceLostKHRError&) {
        if (++devices_lost_ > kMostDevicesLost) throw;
    }
    screen_.reset();
    screen_ = std::make_unique<Screen>(system_, window_, device_name_);
    if (photo_ && photo_->failure.empty()) screen_->presenter.set_picture(Layer::photograph, photo_->picture);
    on_screen_.reset();
    choose_picture();
    say("the device that shows the window, or its place on the screen, was lost and has been opened again");
    return false;
}

void App::save(Image&& image) {
    capture_ = false;
    if (startup_.picture) {
        save_image(*startup_.picture, image);
        done_ = true;
        return;
    }
    saving_ = std::async(std::launch::async, [this, image = std::move(image)]() -> std::string {
        const Wake wake{system_};
        try {
            const std::filesystem::path path = free_name("ewa-view", ".png");
            save_image(path, image);
            return "wrote " + std::filesystem::absolute(path).string();
        } catch (const std::exception& error) {
            return error.what();
        }
    });
}

/// The rendering alone, in floating point, drawn and written by the thread.
void App::save_exr() {
    const Size size = window_.framebuffer();
    if (size.width == 0 || size.height == 0 || film_) return;
    asked_ = wanted();
    asked_.file = free_name("ewa-view", ".exr");
    asked_scene_ = scene_number_;
    thread_.ask(asked_);
}

}  // namespace ewa::viewer
