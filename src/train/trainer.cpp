// SPDX-License-Identifier: Apache-2.0
// A training: what it needs before it begins, and what rank 0 and the other ranks call.
#include "ewa/trainer.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <exception>
#include <glm/geometric.hpp>
#include <utility>

#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "gpu/device.h"
#include "train/needs.h"
#include "train/training.h"

namespace ewa {
namespace {

/// The length that rates and thresholds are relative to: the extent of the cameras. Cameras in one place (a
/// panorama, a single image) have no extent; then it is the median distance of the splats from them.
double extent_for(const Dataset& dataset, const std::vector<int>& frames, const Gaussians& start) {
    const double extent = scene_extent(dataset, frames);
    if (extent > 0) return extent;
    const glm::dvec3 eye = dataset.frames[size_t(frames.front())].camera.position();
    std::vector<double> distances;
    for (size_t i = 0; i < start.size(); ++i) {
        const double distance = glm::length(start.world_mean(i) - eye);
        if (std::isfinite(distance) && distance > 0) distances.push_back(distance);
    }
    if (distances.empty()) return 1;
    const auto middle = distances.begin() + std::ptrdiff_t(distances.size() / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    return *middle;
}

/// Sorts splats so that neighbours in space are neighbours in memory: a tile then reads contiguous splats.
/// ADC keeps that order, since children are stored beside their parent; MCMC loses it gradually. Means become
/// relative to an origin near them. Quaternions far from unit length are normalised: the learning rate
/// assumes about 1.
/// Opacities are fitted to the kernel.
Gaussians prepared(Gaussians start, Footprint kernel) {
    fit_opacities(start, kernel == Footprint::density);
    select_splats(start, morton_order(start));
    settle_origin(start);
    for (size_t i = 0; i < start.size(); ++i) {
        float* q = &start.quaternions[4 * i];
        const double largest = std::max({std::abs(q[0]), std::abs(q[1]), std::abs(q[2]), std::abs(q[3])});
        if (!(largest > 0 && std::isfinite(largest)) || (largest > 0.1 && largest < 10)) continue;
        double sum = 0;
        for (int k = 0; k < 4; ++k) sum += (q[k] / largest) * (q[k] / largest);
        for (int k = 0; k < 4; ++k) q[k] = float(q[k] / largest / std::sqrt(sum));
    }
    return start;
}

/// Limits a device's memory for as long as the trainer is made, or longer if that succeeds.
class LimitedMemory {
  public:
    LimitedMemory(std::shared_ptr<gpu::Device> device, uint64_t bytes)
        : device_(bytes > 0 ? std::move(device) : nullptr) {
        if (device_) device_->limit_memory(bytes, {});
    }
    ~LimitedMemory() {
        if (device_ && !kept_) device_->limit_memory(0, {});
    }
    LimitedMemory(const LimitedMemory&) = delete;
    LimitedMemory& operator=(const LimitedMemory&) = delete;
    void keep() { kept_ = true; }

  private:
    std::shared_ptr<gpu::Device> device_;
    bool kept_ = false;
};

/// The number of rank 0. Devices of other ranks may have more or less memory. Collective.
uint32_t agreed(Ranks& ranks, uint32_t own) {
    const uint64_t word = own;
    return uint32_t(ranks.gather(std::span(&word, 1)).front());
}

/// What rank 0 asks the others to take part in.
enum class Call : uint64_t { end, wait, step, state, restore, gaussians, render, figures };

/// Begins what all ranks do together. Called by rank 0.
train::Training& call(train::Training& training, Call what) {
    const auto word = uint64_t(what);
    Ranks& ranks = training.portions().ranks();
    if (ranks.size() > 1) ranks.gather(std::span(&word, 1));
    return training;
}

}  // namespace

Trainer::Trainer(std::shared_ptr<gpu::Device> device, const Dataset& dataset,
                 const std::vector<int>& train_frames, Gaussians start, const TrainOptions& options,
                 std::shared_ptr<Ranks> ranks) {
    if (train_frames.empty())
        throw InputError("there is no training image; a larger --test-every leaves more of them");
    check(start);
    check(dataset, train_frames);
    train::check_start(start.size(), options);
    train::check_training(options, ranks->size());
    const double extent = extent_for(dataset, train_frames, start);
    TrainOptions resolved = resolve(options, dataset, train_frames);
    train::Needs needs(*device, dataset, train_frames, start, resolved);
    const uint32_t most = agreed(*ranks, needs.cap().splats);
    const auto count = int(agreed(*ranks, uint32_t(needs.portions(most, ranks->size()))));
    resolved.max_splats = most;
    if (resolved.device_memory_bytes > 0 && device->memory_limit() > 0)
        throw InputError(
            "another training has limited this device's memory: a device takes one such training");
    LimitedMemory limited(device, resolved.device_memory_bytes);
    if (count > 1) resolved.image_cache_bytes = train::limited_cache(resolved);
    training_ = std::make_unique<train::Training>(std::move(device), dataset, train_frames,
                                                  prepared(std::move(start), options.render.kernel), extent,
                                                  resolved, std::move(ranks), count);
    limited.keep();
}

Trainer::~Trainer() {
    // After an exception the other ranks may be in the middle of something else.
    if (!training_ || training_->portions().ranks().rank() != 0 || std::uncaught_exceptions() > 0) return;
    try {
        call(*training_, Call::end);
    } catch (const std::exception&) {
        // A rank that does not answer has ended.
    }
}

void Trainer::follow() {
    for (;;) {
        const uint64_t none = 0;
        switch (Call(training_->portions().ranks().gather(std::span(&none, 1)).front())) {
            case Call::end:
                return;
            case Call::wait:
                break;
            case Call::step:
                training_->step();
                break;
            case Call::state:
                training_->save(nullptr);
                break;
            case Call::restore:
                training_->restore(nullptr);
                break;
            case Call::gaussians:
                training_->gaussians();
                break;
            case Call::render:
                training_->render({});
                break;
            case Call::figures:
                training_->rank_figures();
                break;
        }
    }
}

void Trainer::keep_waiting() const {
    call(*training_, Call::wait);
}
StepReport Trainer::step() {
    return call(*training_, Call::step).step();
}
void Trainer::save(train::StateWriter& to) const {
    call(*training_, Call::state).save(&to);
}
TrainerState Trainer::state() const {
    train::StateInMemory memory;
    save(memory);
    return std::move(memory.state);
}
void Trainer::restore(train::StateReader& from) {
    training_->check_fits(from);
    call(*training_, Call::restore).restore(&from);
}
void Trainer::restore(const TrainerState& state) {
    train::StateOfMemory memory(state);
    restore(memory);
}
Gaussians Trainer::gaussians() const {
    return call(*training_, Call::gaussians).gaussians();
}
std::vector<Image> Trainer::render(std::span<const Camera> cameras) const {
    if (training_->plan().points())
        throw InputError("a trainer of points does not draw pictures: a Renderer of its splats does");
    return call(*training_, Call::render).render(cameras);
}
std::vector<RankFigures> Trainer::rank_figures() const {
    if (training_->portions().ranks().size() == 1) return {};
    return call(*training_, Call::figures).rank_figures();
}
std::optional<ChunkFigures> Trainer::chunk_figures() const {
    return training_->chunk_figures();
}
std::vector<Exposure> Trainer::exposures() const {
    training_->finish_all();
    std::vector<Exposure> affine;
    if (training_->plan().appearance != AppearanceModel::affine) return affine;
    for (const Appearance& appearance : training_->learned().appearances.download())
        affine.push_back(std::get<Exposure>(appearance));
    return affine;
}
std::vector<Appearance> Trainer::appearances() const {
    training_->finish_all();
    return training_->learned().appearances.download();
}
std::shared_ptr<const SkyMap> Trainer::sky() const {
    training_->finish_all();
    if (!training_->plan().sky) return nullptr;
    return std::make_shared<const SkyMap>(training_->learned().sky.download());
}
std::vector<CameraMotion> Trainer::camera_motions() const {
    training_->finish_all();
    return training_->plan().motion ? training_->learned().motions.download() : std::vector<CameraMotion>();
}
uint32_t Trainer::splats() const {
    return training_->portions().splats();
}
uint32_t Trainer::max_splats() const {
    return training_->options().max_splats;
}
size_t Trainer::images_on_disk() const {
    return training_->images_on_disk();
}
int Trainer::steps_done() const {
    return training_->log().report.step;
}
StepReport Trainer::report() const {
    training_->finish_all();
    return training_->log().report;
}
double Trainer::extent() const {
    return training_->extent();
}
std::vector<PlanLine> Trainer::plan() const {
    const portions::Portions& portions = training_->portions();
    return pipeline::describe(training_->plan(), portions.sh_degree(), portions.splats());
}
StepTimes Trainer::step_times() const {
    return training_->log().means();
}

}  // namespace ewa
