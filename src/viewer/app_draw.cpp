// SPDX-License-Identifier: Apache-2.0
// One frame of the window.
#include <imgui.h>

#include <algorithm>
#include <utility>

#include "ewa/error.h"
#include "viewer/app.h"

namespace ewa::viewer {
namespace {

constexpr int kMostDevicesLost = 5;  // a device that is lost more often is broken

}  // namespace

void App::panel() {
    shown_psnr_ = comparing() ? quality_.psnr(*at_camera_) : std::nullopt;
    const PanelFacts facts{
        .scene = scene_,
        .device = device_name_,
        .picture = renders_.shown().get(),
        .views = views_,
        .run = live_.update(),
        .drawing = !renders_.settled(),
        .note = message_.note,
        .image_failure = at_camera_ ? comparison_.failure_of(*at_camera_) : std::string(),
        .psnr = shown_psnr_,
        .pictures_a_second = times_.rate(),
        .first_picture = times_.first_frame(),
        .film = film_ ? std::optional(float(film_->next) / float(film_->frames)) : std::nullopt,
        .up = view_.up(),
        .at_camera = at_camera_,
        .width = float(panel_width()) / std::max(1e-3f, ImGui::GetIO().DisplayFramebufferScale.x),
        .over_picture = !panel_fits(),
    };
    obey(draw_panel(facts, settings_));
}

void App::obey(const PanelActions& actions) {
    if (actions.screenshot) capture_ = true;
    if (actions.exr) save_exr();
    if (actions.reset) reset_view();
    if (actions.whole_scene) show_whole_scene();
    if (actions.open) dialog_.ask(*actions.open);
    if (actions.train) train();
    if (actions.frame) go_to_camera(*actions.frame);
    if (actions.command) live_.command(*actions.command);
    if (actions.up) view_.set_up(*actions.up);
    if (actions.save_view) {
        size_t free = 1;
        while (find_view(free) != views_.end()) ++free;
        save_view(free);
    }
    if (actions.view && *actions.view < views_.size()) go_to_view(views_[*actions.view]);
    if (actions.forget && *actions.forget < views_.size())
        views_.erase(views_.begin() + std::ptrdiff_t(*actions.forget));
    if (actions.film && views_.size() >= 2) start_film();
    if (actions.stop_film) film_.reset();
    if (actions.write_views) write_views();
}

void App::draw_overlays() {
    const Arrangement places = arrangement();
    pointed_camera_.reset();
    if (settings_.cameras && scene_.dataset) {
        const Camera seen = view_.camera(places.rendering.width, places.rendering.height);
        pointed_camera_ = draw_cameras({*scene_.dataset, seen, places.rendering, camera_size_, at_camera_});
    }
    if (comparing()) draw_comparison(settings_.comparison, places, settings_.wipe);
    const Rectangle area = picture_area();
    const std::optional<Headline> words = headline();
    if (words) draw_headline(*words, area);
    if (empty())
        if (const auto wanted = draw_open_buttons(area)) dialog_.ask(*wanted);
    if (search_.running() && draw_search(search_.progress(), area)) search_.cancel();
    if (const std::string text = banner(); !text.empty()) draw_banner(text, area);
    if (!words && message_.hinting(Clock::now()) && !show_help_)
        draw_hint(scene_.dataset != nullptr, panel_shown(), area);
}

double App::text_height() const {
    return kTextHeight * double(window_.scale()) * double(settings_.text_scale);
}

int App::panel_width() const {
    return int(kPanelWidth * text_height());
}

bool App::panel_fits() const {
    return free_area(window_.framebuffer(), panel_width()).x > 0;
}

/// The part of the window that the panel leaves to the pictures.
Rectangle App::picture_area() const {
    return free_area(window_.framebuffer(), panel_shown() ? panel_width() : 0);
}

Arrangement App::arrangement() const {
    Size image{1, 1};
    if (at_camera_) {
        const Camera& camera = scene_.dataset->frames[size_t(*at_camera_)].camera;
        image = {camera.width, camera.height};
    }
    return arrange(comparison(), picture_area(), image);
}

/// Opens the screen, also with another size of the text.
void App::change_text() {
    if (screen_ && shown_text_ == text_height()) return;
    shown_text_ = text_height();
    screen_.reset();
    screen_ = std::make_unique<Screen>(system_, window_, device_name_, shown_text_);
    if (const auto image = comparison_.image(); image && image->failure.empty())
        screen_->presenter.set_picture(Layer::image, image->picture);
    on_screen_.reset();
    choose_picture();
    redraw(kRedraws);
}

bool App::comparing() const {
    return comparison() != Comparison::none && comparison_.image_of(*at_camera_);
}

void App::load_image() {
    if (comparison() == Comparison::none) return;
    comparison_.load(*at_camera_, scene_.dataset->frames[size_t(*at_camera_)], arrangement().image.size(),
                     settings_.look.background);
}

/// The PSNR is of colours, at the size of the image.
void App::measure_view() {
    const auto& shown = renders_.shown();
    if (scripted() || !comparing() || !renders_.settled() || shown->request.look.mode != Mode::color) return;
    const Frame& frame = scene_.dataset->frames[size_t(*at_camera_)];
    const auto own = scene_.appearances.find(frame.name);
    quality_.measure(renders_, *at_camera_, frame, settings_.look,
                     own == scene_.appearances.end() ? scene_.of_new_views : own->second);
}

/// The full frame can be compared if it shows colours from the camera of the image.
std::optional<ComparisonRequest> App::comparison_wanted() const {
    const auto& shown = renders_.shown();
    if (settings_.comparison != Comparison::difference || !comparing() || !renders_.settled() ||
        shown->request.look.mode != Mode::color)
        return std::nullopt;
    const Rectangle rendering = arrangement().rendering, image = arrangement().image;
    if (shown->picture.width != rendering.width || shown->picture.height != rendering.height)
        return std::nullopt;
    return ComparisonRequest{shown, comparison_.image_of(*at_camera_),
                             fitted(image.size(), {0, 0, rendering.width, rendering.height}), settings_.gain};
}

/// Gives the presenter the render or its difference to the image. The last difference stays until the next is
/// ready.
void App::choose_picture() {
    const auto& shown = renders_.shown();
    if (!shown) return;
    const auto wanted = comparison_wanted();
    comparison_.compare(wanted);
    std::shared_ptr<const ByteImage> picture(shown, &shown->picture);
    if (wanted) {
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
    if (!scripted()) draw_overlays();
    if (panel_shown()) panel();
    if (show_help_) draw_help(show_help_);
    if (!scripted() && message_.noting(Clock::now())) draw_note(message_.note, picture_area());
    handle_mouse();
    ImDrawData* drawn = screen_->gui.end_frame();
    if (settings_.comparison != before) redraw(kRedraws);
    choose_picture();
    measure_view();

    const bool image_ready = comparison() == Comparison::none || comparison_.loaded(*at_camera_);
    const auto& requested = comparison_.requested();
    const bool difference_ready = !requested || comparison_.compared();
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
    if (capture) save(without_left(image, picture_area().x));
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
    change_text();
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
    if (const auto camera = requested_camera())
        renders_.write(*camera, settings_.look, free_name("ewa-view", ".exr"));
}

}  // namespace ewa::viewer
