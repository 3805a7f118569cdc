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
    shown_.psnr = comparing() ? shown_.quality.psnr(*navigation_.at_camera) : std::nullopt;
    const PanelFacts facts{
        .scene = scene_,
        .device = device_name_,
        .picture = renders_.shown().get(),
        .views = navigation_.views,
        .run = session_.live.update(),
        .drawing = !renders_.settled(),
        .note = message_.note,
        .image_failure =
            navigation_.at_camera ? shown_.comparison.failure_of(*navigation_.at_camera) : std::string(),
        .psnr = shown_.psnr,
        .pictures_a_second = loop_.times.rate(),
        .first_picture = loop_.times.first_frame(),
        .film = navigation_.film
                    ? std::optional(float(navigation_.film->next) / float(navigation_.film->frames))
                    : std::nullopt,
        .up = navigation_.view.up(),
        .at_camera = navigation_.at_camera,
        .width = float(panel_width()) / std::max(1e-3f, ImGui::GetIO().DisplayFramebufferScale.x),
        .over_picture = !panel_fits(),
    };
    obey(draw_panel(facts, settings_));
}

void App::obey(const PanelActions& actions) {
    if (actions.screenshot) loop_.capture = true;
    if (actions.exr) save_exr();
    if (actions.reset) navigation_.reset();
    if (actions.whole_scene) show_whole_scene();
    if (actions.open) session_.dialog.ask(*actions.open);
    if (actions.train) train();
    if (actions.frame) go_to_camera(*actions.frame);
    if (actions.command) session_.live.command(*actions.command);
    if (actions.up) navigation_.view.set_up(*actions.up);
    if (actions.save_view) {
        size_t free = 1;
        while (navigation_.find(free) != navigation_.views.end()) ++free;
        save_view(free);
    }
    if (actions.view && *actions.view < navigation_.views.size()) {
        const io::NamedView& view = navigation_.views[*actions.view];
        navigation_.go_to(view.camera, view.pivot);
    }
    if (actions.forget && *actions.forget < navigation_.views.size())
        navigation_.views.erase(navigation_.views.begin() + std::ptrdiff_t(*actions.forget));
    if (actions.film && navigation_.views.size() >= 2) start_film();
    if (actions.stop_film) navigation_.film.reset();
    if (actions.write_views) write_views();
}

void App::draw_overlays() {
    const Arrangement places = arrangement();
    navigation_.pointed_camera.reset();
    if (settings_.cameras && scene_.dataset) {
        const Camera seen = navigation_.view.camera(places.rendering.width, places.rendering.height);
        navigation_.pointed_camera = draw_cameras(
            {*scene_.dataset, seen, places.rendering, navigation_.camera_size, navigation_.at_camera});
    }
    if (comparing()) draw_comparison(settings_.comparison, places, settings_.wipe);
    const Rectangle area = picture_area();
    const std::optional<Headline> words = headline();
    if (words) draw_headline(*words, area);
    if (empty())
        if (const auto wanted = draw_open_buttons(area)) session_.dialog.ask(*wanted);
    if (session_.search.running() && draw_search(session_.search.progress(), area)) session_.search.cancel();
    if (const std::string text = banner(); !text.empty()) draw_banner(text, area);
    if (!words && message_.hinting(Clock::now()) && !panels_.help)
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
    if (navigation_.at_camera) {
        const Camera& camera = scene_.dataset->frames[size_t(*navigation_.at_camera)].camera;
        image = {camera.width, camera.height};
    }
    return arrange(comparison(), picture_area(), image);
}

/// Opens the screen, also with another size of the text.
void App::change_text() {
    if (screen_ && shown_.text_height == text_height()) return;
    shown_.text_height = text_height();
    screen_.reset();
    screen_ = std::make_unique<Screen>(system_, window_, device_name_, shown_.text_height);
    if (const auto image = shown_.comparison.image(); image && image->failure.empty())
        screen_->presenter.set_picture(Layer::image, image->picture);
    shown_.picture.reset();
    choose_picture();
    redraw(Loop::kRedraws);
}

bool App::comparing() const {
    return comparison() != Comparison::none && shown_.comparison.image_of(*navigation_.at_camera);
}

void App::load_image() {
    if (comparison() == Comparison::none) return;
    shown_.comparison.load(*navigation_.at_camera, scene_.dataset->frames[size_t(*navigation_.at_camera)],
                           arrangement().image.size(), settings_.look.background);
}

/// The PSNR is of colours, at the size of the image.
void App::measure_view() {
    const auto& shown = renders_.shown();
    if (scripted() || !comparing() || !renders_.settled() || shown->request.look.mode != Mode::color) return;
    const Frame& frame = scene_.dataset->frames[size_t(*navigation_.at_camera)];
    const auto own = scene_.appearances.find(frame.name);
    shown_.quality.measure(renders_, *navigation_.at_camera, frame, settings_.look,
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
    return ComparisonRequest{shown, shown_.comparison.image_of(*navigation_.at_camera),
                             fitted(image.size(), {0, 0, rendering.width, rendering.height}), settings_.gain};
}

/// Gives the presenter the render or its difference to the image. The last difference stays until the next is
/// ready.
void App::choose_picture() {
    const auto& shown = renders_.shown();
    if (!shown) return;
    const auto wanted = comparison_wanted();
    shown_.comparison.compare(wanted);
    std::shared_ptr<const ByteImage> picture(shown, &shown->picture);
    if (wanted) {
        if (const auto compared = shown_.comparison.compared())
            picture = std::shared_ptr<const ByteImage>(compared, &compared->difference);
        else if (shown_.difference)
            return;
    }
    shown_.difference = picture.get() != &shown->picture;
    if (picture == shown_.picture) return;
    shown_.picture = picture;
    screen_->presenter.set_picture(Layer::rendering, *picture);
}

void App::draw() {
    --loop_.redraws;
    load_image();
    const Comparison before = settings_.comparison;
    screen_->gui.begin_frame();
    if (!scripted()) draw_overlays();
    if (panel_shown()) panel();
    if (panels_.help) draw_help(panels_.help);
    if (!scripted() && message_.noting(Clock::now())) draw_note(message_.note, picture_area());
    handle_mouse();
    ImDrawData* drawn = screen_->gui.end_frame();
    if (settings_.comparison != before) redraw(Loop::kRedraws);
    choose_picture();
    measure_view();

    const bool image_ready =
        comparison() == Comparison::none || shown_.comparison.loaded(*navigation_.at_camera);
    const auto& requested = shown_.comparison.requested();
    const bool difference_ready = !requested || shown_.comparison.compared();
    const bool capture = loop_.capture && renders_.settled() && image_ready && difference_ready &&
                         !navigation_.film && !session_.saving.valid();
    Image image;
    if (!present(drawn, capture ? &image : nullptr)) {
        // A minimised window shows nothing. Otherwise the window is changing: try again soon.
        const Size size = window_.framebuffer();
        if (size.width > 0 && size.height > 0) redraw();
        return;
    }
    loop_.times.count(renders_.shown());
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
        if (++loop_.devices_lost > kMostDevicesLost) throw;
    } catch (const vk::SurfaceLostKHRError&) {
        if (++loop_.devices_lost > kMostDevicesLost) throw;
    }
    screen_.reset();
    change_text();
    say("the device or surface of the window was lost and has been opened again");
    return false;
}

void App::save(Image&& image) {
    loop_.capture = false;
    if (startup_.picture) {
        save_image(*startup_.picture, image);
        loop_.done = true;
        return;
    }
    session_.saving = std::async(std::launch::async, [this, image = std::move(image)]() -> std::string {
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
