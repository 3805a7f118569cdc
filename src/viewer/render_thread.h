// SPDX-License-Identifier: Apache-2.0
// Draws pictures beside the window's own thread, so that a slow one never holds up the input.
#pragma once
#include <condition_variable>
#include <functional>
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
    Kernel kernel = Kernel::peak;
    int sh_degree = kMaxShDegree;
    bool operator==(const Look&) const = default;
};

struct PictureRequest {
    Camera camera;  // of the size that the picture will be shown at
    Look look;
    int divisor = 1;  // the picture has 1/divisor of that size
    uint64_t serial = 0;
};

struct FinishedPicture {
    PictureRequest request;
    Picture picture;
    std::vector<PassTime> pass_times;
    double milliseconds = 0;  // from request to finished picture
    uint32_t skipped_nonfinite = 0;
};

class RenderThread {
  public:
    /// on_news is called on the thread whenever news() has something new. `gaussians` outlives the thread.
    RenderThread(std::shared_ptr<gpu::Device> device, const Gaussians& gaussians,
                 std::function<void()> on_news);
    ~RenderThread();

    /// Takes the place of a request that waits; the picture in the making is finished first.
    void ask(const PictureRequest& request);

    /// The last complete picture, or null; and why the last request failed, if it did.
    struct News {
        std::shared_ptr<const FinishedPicture> picture;
        std::exception_ptr failure;
    };
    News news() const;

  private:
    void work();
    std::shared_ptr<const FinishedPicture> draw(const PictureRequest& request);

    std::shared_ptr<gpu::Device> device_;
    const Gaussians& gaussians_;
    std::function<void()> on_news_;
    std::optional<Renderer> renderer_;  // for renderer_options_; touched by the thread alone
    RenderOptions renderer_options_;

    mutable std::mutex mutex_;
    std::condition_variable wake_;
    std::optional<PictureRequest> waiting_;
    News news_;
    bool stop_ = false;
    std::thread thread_;
};

}  // namespace ewa::viewer
