// SPDX-License-Identifier: Apache-2.0
// What a training joins of all portions on rank 0, and what it divides among them.
#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <type_traits>
#include <utility>

#include "ewa/error.h"
#include "portions/collect.h"
#include "train/training.h"

namespace ewa::train {

using namespace pipeline;

namespace {

std::span<const std::byte> bytes_of(const glm::dvec3& origin) {
    return std::as_bytes(std::span(&origin, 1));
}

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

Training::~Training() {
    if (options_.device_memory_bytes > 0) device_->limit_memory(0, {});
}

void Training::save(StateWriter* to) {
    finish_all();
    const auto learned = learned_.arrays();
    const bool moved = portions_.origin() != glm::dvec3(0);
    const auto save_array = [to](const std::string& name, auto&& pass_on) {
        pass_on([=](uint64_t bytes, uint32_t checksum) { to->begin_array(name, bytes, checksum); },
                [=](std::span<const std::byte> piece) { to->write(piece); });
    };
    if (to) to->begin({log_.report, portions_.sh_degree()}, portions_.kept().size() + learned.size() + moved);
    for (const portions::Array array : portions_.kept())
        save_array(portions::Portions::name_of(array),
                   [&](const auto& begin, const auto& take) { portions_.pass_on(array, begin, take); });
    if (!to) return;
    const auto save_bytes = [&](const std::string& name, std::span<const std::byte> bytes) {
        save_array(name, [&](const auto& begin, const auto& take) {
            portions::pass_on(*alone(), bytes, begin, take);
        });
    };
    for (const LearnedTable::Array& array : learned)
        save_bytes(array.name, array.buffer->download<std::byte>(array.bytes));
    if (moved) save_bytes("origin", bytes_of(portions_.origin()));
}

void Training::check_fits(StateReader& from) {
    constexpr const char* kMisfit = "the state does not fit this training: ";
    const StateHead& head = from.head();
    const auto& arrays = from.arrays();
    const uint32_t splats = head.report.splats;
    if (head.sh_degree != portions_.sh_degree() || head.report.step > options_.steps ||
        splats > options_.max_splats || splats == 0)
        throw InputError(std::string(kMisfit) + "another SH degree, more steps or more splats");
    const bool moved = !arrays.empty() && arrays.back().name == "origin";
    glm::dvec3 origin(0);
    if (moved && arrays.back().bytes == sizeof(origin))
        from.read(arrays.size() - 1, 0, std::as_writable_bytes(std::span(&origin, 1)));
    if (origin != portions_.origin())
        throw InputError(std::string(kMisfit) + "its means are relative to another origin");
    std::vector<StateReader::Array> expected;
    for (const portions::Array array : portions_.kept())
        expected.push_back({portions::Portions::name_of(array), portions_.bytes_of(array, splats)});
    for (const LearnedTable::Array& array : learned_.arrays()) expected.push_back({array.name, array.bytes});
    if (arrays.size() != expected.size() + moved)
        throw InputError(std::string(kMisfit) + "it is of another strategy or has moments of other bits");
    for (size_t i = 0; i < expected.size(); ++i)
        if (arrays[i].name != expected[i].name || arrays[i].bytes != expected[i].bytes)
            throw InputError(kMisfit + ("it lacks " + expected[i].name) + " of " + std::to_string(splats) +
                             " splats");
}

void Training::restore(StateReader* from) {
    finish_all();
    StepReport report;
    if (from) report = from->head().report;
    const auto sent = portions_.sent(std::as_bytes(std::span(&report, 1)));
    std::memcpy(&report, sent.data(), sizeof(report));
    portions_.clear(report.splats);
    size_t read = 0;  // arrays
    for (const portions::Array array : portions_.kept()) {
        portions_.hand_out(
            array, [&](uint64_t offset, std::span<std::byte> into) { from->read(read, offset, into); });
        ++read;
    }
    for (const LearnedTable::Array& array : learned_.arrays()) {
        std::vector<std::byte> bytes(from ? array.bytes : 0);
        if (from) from->read(read++, 0, bytes);
        array.buffer->upload(std::span<const std::byte>(portions_.sent(bytes)));
    }
    log_.report = report;
    if (!portions_.streamed())
        tools_.instance_capacity = std::max(tools_.instance_capacity, first_capacity(report.splats));
}

Gaussians Training::gaussians() {
    finish_all();
    if (portions_.streamed())
        tools_.frame = {};  // the caller may draw the splats: the next step makes another
    Gaussians gaussians = portions_.gaussians();
    gaussians.density = plan_.kernel == Footprint::density;
    return gaussians;
}

std::vector<Image> Training::render(std::span<const Camera> asked) {
    finish_all();
    static_assert(std::is_trivially_copyable_v<Camera>);
    const auto sent = portions_.sent(std::as_bytes(asked));
    std::vector<Camera> cameras(sent.size() / sizeof(Camera));
    std::memcpy(cameras.data(), sent.data(), sent.size());
    Ranks& ranks = portions_.ranks();
    const auto at_once = size_t(ranks.size());
    std::vector<Image> images;
    for (size_t first = 0; first < cameras.size(); first += at_once) {
        const auto some = std::span(cameras).subspan(first, std::min(at_once, cameras.size() - first));
        for (Image& image : joined_images(ranks, render_own(some), some)) images.push_back(std::move(image));
    }
    return images;
}

std::vector<RankFigures> Training::rank_figures() const {
    const portions::Traffic& traffic = several_.traffic();
    const double views = std::max(1, log_.times.steps);
    const std::array<double, 5> own{double(traffic.sent_bytes) / views, traffic.exchange / views,
                                    traffic.waiting / views, double(log_.most_own_bytes),
                                    double(peak_device_bytes(*device_))};
    Ranks& ranks = portions_.ranks();
    const std::vector<uint64_t> all = ranks.gather(std::bit_cast<std::array<uint64_t, 5>>(own));
    std::vector<RankFigures> figures;
    for (size_t i = 0; i < all.size(); i += own.size()) {
        const auto value = [&](size_t k) { return std::bit_cast<double>(all[i + k]); };
        figures.push_back(
            {ranks.name(int(i / own.size())), value(0), value(1), value(2), value(3), value(4)});
    }
    return figures;
}

std::optional<ChunkFigures> Training::chunk_figures() const {
    if (!portions_.streamed()) return {};
    const double steps = std::max(1.0, double(log_.times.steps) / options_.batch);
    return ChunkFigures{portions_.count(), double(portions_.streamed_bytes()) / steps,
                        portions_.streaming() / steps, portions_.state_bytes(portions_.splats()),
                        options_.device_memory_bytes};
}

}  // namespace ewa::train
