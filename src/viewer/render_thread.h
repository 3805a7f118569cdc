// SPDX-License-Identifier: Apache-2.0
// Draws pictures beside the window's own thread, so that a slow one never holds up the input.
#pragma once
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <glm/vec2.hpp>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "viewer/picture.h"

namespace ewa::viewer {

/// What a picture depends on besides the splats and the camera.
struct Look {
    Mode mode = Mode::color;
    std::array<float, 3> background{0, 0, 0};
    Footprint kernel = Footprint::peak;
    int sh_degree = kMaxShDegree;
    float splat_scale = 1;
    bool operator==(const Look&) const = default;
};

struct PictureRequest {
    Camera camera;  // of the size that the picture will be shown at
    Look look;
    int divisor = 1;  // the picture has 1/divisor of that size
    uint64_t serial = 0;
    std::filesystem::path file;  // write it there too: what `ewa render` writes under that extension
};

struct FinishedPicture {
    PictureRequest request;
    Picture picture;
    std::vector<PassTime> pass_times;
    double milliseconds = 0;  // from request to finished picture
    uint32_t skipped_nonfinite = 0, splats_drawn = 0;
    uint64_t device_bytes = 0;
    uint64_t scene = 0;  // which set_scene() it shows
};

/// Opens the device that draws; called on the thread.
using OpenDevice = std::function<std::shared_ptr<gpu::Device>()>;

class RenderThread {
  public:
    /// on_news is called on the thread whenever news() has something new. A device that is lost is opened
    /// again, once for each picture that fails.
    RenderThread(OpenDevice open, std::function<void()> on_news);
    ~RenderThread();

    /// The scene of all pictures asked for from now on. The returned number is FinishedPicture::scene.
    uint64_t set_scene(std::shared_ptr<const Gaussians> gaussians);
    /// Takes the place of a request that waits and has no file; the picture in the making is finished first.
    void ask(const PictureRequest& request);
    /// What is at a pixel of the camera's picture: News::point, once News::points is the number returned. Of
    /// several that wait only the last is answered.
    uint64_t ask_point(const Camera& camera, const glm::dvec2& pixel);

    struct News {
        std::shared_ptr<const FinishedPicture> picture;  // the last complete one, or null
        std::exception_ptr failure;                      // why the last request failed, if it did
        std::optional<std::string> device;               // its name, once it is open
        uint64_t points = 0;                             // the last ask_point() that was answered
        std::optional<glm::dvec3> point;                 // world; nothing where no splat is half opaque
        std::vector<std::filesystem::path> written;      // files, since the last take_news()
    };
    News take_news();

  private:
    struct Probe {
        Camera camera;
        glm::dvec2 pixel{0};
        uint64_t number = 0;
    };
    struct Work {
        std::shared_ptr<const Gaussians> scene;  // null: as before
        std::optional<PictureRequest> request;
        std::optional<Probe> probe;
        uint64_t scene_number = 0;
    };
    void work();
    bool next(Work& work);
    void carry_out(const Work& work);
    void fail(const Work& work);
    void prepare(const Work& work);
    std::shared_ptr<const FinishedPicture> draw(const PictureRequest& request, uint64_t scene);
    std::optional<glm::dvec3> point_at(const Probe& probe);
    void report(const std::function<void(News&)>& change);

    OpenDevice open_;
    std::function<void()> on_news_;
    // Touched by the thread alone.
    std::shared_ptr<gpu::Device> device_;
    std::optional<Renderer> renderer_;
    std::shared_ptr<const Gaussians> scene_;
    bool scene_is_up_ = false;

    mutable std::mutex mutex_;
    std::condition_variable wake_;
    std::vector<PictureRequest> waiting_;  // in order; only the last may be without a file
    std::optional<Probe> probe_;
    std::shared_ptr<const Gaussians> next_scene_;
    uint64_t scene_number_ = 0, probes_ = 0;
    News news_;
    bool stop_ = false;
    std::thread thread_;
};

}  // namespace ewa::viewer
