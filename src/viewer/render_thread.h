// SPDX-License-Identifier: Apache-2.0
// Renders frames on a thread of its own, so that a slow frame never blocks input.
#pragma once
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <functional>
#include <glm/vec2.hpp>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "viewer/byte_image.h"

namespace ewa::viewer {

/// A scene with fewer splats, which is shown while the view changes.
struct Draft {
    std::shared_ptr<const Gaussians> splats;  // null: no draft
    std::shared_ptr<const std::vector<uint32_t>>
        rows;  // where they are in the scene; null: they are other splats, without marks
};

/// What a frame depends on besides splats and camera.
struct Look {
    Mode mode = Mode::color;
    std::array<float, 3> background{0, 0, 0};
    Footprint kernel = Footprint::peak;
    int sh_degree = kMaxShDegree;
    float splat_scale = 1;
    bool points = false;  // in place of the kernel
    int nearest = RenderOptions().nearest;
    std::shared_ptr<const SkyMap> sky = nullptr;  // in place of the background; null: none
    bool plain = false;                           // marks hide splats, but do not tint them
    bool operator==(const Look&) const = default;
};

/// How splats are rendered for the look.
RenderOptions options_of(const Look& look);

struct RenderRequest {
    Camera camera;  // of the size at which the frame is shown
    Look look;
    int divisor = 1;      // the frame has 1/divisor of that size
    bool coarse = false;  // of the draft, if there is one
    uint64_t serial = 0;
};

/// The use of a point under a pixel. edit: by a tool of the editor; color: also by one, which needs SurfacePoint::color.
enum class PointUse { look_at, measure, edit, color };

/// The point on the surface under a pixel.
struct SurfacePoint {
    uint64_t number = 0;  // that ask_point() returned
    PointUse use = PointUse::look_at;
    std::optional<glm::dvec3> place;  // world; empty where no splat is half opaque, or a render failed
    /// RGB of PointUse::color: that of the splats there as seen from all sides, without background and tints.
    glm::dvec3 color{0};
};

struct RenderedFrame {
    RenderRequest request;
    ByteImage picture;
    std::vector<PassTime> pass_times;
    double milliseconds = 0;  // from request to finished frame
    uint32_t skipped_nonfinite = 0, splats_drawn = 0;
    uint64_t device_bytes = 0;
    uint64_t scene = 0;  // the number that set_scene() returned
};

/// A render beside those that are shown: a frame of a film, a picture of any size, or one that is compared.
struct ExtraRequest {
    Camera camera;  // of the size of the render
    Look look = {};
    std::filesystem::path file =
        {};  // written as by `ewa render` with this extension; empty: `take` gets the render
    /// Gets RGBA on the render thread, and may throw.
    std::function<void(const std::vector<uint8_t>&)> take = {};
    std::function<void(const Image&)> take_color = {};  // in place of `take`: gets colours in floating point
    uint64_t number = 0;
};
struct ExtraDone {
    uint64_t number = 0;         // that ask_extra() returned
    std::exception_ptr failure;  // null: it is written
};

/// Opens the device that renders. The render thread calls it.
using OpenDevice = std::function<std::shared_ptr<gpu::Device>()>;

class RenderThread {
  public:
    /// on_news: called on the render thread when take_news() has something new. If the device is lost, the thread opens
    /// it again, once for each frame that fails.
    RenderThread(OpenDevice open, std::function<void()> on_news);
    ~RenderThread();

    /// Sets the scene of all frames requested from now on, without a draft. Returns the number that RenderedFrame::scene will have.
    uint64_t set_scene(std::shared_ptr<const Gaussians> gaussians);
    /// Sets the draft of the scene, for RenderRequest::coarse, until the next set_scene().
    void set_draft(Draft draft);
    /// Sets the marks of the scene's splats (Renderer::mark), until the next set_scene(). A file has no tints. null: none.
    void set_marks(std::shared_ptr<const std::vector<uint8_t>> marks);
    /// Replaces a request that waits. The frame that is being rendered is finished first.
    void ask(const RenderRequest& request);
    /// Requests the surface point at a pixel, by its median depth. News::points has it with the returned number. Each request with
    /// another use than PointUse::look_at renders at full resolution, and is answered. One with PointUse::look_at replaces a waiting one.
    uint64_t ask_point(const Camera& camera, const glm::dvec2& pixel, PointUse use);

    /// Drops waiting requests for points. The one in progress is still answered.
    void forget_points();

    /// Requests a render that leaves News::picture alone. News::extras has its end. Such renders are made in order. While both wait,
    /// each takes its turn with the frames that are shown.
    uint64_t ask_extra(ExtraRequest request);

    struct News {
        std::shared_ptr<const RenderedFrame> picture;  // the last complete frame, or null
        std::exception_ptr failure;                    // why the last request failed, if it did
        std::optional<DeviceInfo> device;              // once it is open
        std::vector<SurfacePoint> points;              // in order, since the last take_news()
        std::vector<ExtraDone> extras;                 // in order, since the last take_news()
    };
    News take_news();

  private:
    class Scene;  // what is on the device
    struct Probe {
        Camera camera;
        glm::dvec2 pixel{0};
        PointUse use = PointUse::look_at;
        uint64_t number = 0;
    };
    struct Work {
        std::shared_ptr<const Gaussians> scene;  // null: as before
        std::optional<Draft> draft;              // empty: as before
        std::optional<RenderRequest> request;
        std::optional<Probe> probe;
        std::optional<ExtraRequest> extra;
        std::optional<std::shared_ptr<const std::vector<uint8_t>>> marks;  // empty: as before
        uint64_t scene_number = 0;                                         // of the last set_scene()
    };
    void work(const std::stop_token& stop);
    bool next(const std::stop_token& stop, Work& work);
    void carry_out(Work& work);
    void fail(Work& work);
    void answer(const SurfacePoint& point);
    void report(const std::function<void(News&)>& change);

    std::function<void()> on_news_;
    std::unique_ptr<Scene> scene_;  // used by the thread only

    mutable std::mutex mutex_;
    std::condition_variable_any wake_;
    std::vector<Probe> probes_waiting_;        // in order
    std::deque<ExtraRequest> extras_waiting_;  // in order
    Work next_;                                // but for `probe` and `extra`
    uint64_t probes_ = 0, extras_ = 0;
    News news_;
    std::jthread thread_;
};

}  // namespace ewa::viewer
