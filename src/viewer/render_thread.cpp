// SPDX-License-Identifier: Apache-2.0
#include "viewer/render_thread.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "scene/frustum.h"

namespace ewa::viewer {
namespace {

constexpr int kProbeSide = 256;  // px of the depth image that a point is read from

/// The values that the renderer computes for a mode.
Drawing drawing_for(Mode mode) {
    if (mode == Mode::depth) return Drawing::depth;
    if (mode == Mode::count) return Drawing::count;
    if (mode == Mode::median_depth) return Drawing::median_depth;
    if (mode == Mode::normal) return Drawing::normal;
    return mode == Mode::ellipsoids ? Drawing::ellipsoids : Drawing::color;
}

/// plain: without tints. values: gets what the picture is made of; null: nobody wants that.
ByteImage drawn(Renderer& renderer, const Camera& camera, const Look& look, bool plain,
                Rendering* values = nullptr) {
    DrawOptions options{options_of(look), drawing_for(look.mode), double(look.splat_scale)};
    options.plain_colors = plain;
    if (!values && (look.mode == Mode::color || look.mode == Mode::ellipsoids))
        return {camera.width, camera.height, renderer.render_bytes(camera, options), 0};
    Rendering rendering = renderer.render(camera, options);
    ByteImage picture = picture_of(rendering, look.mode);
    if (values) *values = std::move(rendering);
    return picture;
}

/// Writes a file as `ewa render` does: EXR holds the values with alpha, PNG what the window shows.
void save(const std::filesystem::path& file, const Rendering& rendering, const ByteImage& picture,
          Mode mode) {
    const bool exr = file.extension() == ".exr";
    if (exr && mode == Mode::depth) return save_image(file, rendering.depth);
    if (exr && mode == Mode::count) return save_image(file, rendering.count);
    if (exr && mode == Mode::opacity) return save_image(file, rendering.alpha);
    if (exr && mode == Mode::median_depth) return save_image(file, rendering.median_depth);
    if (exr && mode == Mode::normal) return save_image(file, rendering.normal);
    if (exr) return save_image(file, with_alpha(rendering.color, rendering.alpha));
    Image image(picture.width, picture.height, 3);
    for (size_t i = 0; i < image.pixels.size(); ++i)
        image.pixels[i] = float(picture.rgba[i / 3 * 4 + i % 3]) / 255.0f;
    save_image(file, image);
}

}  // namespace

RenderOptions options_of(const Look& look) {
    RenderOptions options{look.background, look.kernel, look.sh_degree};
    // Spheres have no surfaces of splats.
    options.points = look.points && look.mode != Mode::median_depth && look.mode != Mode::normal;
    options.nearest = look.nearest;
    options.sky = look.sky;
    return options;
}

/// The splats that are shown, and their renderers.
class RenderThread::Scene {
  public:
    explicit Scene(OpenDevice open) : open_(std::move(open)) {}

    void set(std::shared_ptr<const Gaussians> scene) {
        scene_ = std::move(scene);
        draft_ = {};
        is_up_ = false;
        marks_ = nullptr;
    }
    void set_draft(Draft draft) {
        draft_ = std::move(draft);
        draft_is_up_ = marks_are_up_ = false;
    }
    void mark(std::shared_ptr<const std::vector<uint8_t>> marks) {
        marks_ = std::move(marks);
        marks_are_up_ = false;
    }
    /// Whether the device was not open before.
    bool open();
    DeviceInfo device() const { return device_info(*device_); }
    /// False if there are no splats to draw.
    bool bring_up();
    /// Frees everything on the device.
    void close();

    std::shared_ptr<const RenderedFrame> draw(const RenderRequest& request, uint64_t scene);
    /// Returns why the render could not be written or taken, or null.
    std::exception_ptr draw_extra(const ExtraRequest& request);
    SurfacePoint point_at(const Probe& probe);

  private:
    void put(const Gaussians& scene, std::optional<Renderer>& renderer);
    void upload(bool densities);
    void upload_draft();
    void put_marks();
    void fit_to(const Look& look);

