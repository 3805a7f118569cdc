// SPDX-License-Identifier: Apache-2.0
#include "run/refined_cameras.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "gpu/executor.h"
#include "pipeline/backward.h"
#include "pipeline/model.h"
#include "scene/readout.h"
#include "train/image_cache.h"

namespace ewa::train {
namespace {

// Steps for each camera, and rates from the first to the last: TrainOptions::pose_rate.
constexpr int kAlignSteps = 60;
constexpr double kFirstRate = 3e-3, kLastRate = 3e-5;

/// The rotation closest to a matrix with a positive determinant: Newton's iteration for the polar decomposition
/// (Higham 1986).
glm::dmat3 closest_rotation(glm::dmat3 m) {
    for (int i = 0; i < 60; ++i) m = 0.5 * (m + glm::transpose(glm::inverse(m)));
    return m;
}

std::vector<Camera> cameras_of(const Dataset& dataset, const std::vector<int>& frames) {
    std::vector<Camera> cameras;
    for (const int frame : frames) cameras.push_back(dataset.frames[size_t(frame)].camera);
    return cameras;
}

/// Fixed splats on the device, and the frames of a dataset whose cameras move.
class Alignment {
  public:
    Alignment(const std::shared_ptr<gpu::Device>& device, const Gaussians& gaussians, const Dataset& dataset,
              const std::vector<int>& frames, const TrainOptions& options, double extent)
        : cache_(*device),
          executor_(*device),
          images_(*device, cache_.config(), dataset, frames, 0, gaussians.origin),
          plan_(pipeline::plan_for({.purpose = pipeline::Purpose::gradient,
                                    .scene_degree = gaussians.sh_degree,
                                    .render = options.render,
                                    .loss = options.loss,
                                    .masks = images_.any_masked(),
                                    .alpha = images_.any_cut(),
                                    .motion = true})),
          model_(pipeline::upload_model(*device, gaussians, plan_.moment_buffers(), false)),
          motions_(*device, pipeline::motion_bases(cameras_of(dataset, frames), gaussians,
                                                   options.refine_focal, extent)),
          options_(options),
          extent_(extent) {}

    void align(size_t index) {
        const ImageCache::Photo& photo = images_.photo(index);
        for (int step = 1; step <= kAlignSteps; ++step) run(index, photo, step);
    }
    std::vector<CameraMotion> motions() const { return motions_.download(); }

  private:
    void run(size_t index, const ImageCache::Photo& photo, int step) {
        const pipeline::CameraUse base = images_.camera(index);
        const double rate = kFirstRate * std::pow(kLastRate / kFirstRate, double(step) / kAlignSteps);
        const pipeline::MotionUse use{.motions = &motions_,
                                      .photo = uint32_t(index),
                                      .rate = float(rate),
                                      .extent = float(extent_),
                                      .visit = uint32_t(step)};
        pipeline::FrameRequest size = pipeline::frame_request(plan_, base.width, base.height);
        size.splats = model_.splats;
        size.instances = std::max(frame_.instance_capacity, pipeline::first_capacity(model_.splats));
        size.readouts = motions_.readouts();
        run_until_it_fits(cache_, executor_, frame_, size, [&](const passes::Recorder& recorder) {
            const pipeline::FrameInputs inputs{
                .camera = record_move_camera(recorder, motions_, use.photo, base),
                .background = options_.render.background,
                .sh_degree = options_.render.sh_degree};
            const pipeline::FramePasses on{recorder, plan_, frame_, inputs};
            const auto sorted = on.forward(model_);
            on.loss(photo.texels, photo.masked, nullptr, photo.cut);
            on.backward(model_, sorted, {}, &use);
        });
    }

