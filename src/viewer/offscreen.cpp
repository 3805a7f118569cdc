// SPDX-License-Identifier: Apache-2.0
#include "viewer/offscreen.h"

#include <condition_variable>
#include <cstdlib>
#include <exception>
#include <mutex>

#include "core/folders.h"
#include "ewa/error.h"
#include "viewer/editor/film.h"

namespace ewa::viewer {

void write_without_window(const Startup& startup) {
    if (!startup.picture.empty() && startup.settings.comparison != Comparison::none)
        throw InputError("--compare needs a desktop session; ewa render and ewa compare do not");
    const Size size = startup.size.value_or(camera_size_or_usual(startup));
    // No std::atomic: that of MinGW misses notifications.
    std::mutex mutex;
    std::condition_variable came;
    uint64_t news = 0;
    RenderThread thread(startup.open_device, [&] {
        const std::lock_guard lock(mutex);
        ++news;
        came.notify_one();
    });
    thread.set_scene(startup.scene.gaussians);
    uint64_t asked = 0;
    const auto write = [&](const Camera& camera, const std::filesystem::path& file) {
        asked = thread.ask_extra({.camera = camera, .look = startup.settings.look, .file = file});
    };
    if (!startup.picture.empty()) {
        const ViewCamera view(start_view(startup.scene, startup.frame, startup.size.value_or(kUsualSize)));
        write(view.camera(size.width, size.height), startup.picture);
    }
    if (!startup.film.empty()) {
        const FilmPath film(startup.views, double(startup.settings.film_seconds));
        const int frames = film.frames(image::kFilmRate);
        core::make_folder(startup.film);
        for (int i = 0; i < frames; ++i)
            write(scene::fitted(film.frame(i, frames), size.width, size.height), frame_file(startup.film, i));
    }
    for (uint64_t seen = 0, done = 0; done < asked;) {
        {
            std::unique_lock lock(mutex);
            came.wait(lock, [&] { return news != seen; });
            seen = news;
        }
        for (const ExtraDone& one : thread.take_news().extras) {
            if (one.failure) std::rethrow_exception(one.failure);
            ++done;
        }
    }
}

}  // namespace ewa::viewer
