// SPDX-License-Identifier: Apache-2.0
// What all ranks of a training join on rank 0, and what rank 0 divides among them.
#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "ewa/error.h"
#include "portions/collect.h"
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
};

/// What a run keeps from step to step besides the splats. All ranks have the same.
std::vector<NamedBuffer> common_buffers(const Plan& plan, Exposures& exposures, Motions& motions) {
    std::vector<NamedBuffer> buffers;
    if (plan.exposure)
        for (const auto& [name, buffer] : {std::pair{"exposures", &exposures.values},
                                           {"exp_moments1", &exposures.moments1},
                                           {"exp_moments2", &exposures.moments2}})
            buffers.push_back({name, buffer, exposures.bytes()});
    if (plan.motion) {
        for (const auto& [name, buffer] : {std::pair{"motions", &motions.values},
                                           {"motion_moments1", &motions.moments1},
                                           {"motion_moments2", &motions.moments2}})
            buffers.push_back({name, buffer, motions.bytes()});
        buffers.push_back({"motion_bases", &motions.bases, motions.basis_bytes()});
    }
    return buffers;
}

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
    const auto common = common_buffers(s.plan, s.exposures, s.motions);
    const bool moved = s.portions.origin() != glm::dvec3(0);
    const auto pass_on = [to](Ranks& ranks, std::span<const std::byte> own, const std::string& name) {
        portions::pass_on(
            ranks, own, [&](uint64_t bytes, uint32_t checksum) { to->begin_array(name, bytes, checksum); },
            [&](std::span<const std::byte> piece) { to->write(piece); });
    };
    if (to) to->begin({s.report, s.portions.sh_degree()}, s.portions.kept().size() + common.size() + moved);
    for (const portions::Array array : s.portions.kept())
        pass_on(*s.ranks, s.portions.bytes(array), portions::Portions::name_of(array));
    if (!to) return;
    for (const NamedBuffer& named : common)
        pass_on(*alone(), named.buffer->download<std::byte>(named.bytes), named.name);
    if (moved) pass_on(*alone(), bytes_of(s.portions.origin()), "origin");
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
    if (head.sh_degree != s.portions.sh_degree() || head.report.step > s.options.steps ||
        splats > s.options.max_splats || splats == 0)
        throw InputError(
            "the state does not fit this training: another SH degree, more steps or more splats");
    const bool moved = !arrays.empty() && arrays.back().name == "origin";
    glm::dvec3 origin(0);
    if (moved && arrays.back().bytes == sizeof(origin))
        from.read(arrays.size() - 1, 0, std::as_writable_bytes(std::span(&origin, 1)));
    if (origin != s.portions.origin())
        throw InputError("the state does not fit this training: its means are relative to another origin");
    std::vector<train::StateReader::Array> expected;
    for (const portions::Array array : s.portions.kept())
        expected.push_back({portions::Portions::name_of(array), s.portions.bytes_of(array, splats)});
    for (const NamedBuffer& named : common_buffers(s.plan, s.exposures, s.motions))
        expected.push_back({named.name, named.bytes});
    if (arrays.size() != expected.size() + moved)
        throw InputError(
            "the state does not fit this training: it is of another strategy or has moments of other bits");
    for (size_t i = 0; i < expected.size(); ++i)
        if (arrays[i].name != expected[i].name || arrays[i].bytes != expected[i].bytes)
            throw InputError("the state does not fit this training: it lacks " + expected[i].name + " of " +
                             std::to_string(splats) + " splats");
    s.call(Call::restore);
    share_state(&from);
}

void Trainer::share_state(train::StateReader* from) {
    State& s = *state_;
    s.finish_all();
    StepReport report;
    if (from) report = from->head().report;
    const auto told = portions::told(*s.ranks, std::as_bytes(std::span(&report, 1)));
    std::memcpy(&report, told.data(), sizeof(report));
    s.portions.clear(report.splats);
    size_t read = 0;  // arrays
    for (const portions::Array array : s.portions.kept()) {
        std::vector<uint64_t> sizes;
        for (int p = 0; p < s.portions.all(); ++p)
            sizes.push_back(
                s.portions.bytes_of(array, portions::range_of(report.splats, p, s.portions.all()).splats));
        portions::hand_out(
            *s.ranks, sizes,
            [&](uint64_t offset, std::span<std::byte> into) { from->read(read, offset, into); },
            [&](size_t part, std::vector<std::byte> bytes) {
                s.portions.give(int(part) - s.portions.first(), array, std::move(bytes));
            });
        ++read;
    }
    for (const NamedBuffer& named : common_buffers(s.plan, s.exposures, s.motions)) {
        std::vector<std::byte> bytes(from ? named.bytes : 0);
        if (from) from->read(read++, 0, bytes);
        named.buffer->upload(std::span<const std::byte>(portions::told(*s.ranks, bytes)));
    }
    s.report = report;
    if (!s.portions.streamed())
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
    if (s.portions.alone()) {
        const Model& model = s.portions.use(0, portions::Portions::Need::params);
        gaussians = download_model(model, model.params);
    } else {
        if (s.portions.streamed())
            s.frame = {};  // the caller may draw the splats: the next step makes another
        const auto bytes = portions::joined(*s.ranks, s.portions.bytes(portions::params));
        if (s.ranks->rank() != 0) return gaussians;
        gaussians = s.portions.gaussians_of(bytes);
    }
    gaussians.density = s.plan.kernel == Footprint::density;
    return gaussians;
}

std::vector<Image> Trainer::render(std::span<const Camera> cameras) const {
    if (state_->plan.points())
        throw InputError("a trainer of points does not draw pictures: a Renderer of its splats does");
    state_->call(Call::render);
    return join_renders(cameras);
}

namespace {

/// The images of all ranks on rank 0, the one of view k from rank k. own: empty pixels of a rank that has none.
std::vector<Image> joined_images(Ranks& ranks, const Image& own, std::span<const Camera> cameras) {
    const auto bytes = std::as_bytes(std::span(own.pixels));
    const auto all = portions::joined(ranks, {bytes.begin(), bytes.end()});
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
    s.finish_all();
    static_assert(std::is_trivially_copyable_v<Camera>);
    const auto told = portions::told(*s.ranks, std::as_bytes(asked));
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
    const portions::Traffic& traffic = s.several.traffic();
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

std::optional<ChunkFigures> Trainer::chunk_figures() const {
    const State& s = *state_;
    if (!s.portions.streamed()) return {};
    const double steps = std::max(1.0, double(s.times.steps) / s.options.batch);
    return ChunkFigures{s.portions.count(), double(s.portions.streamed_bytes()) / steps,
                        s.portions.streaming() / steps, s.portions.state_bytes(s.portions.splats()),
                        s.options.device_memory_bytes};
}

}  // namespace ewa
