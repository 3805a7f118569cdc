// SPDX-License-Identifier: Apache-2.0
#include "train/training_state.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <numeric>
#include <type_traits>
#include <utility>

#include "ewa/error.h"
#include "pipeline/image_reader.h"
#include "portions/collect.h"
#include "train/state_edit.h"
#include "train/step_views.h"

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

/// The image through the camera of this rank's number; without pixels if there is none.
Image render_own(TrainingParts& parts, std::span<const Camera> cameras) {
    std::vector<gpu::Buffer> blocks;
    for (const Camera& camera : cameras)
        blocks.push_back(
            upload_camera(*parts.device, camera, parts.tools.cache.config(), parts.portions.origin()));
    std::vector<portions::StepView> views;
    for (size_t i = 0; i < cameras.size(); ++i) {
        FrameInputs inputs = inputs_of(blocks[i], cameras[i], parts.options.render);
        inputs.sky = parts.sky();
        views.push_back(plain_view(parts, inputs));
    }
    portions::StepParts drawing = parts.step_parts();
    drawing.submitted = [] {};
    if (!parts.several.draw_views(drawing, views)) return {};
    return ImageReader(parts.tools.frame).image(shared::PLANE_R, 3);
}

}  // namespace

void save(TrainingParts& parts, StateWriter* to) {
    const auto learned = parts.learned.arrays();
    const bool moved = parts.portions.origin() != glm::dvec3(0);
    const auto save_array = [to](const std::string& name, auto&& pass_on) {
        pass_on([=](uint64_t bytes, uint32_t checksum) { to->begin_array(name, bytes, checksum); },
                [=](std::span<const std::byte> piece) { to->write(piece); });
    };
    if (to)
        to->begin({parts.log.report, parts.portions.sh_degree()},
                  parts.portions.holder().kept().size() + learned.size() + moved);
    for (const portions::Array array : parts.portions.holder().kept())
        save_array(portions::name_of(array), [&](const auto& begin, const auto& take) {
            portions::pass_on(parts.portions.ranks(), parts.portions.holder().download(array), begin, take);
        });
    if (!to) return;
    const auto save_bytes = [&](const std::string& name, std::span<const std::byte> bytes) {
        save_array(name, [&](const auto& begin, const auto& take) {
            portions::pass_on(*alone(), bytes, begin, take);
        });
    };
    for (const LearnedTable::Array& array : learned)
        save_bytes(array.name, array.buffer->download<std::byte>(array.bytes));
    if (moved) save_bytes("origin", bytes_of(parts.portions.origin()));
}

void check_fits(TrainingParts& parts, StateReader& from) {
    constexpr const char* kMisfit = "the state does not fit this training: ";
    const StateHead& head = from.head();
    const auto& arrays = from.arrays();
    const uint32_t splats = head.report.splats;
    if (head.sh_degree != parts.portions.sh_degree() || head.report.step > parts.options.steps ||
        splats > parts.options.max_splats || splats == 0)
        throw InputError(std::string(kMisfit) + "another SH degree, more steps or more splats");
    const bool moved = !arrays.empty() && arrays.back().name == "origin";
    glm::dvec3 origin(0);
    if (moved && arrays.back().bytes == sizeof(origin))
        from.read(arrays.size() - 1, 0, std::as_writable_bytes(std::span(&origin, 1)));
    if (origin != parts.portions.origin())
        throw InputError(std::string(kMisfit) + "its means are relative to another origin");
    std::vector<StateReader::Array> expected;
    for (const portions::Array array : parts.portions.holder().kept())
        expected.push_back(
            {portions::name_of(array), portions::bytes_of(array, splats, parts.portions.sh_degree())});
    for (const LearnedTable::Array& array : parts.learned.arrays())
        expected.push_back({array.name, array.bytes});
    if (arrays.size() != expected.size() + moved)
        throw InputError(std::string(kMisfit) + "it is of another strategy or has moments of other bits");
    for (size_t i = 0; i < expected.size(); ++i)
        if (arrays[i].name != expected[i].name || arrays[i].bytes != expected[i].bytes)
            throw InputError(kMisfit + ("it lacks " + expected[i].name) + " of " + std::to_string(splats) +
                             " splats");
}

