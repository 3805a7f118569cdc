// SPDX-License-Identifier: Apache-2.0
// A training: what it needs before it begins, and what rank 0 and the other ranks call.
#include "ewa/trainer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <exception>
#include <glm/geometric.hpp>
#include <utility>

#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "gpu/device.h"
#include "train/fused_steps.h"
#include "train/needs.h"
#include "train/refinement.h"
#include "train/state_edit.h"
#include "train/step_views.h"
#include "train/training_parts.h"
#include "train/training_state.h"

namespace ewa {
namespace {

using Clock = std::chrono::steady_clock;

double milliseconds(Clock::duration time) {
    return std::chrono::duration<double, std::milli>(time).count();
}

}  // namespace

namespace train {

/// A training: its parts, and what they do in a step.
class Training {
  public:
    TrainingParts parts;

    Training(std::shared_ptr<gpu::Device> device, const Dataset& dataset, const std::vector<int>& frames,
             const Gaussians& ready, double extent, const TrainOptions& options, std::shared_ptr<Ranks> ranks,
             int portions_of_rank)
        : parts(std::move(device), dataset, frames, ready, extent, options, std::move(ranks),
                portions_of_rank),
          refinement(parts, dataset, frames) {}

    const pipeline::Plan& plan() const { return parts.plan; }
    portions::Portions& portions() { return parts.portions; }
    /// An optimisation step, and what the schedule does after it. Collective.
    StepReport step();
    /// The parts, once all steps are done.
    TrainingParts& finished() {
        fused.finish_all();
        return parts;
    }

  private:
    FusedSteps fused{parts};
    Refinement refinement;
};

StepReport Training::step() {
    const auto start = Clock::now();
    StepLog& log = parts.log;
    StepReport& report = log.report;
    const int first = report.step + 1,
              last = std::min(report.step + parts.options.batch, parts.options.steps);
    if (parts.fused())
        fused.optimise(first);
    else
        optimise_several(parts, first, last);
    const auto optimised = Clock::now();
    for (int step = first; step <= last; ++step) refinement.after(step);
    const auto end = Clock::now();
    report.step = last;
    report.splats = parts.portions.splats();
    const portions::Holder& holder = parts.portions.holder();
    log.most_own_bytes = std::max(log.most_own_bytes, holder.state_bytes(holder.splats()));
    report.seconds += std::chrono::duration<double>(end - start).count();
    log.times.steps += last - first + 1;
    log.times.step += milliseconds(end - start);
    log.times.refinement += milliseconds(end - optimised);
    return report;
}

}  // namespace train

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

/// Keeps the first moments of a state alone.
struct FirstMoments : train::StateWriter {
    std::vector<std::byte> bytes;
    bool taken = false;
    void begin(const train::StateHead&, size_t) override {}
    void begin_array(const std::string& name, uint64_t, uint32_t) override {
        taken = name == portions::name_of(portions::moments1);
    }
    void write(std::span<const std::byte> piece) override {
        if (taken) bytes.insert(bytes.end(), piece.begin(), piece.end());
    }
};

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
    resolved.final_splats = needs.final_splats(most);
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
                train::save(training_->finished(), nullptr);
                break;
            case Call::restore:
                train::restore(training_->finished(), nullptr);
                break;
            case Call::gaussians:
                train::gaussians_of(training_->finished());
                break;
            case Call::render:
                train::render(training_->finished(), {});
                break;
            case Call::figures:
                train::rank_figures(training_->parts);
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
    train::save(call(*training_, Call::state).finished(), &to);
}
TrainerState Trainer::state() const {
    train::StateInMemory memory;
    save(memory);
    return std::move(memory.state);
}
void Trainer::restore(train::StateReader& from) {
    train::check_fits(training_->parts, from);
    train::restore(call(*training_, Call::restore).finished(), &from);
}
void Trainer::restore(const TrainerState& state) {
    train::StateOfMemory memory(state);
    restore(memory);
}
EditCounts Trainer::edit(const SplatEdit& edit) {
    TrainerState edited = state();
    const EditCounts counts = train::apply_edit(edit, edited);
    if (counts.removed + counts.frozen + counts.unfrozen == 0) return counts;
    const int all = training_->portions().all();
    if (edited.report.splats <= uint64_t(all - 1) * shared::PARAM_BLOCK)
        throw InputError("the edit would leave " + std::to_string(edited.report.splats) +
                         " splats, which are too few for the " + std::to_string(all) +
                         " parts of this training");
    restore(edited);
    return counts;
}
uint32_t Trainer::frozen_splats() const {
    return training_->parts.frozen;
}
std::vector<bool> Trainer::frozen() const {
    std::vector<bool> flags(frozen_splats() == 0 ? 0 : splats());
    if (flags.empty()) return flags;
    FirstMoments moments;
    save(moments);
    const uint32_t planes = pipeline::parameter_planes(training_->portions().sh_degree());
    for (size_t i = 0; i < flags.size(); ++i) flags[i] = train::is_frozen(moments.bytes, planes, i);
    return flags;
}
Gaussians Trainer::gaussians() const {
    return train::gaussians_of(call(*training_, Call::gaussians).finished());
}
std::vector<Image> Trainer::render(std::span<const Camera> cameras) const {
    if (const scene::Lack lack = training_->plan().method->no_trainer_image)
        throw InputError(std::string(lack.why));
    return train::render(call(*training_, Call::render).finished(), cameras);
}
std::vector<RankFigures> Trainer::rank_figures() const {
    if (training_->portions().ranks().size() == 1) return {};
    return train::rank_figures(call(*training_, Call::figures).parts);
}
std::optional<ChunkFigures> Trainer::chunk_figures() const {
    return train::chunk_figures(training_->parts);
}
std::vector<Exposure> Trainer::exposures() const {
    training_->finished();
    std::vector<Exposure> affine;
    if (training_->plan().appearance != AppearanceModel::affine) return affine;
    for (const Appearance& appearance : training_->parts.learned.appearances.download())
        affine.push_back(std::get<Exposure>(appearance));
    return affine;
}
std::vector<Appearance> Trainer::appearances() const {
    return training_->finished().learned.appearances.download();
}
std::shared_ptr<const SkyMap> Trainer::sky() const {
    training_->finished();
    if (!training_->plan().sky) return nullptr;
    return std::make_shared<const SkyMap>(training_->parts.learned.sky.download());
}
std::vector<CameraMotion> Trainer::camera_motions() const {
    training_->finished();
    return training_->plan().motion ? training_->parts.learned.motions.download()
                                    : std::vector<CameraMotion>();
}
uint32_t Trainer::splats() const {
    return training_->portions().splats();
}
uint32_t Trainer::max_splats() const {
    return training_->parts.options.max_splats;
}
uint32_t Trainer::final_splats() const {
    return training_->parts.options.final_splats;
}
size_t Trainer::images_on_disk() const {
    return training_->parts.images.full().on_disk();
}
int Trainer::steps_done() const {
    return training_->parts.log.report.step;
}
StepReport Trainer::report() const {
    training_->finished();
    return training_->parts.log.report;
}
double Trainer::extent() const {
    return training_->parts.extent;
}
std::vector<PlanLine> Trainer::plan() const {
    const portions::Portions& portions = training_->portions();
    return pipeline::describe(training_->plan(), portions.sh_degree(), portions.splats());
}
StepTimes Trainer::step_times() const {
    return training_->parts.log.means();
}

}  // namespace ewa
