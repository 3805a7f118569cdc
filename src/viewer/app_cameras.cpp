// SPDX-License-Identifier: Apache-2.0
// The dataset's cameras and their photographs, saved views, and the film through them.
#include <algorithm>

#include "ewa/error.h"
#include "viewer/app.h"
#include "viewer/framing.h"

namespace ewa::viewer {

void App::go_to_camera(int frame) {
    view_.stand(dataset_view(*scene_.gaussians, *scene_.dataset, frame));
    stands_at_ = frame;
    settings_.turntable = false;
    redraws_ = std::max(redraws_, 1);
}

void App::go_to_nearest_camera() {
    if (!scene_.dataset) return say("there are no cameras; --cameras DATASET shows a dataset's");
    const Size size = window_.framebuffer();
    go_to_camera(nearest_frame(*scene_.dataset, view_.camera(size.width, size.height), view_.radius()));
}

void App::step_camera(int step) {
    if (!scene_.dataset || !stands_at_) return go_to_nearest_camera();
    const int count = int(scene_.dataset->frames.size());
    go_to_camera((*stands_at_ + step + count) % count);
}

void App::change_comparison() {
    if (!scene_.dataset) return go_to_nearest_camera();
    settings_.comparison = Comparison((int(settings_.comparison) + 1) % 4);
    if (settings_.comparison != Comparison::none && !stands_at_) go_to_nearest_camera();
}

bool App::comparing() const {
    return settings_.comparison != Comparison::none && stands_at_ && photo_ && photo_->frame == *stands_at_ &&
           photo_->failure.empty();
}

Arrangement App::arrangement() const {
    const Comparison comparison = stands_at_ ? settings_.comparison : Comparison::none;
    Size photo{1, 1};
    if (stands_at_) {
        const Camera& camera = scene_.dataset->frames[size_t(*stands_at_)].camera;
        photo = {camera.width, camera.height};
    }
    const Size window = window_.framebuffer();
    return arrange(comparison, {std::max(1, window.width), std::max(1, window.height)}, photo, panel_right_);
}

/// Anew where the place has outgrown what was read for it, or transparent parts show another background.
void App::ask_for_photo() {
    if (settings_.comparison == Comparison::none || !stands_at_) return;
    const Rectangle place = arrangement().photograph;
    if (photo_asked_ && photo_asked_->index == *stands_at_ && place.width <= 2 * photo_asked_->size.width &&
        photo_asked_->background == settings_.look.background)
        return;
    photo_asked_ = PhotoRequest{opened_, *stands_at_, scene_.dataset->frames[size_t(*stands_at_)],
                                Size{place.width, place.height}, settings_.look.background};
    photos_.ask(*photo_asked_);
}

/// Of the full picture, from where the photograph was taken.
std::optional<ComparisonRequest> App::comparison_wanted() const {
    if (!comparing() || !settled() || shown_->request.look.mode != Mode::color) return std::nullopt;
    const Rectangle rendering = arrangement().rendering, photograph = arrangement().photograph;
    if (shown_->picture.width != rendering.width || shown_->picture.height != rendering.height)
        return std::nullopt;
    const bool difference = settings_.comparison == Comparison::difference;
    return ComparisonRequest{
        shown_, photo_,
        fitted({photograph.width, photograph.height}, {0, 0, rendering.width, rendering.height}),
        difference ? settings_.gain : 0};
}

bool App::compared() const {
    return compared_ && comparison_asked_ && compared_->of == *comparison_asked_;
}

/// What the window shows of the rendering: itself, or its difference to the photograph. The last difference
/// stays until the next one is there.
void App::choose_picture() {
    if (!shown_) return;
    const auto wanted = comparison_wanted();
    if (wanted && comparison_asked_ != wanted) comparisons_.ask(*wanted);
    comparison_asked_ = wanted;
    std::shared_ptr<const Picture> picture(shown_, &shown_->picture);
    if (wanted && wanted->gain > 0) {
        if (compared())
            picture = std::shared_ptr<const Picture>(compared_, &compared_->difference);
        else if (difference_on_screen_)
            return;
    }
    difference_on_screen_ = picture.get() != &shown_->picture;
    if (picture == on_screen_) return;
    on_screen_ = picture;
    screen_->presenter.set_picture(Layer::rendering, *picture);
}

void App::save_view(size_t number) {
    const Size size = window_.framebuffer();
    const Viewpoint place = view_.place();
    io::NamedView view{std::to_string(number),
                       view_.camera(std::max(1, size.width), std::max(1, size.height)), place.pivot};
    const auto same = std::find_if(views_.begin(), views_.end(),
                                   [&](const io::NamedView& other) { return other.name == view.name; });
    if (same != views_.end())
        *same = view;
    else
        views_.push_back(view);
    say("view " + view.name + " is kept; Shift + " + view.name + " goes to it");
}

void App::go_to_view(size_t number) {
    const auto found = std::find_if(views_.begin(), views_.end(), [&](const io::NamedView& view) {
        return view.name == std::to_string(number);
    });
    if (found == views_.end())
        return say("there is no view " + std::to_string(number) + "; Ctrl + " + std::to_string(number) +
                   " keeps one");
    view_.stand({found->camera, found->pivot, view_.up(), view_.radius()});
    leave_camera();
}

void App::start_film() {
    Film film;
    for (const io::NamedView& view : views_) film.keys.push_back(view.camera);
    film.folder = startup_.film.value_or(free_name("ewa-film", ""));
    const Size window = window_.framebuffer();
    film.size = {std::max(1, window.width), std::max(1, window.height)};
    film.frames = Film::frames_for(film.keys.size(), double(settings_.film_seconds));
    std::error_code error;
    std::filesystem::create_directories(film.folder, error);
    if (error) {
        const std::string problem = "cannot make the folder " + film.folder.string() + ": " + error.message();
        if (startup_.film) throw RunError(problem);
        return say(problem);
    }
    settings_.turntable = false;
    leave_camera();
    film_ = std::move(film);
}

/// One picture at a time is asked for; the thread draws and writes it.
void App::film() {
    if (film_->waits_for != 0) {
        if (!shown_ || shown_->request.serial < film_->waits_for) return;
        ++film_->next;
        redraws_ = std::max(redraws_, 1);
    }
    if (film_->finished()) {
        say("wrote " + std::to_string(film_->frames) + " pictures to " +
            std::filesystem::absolute(film_->folder).string());
        film_.reset();
        done_ = startup_.film.has_value();
        return;
    }
    view_.stand({film_->camera(), view_.place().pivot, view_.up(), view_.radius()});
    asked_ = {view_.camera(film_->size.width, film_->size.height), settings_.look, 1, asked_.serial + 1,
              film_->file()};
    asked_scene_ = scene_number_;
    film_->waits_for = asked_.serial;
    thread_.ask(asked_);
}

}  // namespace ewa::viewer
