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
#include "train/state_stream.h"
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

namespace {

std::span<const std::byte> bytes_of(const glm::dvec3& origin) {
    return std::as_bytes(std::span(&origin, 1));
}

/// Keeps a state in memory.
struct StateKeeper : train::StateWriter {
    TrainerState state;
    void begin(const train::StateHead& head, size_t) override { state = {head.report, head.sh_degree, {}}; }
    void begin_array(const std::string& name, uint64_t bytes, uint32_t) override {
        state.arrays.push_back({name, {}});
        state.arrays.back().bytes.reserve(bytes);
    }
    void write(std::span<const std::byte> piece) override {
        std::vector<std::byte>& bytes = state.arrays.back().bytes;
        bytes.insert(bytes.end(), piece.begin(), piece.end());
    }
};

/// Reads a state in memory.
class KeptState : public train::StateReader {
  public:
    explicit KeptState(const TrainerState& state) : state_(state), head_{state.report, state.sh_degree} {
        for (const TrainerArray& array : state.arrays) arrays_.push_back({array.name, array.bytes.size()});
    }
    const train::StateHead& head() const override { return head_; }
    const std::vector<Array>& arrays() const override { return arrays_; }
    void read(size_t array, uint64_t offset, std::span<std::byte> into) override {
        std::copy_n(state_.arrays[array].bytes.begin() + std::ptrdiff_t(offset), into.size(), into.begin());
    }

  private:
    const TrainerState& state_;
    train::StateHead head_;
    std::vector<Array> arrays_;
};

}  // namespace

TrainerState Trainer::state() const {
    StateKeeper keeper;
    save(keeper);
    return std::move(keeper.state);
}

void Trainer::save(train::StateWriter& to) const {
    state_->call(Call::state);
    join_state(&to);
}

void Trainer::join_state(train::StateWriter* to) const {
    State& s = *state_;
    s.finish_all();
    const bool moved = s.model.origin != glm::dvec3(0);
    const auto pass_on = [to](Ranks& ranks, std::span<const std::byte> own, const std::string& name) {
        train::pass_on(
            ranks, own, [&](uint64_t bytes, uint32_t checksum) { to->begin_array(name, bytes, checksum); },
            [&](std::span<const std::byte> piece) { to->write(piece); });
    };
    if (s.chunks) {
        const std::vector<TrainerArray> arrays = s.chunk_arrays();
        to->begin({s.report, s.model.sh_degree}, arrays.size() + moved);
        for (const TrainerArray& array : arrays) pass_on(*s.ranks, array.bytes, array.name);
    } else {
        const auto buffers = buffers_of(s.plan, s.model, s.exposures, s.motions, s.model.capacity);
        if (to) to->begin({s.report, s.model.sh_degree}, buffers.size() + moved);
        for (const NamedBuffer& named : buffers)
            pass_on(*s.ranks, named.buffer->download<std::byte>(named.bytes), named.name);
    }
    // All ranks have the same.
    if (to && moved) pass_on(*alone(), bytes_of(s.model.origin), "origin");
}

void Trainer::restore(const TrainerState& state) {
    KeptState kept(state);
    restore(kept);
}

void Trainer::restore(train::StateReader& from) {
    State& s = *state_;
    const train::StateHead& head = from.head();
    const auto& arrays = from.arrays();
    const uint32_t splats = head.report.splats;
    if (head.sh_degree != s.model.sh_degree || head.report.step > s.options.steps ||
        splats > s.options.max_splats || splats == 0)
        throw InputError(
            "the state does not fit this training: another SH degree, more steps or more splats");
    const auto buffers = buffers_of(s.plan, s.model, s.exposures, s.motions, splats);
    const bool moved = !arrays.empty() && arrays.back().name == "origin";
    glm::dvec3 origin(0);
    if (moved && arrays.back().bytes == sizeof(origin))
        from.read(arrays.size() - 1, 0, std::as_writable_bytes(std::span(&origin, 1)));
    if (origin != s.model.origin)
        throw InputError("the state does not fit this training: its means are relative to another origin");
    if (arrays.size() != buffers.size() + moved)
        throw InputError(
            "the state does not fit this training: it is of another strategy or has moments of other bits");
    for (size_t i = 0; i < buffers.size(); ++i)
        if (arrays[i].name != buffers[i].name || arrays[i].bytes != buffers[i].bytes)
            throw InputError("the state does not fit this training: it lacks " +
                             std::string(buffers[i].name) + " of " + std::to_string(splats) + " splats");
    s.call(Call::restore);
    share_state(&from);
}

void Trainer::share_state(train::StateReader* from) {
    State& s = *state_;
    const int rank = s.ranks->rank(), ranks = s.ranks->size();
    s.finish_all();
    StepReport report;
    if (from) report = from->head().report;
    if (ranks > 1) {
        const auto told = train::told(*s.ranks, std::as_bytes(std::span(&report, 1)));
        std::memcpy(&report, told.data(), sizeof(report));
    }
    if (s.chunks) {
        s.set_chunk_arrays(*from);
        s.take_share(report.splats);
        s.report = report;
        return;
    }
    check_share(report.splats, ranks);
    const int sh_degree = s.model.sh_degree;
    const glm::dvec3 origin = s.model.origin;
    s.model = {};  // free its memory first
    s.model.splats = s.model.capacity = range_of(report.splats, rank, ranks).splats;
    s.model.sh_degree = sh_degree;
    s.model.origin = origin;
    s.take_share(report.splats);
    const auto part_bytes = [&](int of, size_t array) {
        const uint32_t splats = range_of(report.splats, of, ranks).splats;
        return buffers_of(s.plan, s.model, s.exposures, s.motions, splats)[array].bytes;
    };
    const auto buffers = buffers_of(s.plan, s.model, s.exposures, s.motions, s.model.splats);
    for (size_t i = 0; i < buffers.size(); ++i) {
        *buffers[i].buffer = gpu::Buffer(*s.device, buffers[i].name, buffers[i].bytes, buffers[i].texel);
        std::vector<uint64_t> sizes;
        for (int of = 0; of < ranks; ++of) sizes.push_back(part_bytes(of, i));
        const auto read = [&](uint64_t offset, std::span<std::byte> into) { from->read(i, offset, into); };
        buffers[i].buffer->upload(std::span<const std::byte>(train::part_of(*s.ranks, sizes, read)));
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
    if (s.chunks) {
        s.frame = {};  // the caller may draw the splats: the next step makes another
        const auto bytes = s.chunks->joined(
            train::Chunks::params, [&](uint32_t n) { return parameter_bytes(n, s.model.sh_degree); });
        gaussians = gaussians_of(s.model,
                                 {reinterpret_cast<const float*>(bytes.data()), bytes.size() / sizeof(float)},
                                 s.model.share.all);
    } else if (s.ranks->size() == 1) {
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
    if (!state_->batch)
        throw InputError("this trainer does not draw pictures: a Renderer of its splats does");
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
