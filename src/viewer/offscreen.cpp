// SPDX-License-Identifier: Apache-2.0
#include "viewer/offscreen.h"

#include <condition_variable>
#include <cstdlib>
#include <mutex>

#include "core/folders.h"
#include "ewa/error.h"
#include "viewer/editor/film.h"

namespace ewa::viewer {
namespace {

/// The render thread of the window, whose requests are waited for.
class Writer {
  public:
    explicit Writer(const Startup& startup)
        : look_(startup.settings.look), thread_(startup.open_device, [this] {
              const std::lock_guard lock(mutex_);
              news_ = true;
              wake_.notify_one();
          }) {
        thread_.set_scene(startup.scene.gaussians);
    }

    /// Throws what the render thread throws.
    void write(const Camera& camera, const std::filesystem::path& file) {
        thread_.ask({camera, look_, 1, false, ++serial_, file});
        for (;;) {
            {
                std::unique_lock lock(mutex_);
                wake_.wait(lock, [this] { return news_; });
                news_ = false;
            }
            const RenderThread::News news = thread_.take_news();
            if (news.failure) std::rethrow_exception(news.failure);
            if (news.picture && news.picture->request.serial == serial_) return;
        }
    }

  private:
    Look look_;
    uint64_t serial_ = 0;
    std::mutex mutex_;
    std::condition_variable wake_;
    bool news_ = false;
    RenderThread thread_;  // calls back; declared last, so that it ends first
};

}  // namespace

bool has_desktop() {
    for (const char* name : {"DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"})
        if (const char* value = std::getenv(name); value && *value) return true;
    return false;
}

void write_without_window(const Startup& startup) {
    if (startup.picture && startup.settings.comparison != Comparison::none)
        throw InputError("--compare needs a desktop session; ewa render and ewa compare do not");
    const Size size = startup.size.value_or(camera_size_or_usual(startup));
    Writer writer(startup);
    if (startup.picture) {
        const ViewCamera view(start_view(startup.scene, startup.frame, startup.size.value_or(kUsualSize)));
        writer.write(view.camera(size.width, size.height), *startup.picture);
    }
    if (!startup.film) return;
    const FilmPath film(startup.views, double(startup.settings.film_seconds));
    const int frames = film.frames(image::kFilmRate);
    core::make_folder(*startup.film);
    for (int i = 0; i < frames; ++i)
        writer.write(scene::fitted(film.frame(i, frames), size.width, size.height),
                     frame_file(*startup.film, i));
}

}  // namespace ewa::viewer