void restore(TrainingParts& parts, StateReader* from) {
    StepReport report;
    if (from) report = from->head().report;
    const auto sent = portions::from_rank_0(parts.portions.ranks(), std::as_bytes(std::span(&report, 1)));
    std::memcpy(&report, sent.data(), sizeof(report));
    parts.portions.clear(report.splats);
    size_t read = 0;      // arrays
    uint64_t frozen = 0;  // splats of this rank
    for (const portions::Array array : parts.portions.holder().kept()) {
        std::vector<uint64_t> sizes;
        for (int p = 0; p < parts.portions.all(); ++p)
            sizes.push_back(
                portions::bytes_of(array, portions::range_of(report.splats, p, parts.portions.all()).splats,
                                   parts.portions.sh_degree()));
        portions::hand_out(
            parts.portions.ranks(), sizes,
            [&](uint64_t offset, std::span<std::byte> into) { from->read(read, offset, into); },
            [&](size_t part, std::vector<std::byte> bytes) {
                if (array == portions::moments1)
                    frozen += count_frozen(bytes, parameter_planes(parts.portions.sh_degree()));
                parts.portions.holder().give(int(part) - parts.portions.first(), array, std::move(bytes));
            });
        ++read;
    }
    for (const LearnedTable::Array& array : parts.learned.arrays()) {
        std::vector<std::byte> bytes(from ? array.bytes : 0);
        if (from) from->read(read++, 0, bytes);
        array.buffer->upload(
            std::span<const std::byte>(portions::from_rank_0(parts.portions.ranks(), bytes)));
    }
    const std::vector<uint64_t> all_frozen = parts.portions.ranks().gather(std::span(&frozen, 1));
    parts.frozen = uint32_t(std::accumulate(all_frozen.begin(), all_frozen.end(), uint64_t(0)));
    parts.log.report = report;
    parts.tools.expect(report.splats);
}

Gaussians gaussians_of(TrainingParts& parts) {
    parts.tools.leave_room();  // the caller may draw the splats
    Gaussians gaussians = parts.portions.gaussians();
    gaussians.density = parts.plan.kernel == Footprint::density;
    return gaussians;
}

std::vector<Image> render(TrainingParts& parts, std::span<const Camera> asked) {
    static_assert(std::is_trivially_copyable_v<Camera>);
    const auto sent = portions::from_rank_0(parts.portions.ranks(), std::as_bytes(asked));
    std::vector<Camera> cameras(sent.size() / sizeof(Camera));
    std::memcpy(cameras.data(), sent.data(), sent.size());
    Ranks& ranks = parts.portions.ranks();
    const auto at_once = size_t(ranks.size());
    std::vector<Image> images;
    for (size_t first = 0; first < cameras.size(); first += at_once) {
        const auto some = std::span(cameras).subspan(first, std::min(at_once, cameras.size() - first));
        for (Image& image : joined_images(ranks, render_own(parts, some), some))
            images.push_back(std::move(image));
    }
    return images;
}

std::vector<RankFigures> rank_figures(const TrainingParts& parts) {
    const portions::Traffic& traffic = parts.several.traffic();
    const double views = std::max(1, parts.log.times.steps);
    const std::array<double, 5> own{double(traffic.sent_bytes) / views, traffic.exchange / views,
                                    traffic.waiting / views, double(parts.log.most_own_bytes),
                                    double(peak_device_bytes(*parts.device))};
    Ranks& ranks = parts.portions.ranks();
    const std::vector<uint64_t> all = ranks.gather(std::bit_cast<std::array<uint64_t, 5>>(own));
    std::vector<RankFigures> figures;
    for (size_t i = 0; i < all.size(); i += own.size()) {
        const auto value = [&](size_t k) { return std::bit_cast<double>(all[i + k]); };
        figures.push_back(
            {ranks.name(int(i / own.size())), value(0), value(1), value(2), value(3), value(4)});
    }
    return figures;
}

std::optional<ChunkFigures> chunk_figures(const TrainingParts& parts) {
    if (parts.portions.count() == 1) return {};
    const double steps = std::max(1.0, double(parts.log.times.steps) / parts.options.batch);
    return ChunkFigures{parts.portions.count(), double(parts.portions.holder().streaming().bytes) / steps,
                        parts.portions.holder().streaming().milliseconds / steps,
                        parts.portions.holder().state_bytes(parts.portions.splats()),
                        parts.options.device_memory_bytes};
}

}  // namespace ewa::train
