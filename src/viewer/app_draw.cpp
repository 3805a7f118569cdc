// SPDX-License-Identifier: Apache-2.0
// One frame of the window.
#include <imgui.h>

#include <algorithm>
#include <utility>

#include "ewa/error.h"
#include "viewer/app.h"
#include "viewer/overlay.h"

namespace ewa::viewer {
namespace {

constexpr int kMostDevicesLost = 5;  // a device that is lost more often is broken

}  // namespace

void App::panel() {
    PanelFacts facts;
    facts.title = state_.scene.title;
    facts.device = device_name_;
    facts.splats = state_.scene.gaussians->size();
    facts.scene_sh_degree = state_.sh_degree;
    facts.dataset = state_.scene.dataset.get();
    facts.picture = renders_.shown().get();
    facts.plan = &state_.plan;
    facts.views = &views_.all();
    facts.drawing = !renders_.settled();
    facts.note = message_.note;
    if (at_camera_) facts.image_failure = comparison_.failure_of(*at_camera_);
    if (comparing() && comparison_.compared()) facts.psnr = comparison_.compared()->psnr;
    facts.pictures_a_second = times_.rate();
    facts.first_picture = times_.first_frame();
    if (film_) {
        facts.film_frame = film_->next;
        facts.film_frames = film_->frames;
    }
    facts.run = live_.update();
    facts.up = view_.up();
    facts.at_camera = at_camera_;
    const PanelActions actions = draw_panel(facts, settings_);
    panel_right_ = int(actions.right * ImGui::GetIO().DisplayFramebufferScale.x);
    obey(actions);
}

void App::obey(const PanelActions& actions) {
    if (actions.screenshot) capture_ = true;
    if (actions.exr) save_exr();
    if (actions.reset) reset_view();
    if (actions.frame) go_to_camera(*actions.frame);
    if (actions.command) live_.command(*actions.command);
    if (actions.up) view_.set_up(*actions.up);
    if (actions.save_view) save_view(views_.free_number());
    if (actions.view && *actions.view < views_.size()) go_to_view(views_.all()[*actions.view]);
    if (actions.forget) views_.erase(*actions.forget);
    if (actions.film && views_.size() >= 2) start_film();
    if (actions.stop_film) film_.reset();
    if (actions.write_views) write_views();
}

void App::overlays() {
    const Arrangement places = arrangement();
    pointed_camera_.reset();
    if (settings_.cameras && state_.scene.dataset) {
        const Camera seen = view_.camera(places.rendering.width, places.rendering.height);
        pointed_camera_ =
            draw_cameras({*state_.scene.dataset, seen, places.rendering, state_.camera_size, at_camera_});
    }
    if (comparing()) draw_comparison(settings_.comparison, places, settings_.wipe);
    if (Clock::now() < message_.hint_until && !show_help_) draw_hint(state_.scene.dataset != nullptr);
}

Arrangement App::arrangement() const {
    const Comparison comparison = at_camera_ ? settings_.comparison : Comparison::none;
    Size image{1, 1};
    if (at_camera_) {
        const Camera& camera = state_.scene.dataset->frames[size_t(*at_camera_)].camera;
        image = {camera.width, camera.height};
    }
    const Size window = window_.framebuffer();
    return arrange(comparison, {std::max(1, window.width), std::max(1, window.height)}, image, panel_right_);
}

bool App::comparing() const {
    return settings_.comparison != Comparison::none && at_camera_ && comparison_.image_of(*at_camera_);
}

void App::load_image() {
    if (settings_.comparison == Comparison::none || !at_camera_) return;
    const Rectangle place = arrangement().image;
    comparison_.load(*at_camera_, state_.scene.dataset->frames[size_t(*at_camera_)],
                     {place.width, place.height}, settings_.look.background);
}

/// The full frame can be compared if it shows colours from the camera of the image.
std::optional<ComparisonRequest> App::comparison_wanted() const {
    const auto& shown = renders_.shown();
    if (!comparing() || !renders_.settled() || shown->request.look.mode != Mode::color) return std::nullopt;
    const Rectangle rendering = arrangement().rendering, image = arrangement().image;
    if (shown->picture.width != rendering.width || shown->picture.height != rendering.height)
        return std::nullopt;
    const bool difference = settings_.comparison == Comparison::difference;
    return ComparisonRequest{shown, comparison_.image_of(*at_camera_),
                             fitted({image.width, image.height}, {0, 0, rendering.width, rendering.height}),
                             difference ? settings_.gain : 0};
}

/// Gives the presenter the render or its difference to the image. The last difference stays until the next is
/// ready.
void App::choose_picture() {
    const auto& shown = renders_.shown();
    if (!shown) return;
    const auto wanted = comparison_wanted();
    comparison_.compare(wanted);
    std::shared_ptr<const ByteImage> picture(shown, &shown->picture);
    if (wanted && wanted->gain > 0) {
        if (const auto compared = comparison_.compared())
            picture = std::shared_ptr<const ByteImage>(compared, &compared->difference);
        else if (difference_on_screen_)
            return;
    }
    difference_on_screen_ = picture.get() != &shown->picture;
    if (picture == on_screen_) return;
    on_screen_ = picture;
    screen_->presenter.set_picture(Layer::rendering, *picture);
}

void App::draw() {
    --redraws_;
    load_image();
    const Comparison before = settings_.comparison;
    screen_->gui.begin_frame();
    if (!scripted()) overlays();
    const int covered = std::exchange(panel_right_, 0);
    if (show_panel_ && !scripted()) panel();
    if (panel_right_ != covered) redraw();
    if (show_help_) draw_help(show_help_);
    if (!scripted() && Clock::now() < message_.note_until) draw_note(message_.note);
    handle_mouse();
    ImDrawData* drawn = screen_->gui.end_frame();
    if (settings_.comparison != before) redraw(kRedraws);
    choose_picture();

    const bool image_ready =
        settings_.comparison == Comparison::none || !at_camera_ || comparison_.loaded(*at_camera_);
    const auto& requested = comparison_.requested();
    const bool difference_ready = !requested || requested->gain == 0 || comparison_.compared();
    const bool capture =
        capture_ && renders_.settled() && image_ready && difference_ready && !film_ && !saving_.valid();
    Image image;
    if (!present(drawn, capture ? &image : nullptr)) {
        // A minimised window shows nothing. Otherwise the window is changing: try again soon.
        const Size size = window_.framebuffer();
        if (size.width > 0 && size.height > 0) redraw();
        return;
    }
    times_.count(renders_.shown());
    if (capture) save(std::move(image));
}

bool App::present(ImDrawData* drawn, Image* capture) {
    const Arrangement places = arrangement();
    std::vector<Layer> layers;
    if (renders_.shown()) {
        // The last frame may have another size. It keeps its shape until the next one is ready.
        const Camera& camera = renders_.shown()->request.camera;
        layers.push_back({Layer::rendering, fitted({camera.width, camera.height}, places.rendering)});
    }
    if (comparing() && settings_.comparison == Comparison::beside)
        layers.push_back({Layer::image, places.image});
    if (comparing() && settings_.comparison == Comparison::wipe) {
        Rectangle part = places.image;
        part.width = int(float(part.width) * settings_.wipe + 0.5f);
        layers.push_back({Layer::image, part, 0, double(part.width) / places.image.width});
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
    if (const auto image = comparison_.image(); image && image->failure.empty())
        screen_->presenter.set_picture(Layer::image, image->picture);
    on_screen_.reset();
    choose_picture();
    say("the device or surface of the window was lost and has been opened again");
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

/// Writes the render alone, in floating point.
void App::save_exr() {
    const Size size = window_.framebuffer();
    if (size.width == 0 || size.height == 0 || film_) return;
    const Rectangle place = arrangement().rendering;
    renders_.write(view_.camera(place.width, place.height), settings_.look, free_name("ewa-view", ".exr"));
}

}  // namespace ewa::viewer