    OpenDevice open_;
    std::shared_ptr<gpu::Device> device_;
    std::optional<Renderer> renderer_, draft_renderer_;
    std::shared_ptr<const Gaussians> scene_;
    Draft draft_;
    std::shared_ptr<const std::vector<uint8_t>> marks_;  // of scene_; null: none
    bool is_up_ = false, draft_is_up_ = false, marks_are_up_ = true;
    bool densities_are_up_ = false;  // the scene has opacities of Footprint::density
};

bool RenderThread::Scene::open() {
    if (device_) return false;
    renderer_.reset();
    draft_renderer_.reset();
    device_ = open_();
    return true;
}

bool RenderThread::Scene::bring_up() {
    if (scene_ && !is_up_) upload(scene_->density);
    if (scene_ && !draft_is_up_) upload_draft();
    return renderer_.has_value();
}

void RenderThread::Scene::close() {
    renderer_.reset();
    draft_renderer_.reset();
    device_.reset();
    is_up_ = false;
}

/// Uploads splats, with opacities of Footprint::density or without.
void RenderThread::Scene::put(const Gaussians& scene, std::optional<Renderer>& renderer) {
    std::optional<Gaussians> fitted;
    if (scene.density != densities_are_up_) fit_opacities(fitted.emplace(scene), densities_are_up_);
    const Gaussians& splats = fitted ? *fitted : scene;
    if (renderer)
        renderer->replace(splats);
    else
        renderer.emplace(device_, splats, RenderOptions{});
    marks_are_up_ = !marks_;
}

void RenderThread::Scene::upload(bool densities) {
    is_up_ = draft_is_up_ = false;
    densities_are_up_ = densities;
    put(*scene_, renderer_);
    is_up_ = true;
}

void RenderThread::Scene::upload_draft() {
    if (draft_.splats)
        put(*draft_.splats, draft_renderer_);
    else
        draft_renderer_.reset();
    draft_is_up_ = true;
}

void RenderThread::Scene::put_marks() {
    if (std::exchange(marks_are_up_, true)) return;
    const bool fit = marks_ && marks_->size() == scene_->size();
    renderer_->mark(fit ? std::span<const uint8_t>(*marks_) : std::span<const uint8_t>());
    if (!draft_renderer_) return;
    std::vector<uint8_t> marks;
    if (fit && draft_.rows)
        for (const uint32_t row : *draft_.rows) marks.push_back((*marks_)[row]);
    draft_renderer_->mark(marks);
}

/// Opacities are those of the kernel, so that a scene looks about the same with all kernels.
void RenderThread::Scene::fit_to(const Look& look) {
    const bool densities = look.kernel == Footprint::density;
    if (!look.points && densities != densities_are_up_) upload(densities);
    if (!draft_is_up_) upload_draft();
    put_marks();
}

std::shared_ptr<const RenderedFrame> RenderThread::Scene::draw(const RenderRequest& request, uint64_t scene) {
    const auto start = std::chrono::steady_clock::now();
    const Look& look = request.look;
    const Camera camera = downscale(request.camera, request.divisor);
    fit_to(look);
    Renderer& renderer = request.coarse && draft_renderer_ ? *draft_renderer_ : *renderer_;
    auto finished = std::make_shared<RenderedFrame>();
    finished->request = request;
    finished->scene = scene;
    finished->picture = drawn(renderer, camera, look, look.plain);
    finished->pass_times = renderer.pass_times();
    finished->skipped_nonfinite = renderer.skipped_nonfinite();
    finished->splats_drawn = renderer.splats_drawn();
    finished->device_bytes = device_bytes(*device_);
    finished->milliseconds =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    return finished;
}

SurfacePoint RenderThread::Scene::point_at(const Probe& probe) {
    SurfacePoint point{.number = probe.number, .use = probe.use, .place = {}};
    const Camera& full = probe.camera;
    const int divisor =
        probe.use == PointUse::look_at ? std::max(1, std::min(full.width, full.height) / kProbeSide) : 1;
    const Camera camera = downscale(full, divisor);
    put_marks();
    DrawOptions options{{}, Drawing::median_depth, 1};
    if (densities_are_up_) options.render.kernel = Footprint::density;
    const Image depth = renderer_->render(camera, options).median_depth;
    const int x = std::clamp(int(probe.pixel.x * camera.width / full.width), 0, camera.width - 1);
    const int y = std::clamp(int(probe.pixel.y * camera.height / full.height), 0, camera.height - 1);
    if (!(*depth.at(x, y) > 0)) return point;
    point.place = world_point(camera, x + 0.5, y + 0.5, *depth.at(x, y));
    if (probe.use != PointUse::color) return point;
    options.drawing = Drawing::color;
    options.plain_colors = true;
    options.render.sh_degree = 0;  // as --select color compares them
    const Rendering colors = renderer_->render(camera, options);
    for (int c = 0; c < 3; ++c) point.color[c] = double(colors.color.at(x, y)[c] / *colors.alpha.at(x, y));
    return point;
}

std::exception_ptr RenderThread::Scene::draw_extra(const ExtraRequest& request) {
    fit_to(request.look);
    const bool bytes = bool(request.take);
    Rendering values;
    const ByteImage picture =
        drawn(*renderer_, request.camera, request.look, true, bytes ? nullptr : &values);
    try {
        if (bytes)
            request.take(picture.rgba);
        else if (request.take_color)
            request.take_color(values.color);
        else
            save(request.file, values, picture, request.look.mode);
    } catch (const std::exception&) {
        return std::current_exception();  // the device is not to blame
    }
    return nullptr;
}

RenderThread::RenderThread(OpenDevice open, std::function<void()> on_news)
    : on_news_(std::move(on_news)),
      scene_(std::make_unique<Scene>(std::move(open))),
      thread_([this](const std::stop_token& stop) { work(stop); }) {}

RenderThread::~RenderThread() = default;

uint64_t RenderThread::set_scene(std::shared_ptr<const Gaussians> gaussians) {
    const std::lock_guard lock(mutex_);
    next_.scene = std::move(gaussians);
    next_.draft.reset();
    next_.marks.reset();
    wake_.notify_one();
    return ++next_.scene_number;
}

void RenderThread::set_draft(Draft draft) {
    const std::lock_guard lock(mutex_);
    next_.draft = std::move(draft);
    wake_.notify_one();
}

void RenderThread::set_marks(std::shared_ptr<const std::vector<uint8_t>> marks) {
    const std::lock_guard lock(mutex_);
    next_.marks = std::move(marks);
    wake_.notify_one();
}

void RenderThread::ask(const RenderRequest& request) {
    const std::lock_guard lock(mutex_);
    next_.request = request;
    wake_.notify_one();
}

uint64_t RenderThread::ask_point(const Camera& camera, const glm::dvec2& pixel, PointUse use) {
    const std::lock_guard lock(mutex_);
    if (use == PointUse::look_at)
        std::erase_if(probes_waiting_, [](const Probe& probe) { return probe.use == PointUse::look_at; });
    probes_waiting_.push_back({camera, pixel, use, ++probes_});
    wake_.notify_one();
    return probes_;
}

void RenderThread::forget_points() {
    const std::lock_guard lock(mutex_);
    probes_waiting_.clear();
}

uint64_t RenderThread::ask_extra(ExtraRequest request) {
    const std::lock_guard lock(mutex_);
    request.number = ++extras_;
    extras_waiting_.push_back(std::move(request));
    wake_.notify_one();
    return extras_;
}

RenderThread::News RenderThread::take_news() {
    const std::lock_guard lock(mutex_);
    News news = news_;
    news_.points.clear();
    news_.extras.clear();
    return news;
}

void RenderThread::report(const std::function<void(News&)>& change) {
    {
        const std::lock_guard lock(mutex_);
        change(news_);
    }
    on_news_();
}

bool RenderThread::next(const std::stop_token& stop, Work& work) {
    std::unique_lock lock(mutex_);
    wake_.wait(lock, stop, [this] {
        return !probes_waiting_.empty() || next_.request || !extras_waiting_.empty() || next_.scene ||
               next_.draft || next_.marks;
    });
    if (stop.stop_requested()) return false;
    work = std::exchange(next_, {});
    next_.scene_number = work.scene_number;
    if (!probes_waiting_.empty()) {
        work.probe = probes_waiting_.front();
        probes_waiting_.erase(probes_waiting_.begin());
    }
    if (!extras_waiting_.empty()) {
        work.extra = std::move(extras_waiting_.front());
        extras_waiting_.pop_front();
    }
    return true;
}

void RenderThread::answer(const SurfacePoint& point) {
    report([&](News& news) { news.points.push_back(point); });
}

void RenderThread::carry_out(Work& work) {
    if (work.scene) scene_->set(work.scene);
    if (work.draft) scene_->set_draft(*std::exchange(work.draft, std::nullopt));
    if (work.marks) scene_->mark(*work.marks);
    if (scene_->open()) report([&](News& news) { news.device = scene_->device(); });
    if (!scene_->bring_up()) return;
    if (work.probe) {
        answer(scene_->point_at(*work.probe));
        work.probe.reset();  // it is not answered again if what follows fails
    }
    if (work.request) {
        const auto finished = scene_->draw(*work.request, work.scene_number);
        report([&](News& news) {
            news.picture = finished;
            news.failure = nullptr;
        });
        work.request.reset();
    }
    if (!work.extra) return;
    const std::exception_ptr failure = scene_->draw_extra(*work.extra);
    report([&](News& news) { news.extras.push_back({work.extra->number, failure}); });
}

/// Reports the exception that is being handled.
void RenderThread::fail(Work& work) {
    if (work.extra && (work.request || work.probe)) {
        const std::lock_guard lock(mutex_);  // its own turn comes next
        extras_waiting_.push_front(*std::exchange(work.extra, std::nullopt));
    }
    report([&](News& news) {
        news.failure = std::current_exception();
        if (work.extra) news.extras.push_back({work.extra->number, news.failure});
    });
    if (work.probe) answer({.number = work.probe->number, .use = work.probe->use, .place = {}});
}

void RenderThread::work(const std::stop_token& stop) {
    for (;;) {
        Work work;
        if (!next(stop, work)) return;
        for (const bool again : {true, false}) {
            try {
                carry_out(work);
                break;
            } catch (const InputError&) {
                fail(work);
                break;
            } catch (...) {
                // The device may be lost, or its memory full of unused buffers. Opening it again solves both.
                scene_->close();
                if (!again) fail(work);
            }
        }
    }
}

}  // namespace ewa::viewer
