// SPDX-License-Identifier: Apache-2.0
// What all ranks of a training join on rank 0, and what rank 0 divides among them.
#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <span>
#include <type_traits>
#include <utility>

#include "ewa/error.h"
#include "pipeline/share.h"
#include "train/collect.h"
#include "train/trainer_state.h"

namespace ewa {

using namespace pipeline;
using train::Call;

namespace {

struct NamedBuffer {
    const char* name;
    gpu::Buffer* buffer;
    uint64_t bytes;
    gpu::Texel texel;
};

/// The buffers that a run of `splats` splats keeps from step to step.
std::vector<NamedBuffer> buffers_of(const Plan& plan, Model& model, Exposures& exposures, Motions& motions,
                                    uint32_t splats) {
    const uint64_t bytes = parameter_bytes(splats, model.sh_degree);
    std::vector<NamedBuffer> buffers{{"params", &model.params, bytes, gpu::Texel::rgba32f},
                                     {"moments1", &model.moments1, bytes, gpu::Texel::rgba32ui}};
    if (plan.moment_buffers() > 1)
        buffers.push_back({"moments2", &model.moments2, bytes, gpu::Texel::rgba32ui});
    if (plan.statistics)
        buffers.push_back({"statistics", &model.statistics, 8ull * splats, gpu::Texel::none});
    if (plan.exposure)
        for (const auto& [name, buffer] : {std::pair{"exposures", &exposures.values},
                                           {"exp_moments1", &exposures.moments1},
                                           {"exp_moments2", &exposures.moments2}})
            buffers.push_back({name, buffer, exposures.bytes(), gpu::Texel::none});
    if (plan.motion)
        for (const auto& [name, buffer] : {std::pair{"motions", &motions.values},
                                           {"motion_moments1", &motions.moments1},
                                           {"motion_moments2", &motions.moments2}})
            buffers.push_back({name, buffer, motions.bytes(), gpu::Texel::none});
    if (plan.motion)
        buffers.push_back({"motion_bases", &motions.bases, motions.basis_bytes(), gpu::Texel::none});
    return buffers;
}

}  // namespace

TrainerState Trainer::state() const {
    state_->call(Call::state);
    return join_state();
}

TrainerState Trainer::join_state() const {
    State& s = *state_;
    s.finish_all();
    TrainerState state{s.report, s.model.sh_degree, {}};
    for (const NamedBuffer& named : buffers_of(s.plan, s.model, s.exposures, s.motions, s.model.capacity))
        state.arrays.push_back(
            {named.name, train::joined(*s.ranks, named.buffer->download<std::byte>(named.bytes))});
    const auto origin = std::as_bytes(std::span(&s.model.origin, 1));
    if (s.model.origin != glm::dvec3(0)) state.arrays.push_back({"origin", {origin.begin(), origin.end()}});
    return state;
}

void Trainer::restore(const TrainerState& state) {
    State& s = *state_;
    const uint32_t splats = state.report.splats;
    if (state.sh_degree != s.model.sh_degree || state.report.step > s.options.steps ||
        splats > s.options.max_splats || splats == 0)
        throw InputError(
            "the state does not fit this training: another SH degree, more steps or more splats");
    const auto buffers = buffers_of(s.plan, s.model, s.exposures, s.motions, splats);
    const bool moved = !state.arrays.empty() && state.arrays.back().name == "origin";
    glm::dvec3 origin(0);
    if (moved && state.arrays.back().bytes.size() == sizeof(origin))
        std::memcpy(&origin, state.arrays.back().bytes.data(), sizeof(origin));
    if (origin != s.model.origin)
        throw InputError("the state does not fit this training: its means are relative to another origin");
    if (state.arrays.size() != buffers.size() + moved)
        throw InputError(
            "the state does not fit this training: it is of another strategy or has moments of other bits");
    for (size_t i = 0; i < buffers.size(); ++i)
        if (state.arrays[i].name != buffers[i].name || state.arrays[i].bytes.size() != buffers[i].bytes)
            throw InputError("the state does not fit this training: it lacks " +
                             std::string(buffers[i].name) + " of " + std::to_string(splats) + " splats");
    s.call(Call::restore);
    share_state(state);
}

void Trainer::share_state(const TrainerState& state) {
    State& s = *state_;
    const int rank = s.ranks->rank(), ranks = s.ranks->size();
    s.finish_all();
    StepReport report = state.report;
    if (ranks > 1) {
        const auto own = train::told(*s.ranks, std::as_bytes(std::span(&state.report, 1)));
        std::memcpy(&report, own.data(), sizeof(report));
    }
    check_share(report.splats, ranks);
    const int sh_degree = s.model.sh_degree;
    const glm::dvec3 origin = s.model.origin;
    s.model = {};  // free its memory first
    s.model.splats = s.model.capacity = range_of(report.splats, rank, ranks).splats;
    s.model.sh_degree = sh_degree;
    s.model.origin = origin;
    s.take_share(report.splats);
    const auto bytes_of = [&](int of, size_t array) {
        const uint32_t splats = range_of(report.splats, of, ranks).splats;
        return buffers_of(s.plan, s.model, s.exposures, s.motions, splats)[array].bytes;
    };
    const auto buffers = buffers_of(s.plan, s.model, s.exposures, s.motions, s.model.splats);
    for (size_t i = 0; i < buffers.size(); ++i) {
        *buffers[i].buffer = gpu::Buffer(*s.device, buffers[i].name, buffers[i].bytes, buffers[i].texel);
        if (ranks == 1) {
            buffers[i].buffer->upload(std::span<const std::byte>(state.arrays[i].bytes));
            continue;
        }
        std::vector<uint64_t> sizes;
        for (int of = 0; of < ranks; ++of) sizes.push_back(bytes_of(of, i));
        const std::span<const std::byte> all =
            rank == 0 ? std::span<const std::byte>(state.arrays[i].bytes) : std::span<const std::byte>();
        buffers[i].buffer->upload(std::span<const std::byte>(train::part_of(*s.ranks, all, sizes)));
    }
    s.report = report;
    s.instance_capacity = std::max(s.instance_capacity, first_capacity(report.splats));
}
Gaussians Trainer::gaussians() const {
    state_->call(Call::gaussians);
    return join_gaussians();
}
Gaussians Trainer::join_gaussians() const {
    State& s = *state_;
    s.finish_all();
    Gaussians gaussians;
    if (s.ranks->size() == 1) {
        gaussians = download_model(s.model, s.model.params);
    } else {
        const auto bytes = train::joined(
            *s.ranks, s.model.params.download<std::byte>(parameter_bytes(s.model.splats, s.model.sh_degree)));
        if (s.ranks->rank() != 0) return gaussians;
        gaussians = gaussians_of(s.model,
                                 {reinterpret_cast<const float*>(bytes.data()), bytes.size() / sizeof(float)},
                                 s.model.share.all);
    }
    gaussians.density = state_->plan.kernel == Footprint::density;
    return gaussians;
}

std::vector<Image> Trainer::render(std::span<const Camera> cameras) const {
    state_->call(Call::render);
    return join_renders(cameras);
}

namespace {

/// The images of all ranks on rank 0, the one of view k from rank k. own: empty pixels of a rank that has none.
std::vector<Image> joined_images(Ranks& ranks, const Image& own, std::span<const Camera> cameras) {
    const auto bytes = std::as_bytes(std::span(own.pixels));
    const auto all = train::joined(ranks, {bytes.begin(), bytes.end()});
    std::vector<Image> images;
    if (ranks.rank() != 0) return images;
    size_t at = 0;
    for (const Camera& camera : cameras) {
        Image image(camera.width, camera.height, 3);
        const size_t size = image.pixels.size() * sizeof(float);
        std::memcpy(image.pixels.data(), &all.at(at), size);
        at += size;
        images.push_back(std::move(image));
    }
    return images;
}

}  // namespace

std::vector<Image> Trainer::join_renders(std::span<const Camera> asked) const {
    State& s = *state_;
    static_assert(std::is_trivially_copyable_v<Camera>);
    const auto told = train::told(*s.ranks, std::as_bytes(asked));
    std::vector<Camera> cameras(told.size() / sizeof(Camera));
    std::memcpy(cameras.data(), told.data(), told.size());
    const size_t ranks = size_t(s.ranks->size());
    std::vector<Image> images;
    for (size_t first = 0; first < cameras.size(); first += ranks) {
        const auto some = std::span(cameras).subspan(first, std::min(ranks, cameras.size() - first));
        for (Image& image : joined_images(*s.ranks, s.render_own(some), some))
            images.push_back(std::move(image));
    }
    return images;
}

std::vector<RankFigures> Trainer::rank_figures() const {
    if (state_->ranks->size() == 1) return {};
    state_->call(Call::figures);
    return join_figures();
}

std::vector<RankFigures> Trainer::join_figures() const {
    const State& s = *state_;
    const train::Traffic& traffic = s.batch->traffic();
    const double views = std::max(1, s.times.steps);
    const std::array<double, 5> own{double(traffic.sent_bytes) / views, traffic.exchange / views,
                                    traffic.waiting / views, double(s.most_own_bytes),
                                    double(peak_device_bytes(*s.device))};
    const std::vector<uint64_t> all = s.ranks->gather(std::bit_cast<std::array<uint64_t, 5>>(own));
    std::vector<RankFigures> figures;
    for (size_t i = 0; i < all.size(); i += own.size()) {
        const auto value = [&](size_t k) { return std::bit_cast<double>(all[i + k]); };
        figures.push_back(
            {s.ranks->name(int(i / own.size())), value(0), value(1), value(2), value(3), value(4)});
    }
    return figures;
}

}  // namespace ewa
