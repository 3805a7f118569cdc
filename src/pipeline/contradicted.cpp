// SPDX-License-Identifier: Apache-2.0
#include "pipeline/contradicted.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "ewa/error.h"
#include "pipeline/backward.h"
#include "pipeline/image_reader.h"
#include "pipeline/sky.h"
#include "scene/looks.h"
#include "scene/splat_arrays.h"

namespace ewa::pipeline {
namespace {

constexpr double kLimits[] = {300, 100, 40, 40, 20, 20};  // times E / splats
constexpr double kAgreement = 0.5;

/// The splats whose removal lowers E by more than the limit. factor: of the sums.
std::vector<bool> above(const PhotoScores& scores, double limit, double factor) {
    std::vector<bool> flags(scores.sums.size());
    for (size_t k = 0; k < flags.size(); ++k)
        flags[k] = factor * scores.sums[k] > limit && scores.sums[k] > kAgreement * scores.sizes[k];
    return flags;
}

float logit_of_half(float logit) {
    const double half = 0.5 / (1 + std::exp(-double(logit)));
    return float(std::log(half / (1 - half)));
}

/// The weight of pixel i.
double weight_of(const TrainingImage& photo, size_t i) {
    return photo.weights.pixels.empty() ? 1.0 : double(photo.weights.pixels[i]);
}

/// A photo as FramePasses::loss reads it.
Image loss_image(const TrainingImage& photo) {
    if (photo.weights.pixels.empty()) return photo.image;
    Image result(photo.image.width, photo.image.height, 4);
    for (size_t i = 0; i < photo.weights.pixels.size(); ++i) {
        std::copy_n(&photo.image.pixels[3 * i], 3, &result.pixels[4 * i]);
        result.pixels[4 * i + 3] = photo.weights.pixels[i];
    }
    return result;
}

/// Fits a channel of the render to the photo. Replaces the photo by an image of which the render differs by half the gradient of the
/// fitted render's E. Returns that E.
double fit_channel(const Image& render, TrainingImage& photo, size_t channel) {
    const size_t pixels = render.pixels.size() / 3;
    double weights = 0, r = 0, p = 0, rr = 0, rp = 0;
    const auto each = [&](const auto& use) {
        for (size_t i = 0; i < pixels; ++i)
            use(weight_of(photo, i) * weight_of(photo, i), double(render.pixels[3 * i + channel]),
                photo.image.pixels[3 * i + channel]);
    };
    each([&](double w, double x, float y) {
        weights += w;
        r += w * x;
        p += w * double(y);
        rr += w * x * x;
        rp += w * x * double(y);
    });
    if (!(weights > 0)) return 0;
    const double variance = rr - r * r / weights;
    const double factor = variance > 1e-8 * weights ? (rp - r * p / weights) / variance : 1;
    const double offset = (p - factor * r) / weights;
    double error = 0;
    each([&](double w, double x, float& y) {
        const double difference = factor * x + offset - double(y);
        error += w * difference * difference;
        y = float(x - factor * difference);
    });
    return error;
}

/// Compares splats with one photo after another.
class PhotoComparison {
  public:
    PhotoComparison(const std::shared_ptr<gpu::Device>& device, const Gaussians& gaussians,
                    const ComparedPhotos& photos)
        : device_(*device),
          gaussians_(gaussians),
          photos_(photos),
          options_(photos.options),
          fit_(photos.fit_colors),
          cache_(device_),
          executor_(device_),
          model_(upload_model(device_, gaussians, 1, false)) {
        if (options_.sky) sky_ = SkyTexels(device_, *options_.sky);
    }

    void add(const Frame& frame, PhotoScores& scores) {
        scene::check_lens(options_, frame.camera);
        TrainingImage photo =
            photos_.load(frame, options_.sky ? std::array<float, 3>{} : options_.background);  // as inputs_of
        if (photo.image.width != frame.camera.width || photo.image.height != frame.camera.height)
            throw InputError("frame " + frame.name + ": the picture's size is not the camera's");
        const bool masks = !photo.weights.pixels.empty();
        const Plan plan = plan_for({.purpose = Purpose::gradient,
                                    .scene_degree = gaussians_.sh_degree,
                                    .render = options_,
                                    .loss = {.l1 = 0, .l2 = 1, .ssim = 0, .alpha = 0},
                                    .masks = masks});
        const gpu::Buffer block = upload_camera(device_, frame.camera, cache_.config(), model_.origin);
        FrameInputs inputs = inputs_of(block, frame.camera, options_);
        if (options_.sky) inputs.sky = sky_.use();
        double error = 0;
        if (fit_) {
            run(plan, inputs, [](const FramePasses&, const Sorted&) {});
            const Image render = ImageReader(frame_).image(shared::PLANE_R, 3);
            for (size_t c = 0; c < 3; ++c) error += fit_channel(render, photo, c);
        }
        const gpu::Buffer target = upload_photo(device_, loss_image(photo));
        const shared::Counts counts = run(plan, inputs, [&](const FramePasses& on, const Sorted& sorted) {
            on.loss(target, masks);
            on.backward(model_, sorted, {});
        });
        const double values = double(photo.image.pixels.size());
        scores.error += fit_ ? error : values * double(counts.l2);
        for (size_t i = 0; i < photo.image.pixels.size() / 3; ++i) scores.values += 3 * weight_of(photo, i);
        add_gradient(values, scores);
    }

