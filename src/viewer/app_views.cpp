// SPDX-License-Identifier: Apache-2.0
// The dataset's cameras, saved views, and the film through them.
#include <algorithm>

#include "ewa/error.h"
#include "viewer/app.h"
#include "viewer/framing.h"

namespace ewa::viewer {

void App::go_to_camera(int frame) {
    view_.stand(dataset_view(*state_.scene.gaussians, *state_.scene.dataset, frame));
    at_camera_ = frame;
    settings_.turntable = false;
    redraw();
}

void App::go_to_nearest_camera() {
    if (!state_.scene.dataset) return say("there are no cameras; --cameras DATASET shows a dataset's");
    const Size size = window_.framebuffer();
    go_to_camera(nearest_frame(*state_.scene.dataset, view_.camera(size.width, size.height), view_.radius()));
}

void App::step_camera(int step) {
    if (!state_.scene.dataset || !at_camera_) return go_to_nearest_camera();
    const int count = int(state_.scene.dataset->frames.size());
    go_to_camera((*at_camera_ + step + count) % count);
}

void App::reset_view() {
    view_.reset();
    at_camera_ = state_.start_frame;
}

void App::change_comparison() {
    if (!state_.scene.dataset) return go_to_nearest_camera();
    settings_.comparison = Comparison((int(settings_.comparison) + 1) % 4);
    if (settings_.comparison != Comparison::none && !at_camera_) go_to_nearest_camera();
}

void App::save_view(size_t number) {
    const Size size = window_.framebuffer();
    views_.save(number, view_.camera(std::max(1, size.width), std::max(1, size.height)), view_.place().pivot);
    const std::string name = std::to_string(number);
    say("view " + name + " is saved; Shift + " + name + " goes to it");
}

void App::go_to_view(const io::NamedView& view) {
    view_.stand({view.camera, view.pivot, view_.up(), view_.radius()});
    leave_camera();
}

void App::go_to_number(size_t number) {
    if (const io::NamedView* view = views_.find(number)) return go_to_view(*view);
    const std::string name = std::to_string(number);
    say("there is no view " + name + "; Ctrl + " + name + " saves one");
}

void App::write_views() {
    try {
        const std::filesystem::path file = free_name("ewa-views", ".json");
        io::write_views(file, views_.all());
        say("wrote " + std::filesystem::absolute(file).string() + "; --views opens it");
    } catch (const RunError& error) {
        say(error.what());
    }
}

void App::start_film() {
    const Size window = window_.framebuffer();
    Film film(views_, startup_.film.value_or(free_name("ewa-film", "")),
              {std::max(1, window.width), std::max(1, window.height)}, double(settings_.film_seconds));
    std::error_code error;
    std::filesystem::create_directories(film.folder, error);
    if (error) {
        const std::string problem =
            "cannot create the folder " + film.folder.string() + ": " + error.message();
        if (startup_.film) throw RunError(problem);
        return say(problem);
    }
    settings_.turntable = false;
    leave_camera();
    film_ = std::move(film);
}

/// Asks for the next frame once the last one is written.
void App::continue_film() {
    if (film_->waits_for != 0) {
        if (!renders_.shown() || renders_.shown()->request.serial < film_->waits_for) return;
        ++film_->next;
        redraw();
    }
    if (film_->finished()) {
        say("wrote " + std::to_string(film_->frames) + " pictures to " +
            std::filesystem::absolute(film_->folder).string());
        film_.reset();
        done_ = startup_.film.has_value();
        return;
    }
    view_.stand({film_->camera(), view_.place().pivot, view_.up(), view_.radius()});
    film_->waits_for =
        renders_.write(view_.camera(film_->size.width, film_->size.height), settings_.look, film_->file());
}

}  // namespace ewa::viewer