    passes::PassCache cache_;
    gpu::Executor executor_;
    ImageCache images_;
    const pipeline::Plan plan_;
    pipeline::Model model_;
    pipeline::Motions motions_;
    pipeline::FrameBuffers frame_;
    const TrainOptions& options_;
    double extent_;
};

double median(std::vector<double> values) {
    const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

}  // namespace

Similarity similarity_between(const std::vector<Camera>& from, const std::vector<Camera>& to) {
    const double count = double(from.size());
    glm::dvec3 mean_from(0), mean_to(0);
    for (size_t i = 0; i < from.size(); ++i) {
        mean_from += scene::at_middle(from[i]).position() / count;
        mean_to += scene::at_middle(to[i]).position() / count;
    }
    glm::dmat3 products(0), axes(0);
    double square = 0;
    for (size_t i = 0; i < from.size(); ++i) {
        const Camera start = scene::at_middle(from[i]), end = scene::at_middle(to[i]);
        const glm::dvec3 a = start.position() - mean_from, b = end.position() - mean_to;
        products += glm::outerProduct(b, a);
        axes += glm::transpose(end.rotation) * start.rotation;
        square += glm::dot(a, a);
    }
    Similarity result;
    result.rotation = closest_rotation(square > 0 ? axes + count / square * products : axes);
    double along = 0;
    for (int k = 0; k < 3; ++k) along += glm::dot(result.rotation[k], products[k]);
    if (along > 0) result.scale = along / square;
    result.shift = mean_to - result.scale * (result.rotation * mean_from);
    return result;
}

Camera transformed(const Camera& camera, const Similarity& similarity) {
    const glm::dmat3 back = glm::transpose(similarity.rotation);
    const auto position = [&](const glm::dmat3& rotation, const glm::dvec3& translation) {
        return similarity(-(glm::transpose(rotation) * translation));
    };
    Camera result = camera;
    result.rotation = camera.rotation * back;
    result.translation = -(result.rotation * position(camera.rotation, camera.translation));
    if (!camera.readout) return result;
    const Readout& end = *camera.readout;
    result.readout->rotation = end.rotation * back;
    result.readout->translation = -(result.readout->rotation * position(end.rotation, end.translation));
    return result;
}

RefinedCameras refined_cameras(const Dataset& dataset, const std::vector<int>& train,
                               const std::vector<CameraMotion>& motions) {
    std::vector<Camera> before, after;
    for (size_t i = 0; i < train.size(); ++i) {
        before.push_back(dataset.frames[size_t(train[i])].camera);
        after.push_back(moved(before.back(), motions[i]));
    }
    RefinedCameras result;
    result.world = similarity_between(before, after);
    for (const Frame& frame : dataset.frames)
        result.cameras.push_back(transformed(frame.camera, result.world));
    for (size_t i = 0; i < train.size(); ++i) result.cameras[size_t(train[i])] = after[i];
    return result;
}

std::vector<CameraMotion> align_cameras(const std::shared_ptr<gpu::Device>& device,
                                        const Gaussians& gaussians, const Dataset& dataset,
                                        const std::vector<int>& frames, const TrainOptions& options,
                                        double extent, const std::function<void()>& before_frame) {
    Alignment alignment(device, gaussians, dataset, frames, options, extent);
    for (size_t i = 0; i < frames.size(); ++i) {
        if (before_frame) before_frame();
        alignment.align(i);
    }
    return alignment.motions();
}

CameraMoves moves_of(const Dataset& dataset, const std::vector<int>& frames, const std::vector<Camera>& given,
                     double extent) {
    std::vector<double> degrees, shares, focals;
    for (const int index : frames) {
        const CameraDistance d = distance_between(given[size_t(index)], dataset.frames[size_t(index)].camera);
        degrees.push_back(d.degrees);
        shares.push_back(d.length / extent);
        focals.push_back(d.focal);
    }
    const auto [least, largest] = std::minmax_element(focals.begin(), focals.end());
    return {.median_degrees = median(degrees),
            .largest_degrees = *std::max_element(degrees.begin(), degrees.end()),
            .median_share = median(shares),
            .largest_share = *std::max_element(shares.begin(), shares.end()),
            .least_focal = *least,
            .largest_focal = *largest};
}

}  // namespace ewa::train