  private:
    template <class Record>
    shared::Counts run(const Plan& plan, const FrameInputs& inputs, Record then) {
        FrameRequest size = frame_request(plan, inputs.camera.width, inputs.camera.height);
        size.splats = model_.splats;
        size.instances = std::max(frame_.instance_capacity, first_capacity(model_.splats));
        return run_until_it_fits(cache_, executor_, frame_, size, [&](const passes::Recorder& recorder) {
            const FramePasses on{recorder, plan, frame_, inputs};
            then(on, on.forward(model_));
        });
    }

    /// values: of which the loss is the mean.
    void add_gradient(double values, PhotoScores& scores) const {
        constexpr double kMostLogit = 20;  // above it the opacity is 1 in float32, and the gradient 0
        const auto gradient = model_.moments1.download<float>(model_.moments1.bytes() / sizeof(float));
        for (size_t i = 0; i < gaussians_.size(); ++i) {
            const double by_logit = gradient[parameter_index(model_.planes(), shared::PARAM_OPACITY, i)];
            if (by_logit == 0 || !std::isfinite(by_logit)) continue;
            // da/dlogit = a (1 - a), so that a dE/da = dE/dlogit / (1 - a).
            const double logit = std::min(double(gaussians_.opacity_logits[i]), kMostLogit);
            const double gain = values * by_logit * (1 + std::exp(logit));
            scores.sums[i] += gain;
            scores.sizes[i] += std::abs(gain);
        }
    }

    gpu::Device& device_;
    const Gaussians& gaussians_;
    const ComparedPhotos& photos_;
    const RenderOptions& options_;
    bool fit_;
    passes::PassCache cache_;
    gpu::Executor executor_;
    Model model_;
    SkyTexels sky_;
    FrameBuffers frame_;
};

}  // namespace

PhotoScores photo_scores(const std::shared_ptr<gpu::Device>& device, const Gaussians& gaussians,
                         const ComparedPhotos& photos, size_t round, const BeforePhoto& before) {
    check(gaussians);
    check(photos.options);
    PhotoScores scores;
    scores.sums.resize(gaussians.size());
    scores.sizes.resize(gaussians.size());
    PhotoComparison comparison(device, gaussians, photos);
    for (size_t i = 0; i < photos.frames.size(); ++i) {
        if (before) before(i + 1, photos.frames.size(), round);
        comparison.add(photos.frames[i], scores);
    }
    return scores;
}

Contradicted contradicted_splats(const std::shared_ptr<gpu::Device>& device, const Gaussians& gaussians,
                                 std::vector<uint32_t> left, const ComparedPhotos& photos,
                                 const BeforePhoto& before) {
    Contradicted result;
    result.flags.resize(gaussians.size());
    size_t round = 0;
    const auto scores_of = [&](const Gaussians& some) {
        return photo_scores(device, some, photos, ++round, before);
    };
    Gaussians some = scene::rows_of(gaussians, left);
    PhotoScores scores = scores_of(some);
    const auto mean_error = [&] { return scores.values > 0 ? scores.error / scores.values : 0; };
    result.before = mean_error();
    const double share = scores.error / double(std::max<size_t>(left.size(), 1));
    for (const double limit : kLimits) {
        std::vector<bool> found = above(scores, limit * share, 1);
        if (std::ranges::find(found, true) == found.end()) continue;
        for (size_t k = 0; k < left.size(); ++k)
            if (found[k]) some.opacity_logits[k] = logit_of_half(some.opacity_logits[k]);
        const std::vector<bool> sure = above(scores_of(some), limit * share, 2);
        std::vector<uint32_t> staying;
        for (size_t k = 0; k < left.size(); ++k) {
            found[k] = found[k] && sure[k];
            if (!found[k]) staying.push_back(left[k]);
            result.flags[left[k]] = found[k];
        }
        some = scene::rows_of(gaussians, staying);
        if (staying.size() == left.size()) continue;
        result.count += left.size() - staying.size();
        left = std::move(staying);
        scores = scores_of(some);
    }
    result.after = mean_error();
    return result;
}

}  // namespace ewa::pipeline
