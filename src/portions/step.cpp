// SPDX-License-Identifier: Apache-2.0
#include "portions/step.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

namespace ewa::portions {

using namespace pipeline;

namespace {

shared::Counts run(const StepParts& parts, gpu::Recording& recording) {
    parts.frame.record_counts(recording);
    parts.executor.run(recording, true);
    parts.submitted();
    return parts.frame.read_counts();
}

/// Parts of the loss of a view.
struct PartLoss {
    LossTerms terms;
    double squared = 0;
};

using LossWords = std::array<uint64_t, sizeof(PartLoss) / sizeof(uint64_t)>;
constexpr size_t kLossWords = std::tuple_size_v<LossWords>;

PartLoss loss_from(std::span<const uint64_t, kLossWords> words) {
    LossWords copy;
    std::ranges::copy(words, copy.begin());
    return std::bit_cast<PartLoss>(copy);
}

/// losses: of the bands of each view.
void add_losses(const LossWeights& weights, std::span<const PartLoss> losses, size_t bands, StepSums& sums) {
    const size_t views = losses.size() / bands;
    for (size_t first = 0; first < losses.size(); first += bands) {
        PartLoss view = losses[first];
        for (const PartLoss& band : losses.subspan(first + 1, bands - 1)) {
            view.terms.l1 += band.terms.l1;
            view.terms.l2 += band.terms.l2;
            view.terms.ssim += band.terms.ssim;
            view.terms.alpha += band.terms.alpha;
            view.terms.depth += band.terms.depth;
            view.squared += band.squared;
        }
        sums.loss += loss_of(weights, view.terms) / double(views);
        sums.psnr += -10 * std::log10(view.squared) / double(views);
    }
}

}  // namespace

/// The views of a step, each in so many bands.
struct Step::Views {
    std::span<const StepView> views;
    uint32_t bands;
};

/// A view, or a band of it, which one rank draws.
struct Step::ViewPart {
    size_t number;  // among those of all views: that of its list
    size_t view;
    const StepView& of;
    FrameInputs inputs;    // with its band
    FrameRequest request;  // without splats and instances
};

void Step::reserve(const StepParts& parts, FrameRequest request, uint64_t splats) {
    request.splats = uint32_t(lists_->room(splats, portions_.largest()));
    request.instances = parts.instance_capacity;
    parts.frame.reserve(parts.cache.device(), parts.cache.config(), request);
}

Step::ViewPart Step::part_of(const StepParts& parts, const Views& of, size_t number) {
    const size_t view = number / of.bands;
    ViewPart view_part{number, view, of.views[view], of.views[view].inputs, of.views[view].request};
    if (of.bands == 1) return view_part;
    view_part.inputs.band =
        band_of(parts.cache.config(), view_part.request.height, of.bands, uint32_t(number % of.bands));
    view_part.request.height = view_part.inputs.band.rows;
    return view_part;
}

/// Lists what some parts of views show of this rank's portions, so that each is needed once.
void Step::list(const StepParts& parts, const Views& of, size_t first, size_t view_parts) {
    gpu::Device& device = parts.cache.device();
    ViewBuffers& buffers = buffers_.portion;
    std::vector<Seen>& all = buffers_.seen;
    portions_.visit(Portions::Need::params, [&](int index, const Model& model) {
        const size_t portion = size_t(index);
        buffers.list_indices = std::move(portions_.holder().indices());
        buffers.reserve(device, model.splats, uint32_t(of.views.size()), of.bands,
                        uint32_t(lists_->records(model.splats, view_parts)));
        uint64_t next_index = 0, records = 0;
        if (first > 0) next_index = all[first - 1].first_indices[portion] + all[first - 1].listed[portion];
        size_t projected = of.views.size();
        for (size_t number = first; number < first + view_parts; ++number) {
            const ViewPart view_part = part_of(parts, of, number);
            const bool again = view_part.view == projected;
            if (!again) reserve(parts, view_part.request, model.splats);
            projected = view_part.view;
            gpu::Recording recording(device.limits());
            const FramePasses on{{recording, parts.cache}, parts.plan, parts.frame, view_part.inputs};
            on.list(model, buffers,
                    {.view = uint32_t(view_part.view),
                     .list = uint32_t(number),
                     .first_index = uint32_t(next_index),
                     .first_record = uint32_t(records)},
                    again);
            const shared::Counts counts = run(parts, recording);
            Seen& seen = all[number];
            seen.first_indices[portion] = next_index;
            seen.listed[portion] = counts.scan_total;
            seen.skipped += counts.skipped_nonfinite;
            next_index += counts.scan_total;
            records += lists_->take(buffers_, seen, portion);
        }
        lists_->end_portion(parts.executor, parts.plan, buffers_, next_index);
        portions_.holder().indices() = std::move(buffers.list_indices);
    });
    lists_->end_all(buffers_);
}

/// How many splats each rank lists of some parts of views.
std::vector<uint64_t> Step::gather_counts(size_t first, size_t view_parts, StepSums& sums) {
    std::vector<uint64_t> counts;
    for (size_t k = 0; k < view_parts; ++k) counts.push_back(sum_of(buffers_.seen[first + k].listed));
    counts.push_back(buffers_.seen[first + view_parts - 1].skipped);
    std::vector<uint64_t> all = ranks_.gather(counts);
    sums.skipped_nonfinite = 0;
    for (size_t at = view_parts; at < all.size(); at += counts.size()) sums.skipped_nonfinite += all[at];
    return all;
}

/// listed: of parts from `first` on, as gather_counts() returns it. begin: the first part of the turn.
Turn Step::turn_of(const std::vector<uint64_t>& listed, size_t first, size_t view_parts, size_t begin) const {
    const size_t ranks = size_t(portions_.ranks().size()), own = size_t(portions_.ranks().rank());
    Turn turn{begin, std::min(ranks, first + view_parts - begin)};
    for (size_t k = 0; k < turn.view_parts; ++k)
        turn.listed.push_back(sum_of(buffers_.seen[begin + k].listed));
    for (size_t rank = 0; rank < ranks; ++rank)
        turn.of_own.push_back(turn.draws(int(own)) ? listed[rank * (view_parts + 1) + begin - first + own]
                                                   : 0);
    return turn;
}

/// Afterwards each rank has the list of the part that it draws.
void Step::send(const StepParts& parts, const Views& of, const Turn& turn) {
    if (portions_.alone()) return;
    const size_t ranks = size_t(portions_.ranks().size()), own = size_t(portions_.ranks().rank());
    if (turn.draws(int(own))) {
        reserve(parts, part_of(parts, of, turn.first + own).request, turn.own());
        make_room(parts.cache.device(), buffers_.own_sums, "sums of a view's part",
                  ViewBuffers::sum_bytes(parts.plan, turn.own() + 1));
    }
    lists_->send(buffers_, turn, ranks, [&](std::span<const std::span<std::byte>> out) {
        OnHost list(parts.frame.records, 0, turn.own() * kRecordBytes);
        portions_.holder().streaming().stream(list.bytes().size(), [&] {
            ranks_.exchange(out, pieces_of(list.bytes(), turn.of_own, kRecordBytes, ranks));
            list.write();
        });
    });
}

void Step::return_sums(const StepParts& parts, const Turn& turn) {
    if (portions_.alone()) return;
    const size_t ranks = size_t(portions_.ranks().size());
    const uint64_t splat = ViewBuffers::sum_bytes(parts.plan, 1);
    OnHost drawn(buffers_.own_sums, 0, turn.own() * splat);
    drawn.read();
    lists_->receive(buffers_, turn, ranks, splat, [&](std::span<const std::span<std::byte>> in) {
        portions_.holder().streaming().stream(drawn.bytes().size(), [&] {
            ranks_.exchange(pieces_of(drawn.bytes(), turn.of_own, splat, ranks), in);
        });
    });
}

/// largest: gets the largest weight of each splat of the list, if it is given.
shared::Counts Step::draw_own(const StepParts& parts, const ViewPart& view_part, const Turn& turn,
                              const gpu::Buffer* largest) {
    gpu::Device& device = parts.cache.device();
    const bool alone = portions_.alone();
    const uint64_t listed = turn.own();
    const uint32_t splats = uint32_t(std::max<uint64_t>(listed, 1));
    const gpu::Buffer& sums = alone ? buffers_.portion.sums : buffers_.own_sums;
    for (;;) {
        reserve(parts, view_part.request, listed);
        gpu::Recording recording(device.limits());
        if (listed == 0)
            recording.fill(parts.frame.records, 0, 0, kRecordBytes);
        else if (alone)
            recording.copy(buffers_.portion.visible, 0, parts.frame.records, 0, listed * kRecordBytes);
        const FramePasses on{{recording, parts.cache}, parts.plan, parts.frame, view_part.inputs};
        const Sorted sorted = on.draw_list(splats);
        if (view_part.of.record_loss) {
            view_part.of.record_loss(on);
            on.list_backward(splats, sorted, sums,
                             alone ? uint32_t(buffers_.seen[view_part.number].first_indices.front()) : 0);
        }
        if (largest) {
            recording.fill(*largest, 0, 0, largest->bytes());
            on.contributions(sorted, *largest);
        }
        const shared::Counts counts = run(parts, recording);
        if (counts.instances <= parts.frame.instance_capacity) return counts;
        parts.instance_capacity = grown_capacity(counts.instances);
    }
}

/// Lists whole views, at most one for each rank, and sends the lists to the ranks that draw them.
Turn Step::list_views(const StepParts& parts, const Views& of) {
    StepSums sums;
    buffers_.seen.assign(of.views.size(), Seen(size_t(portions_.count())));
    list(parts, of, 0, of.views.size());
    const Turn turn = turn_of(gather_counts(0, of.views.size(), sums), 0, of.views.size(), 0);
    send(parts, of, turn);
    return turn;
}

/// From the model itself: the passes of rays read what they know of a splat by its number in the model.
bool Step::draw_whole(const StepParts& parts, const StepView& view) {
    const Model& model = portions_.holder().use(0, Need::params);
    for (;;) {
        reserve(parts, view.request, model.splats);
        gpu::Recording recording(parts.cache.device().limits());
        FramePasses{{recording, parts.cache}, parts.plan, parts.frame, view.inputs}.forward(model);
        const shared::Counts counts = run(parts, recording);
        if (counts.instances <= parts.frame.instance_capacity) {
            check_rays_finished(counts);
            return true;
        }
        parts.instance_capacity = grown_capacity(counts.instances);
    }
}

bool Step::draw_views(const StepParts& parts, std::span<const StepView> views) {
    if (portions_.alone()) return draw_whole(parts, views.front());
    const Views of{views, 1};
    const int own = portions_.ranks().rank();
    const Turn turn = list_views(parts, of);
    if (turn.draws(own)) draw_own(parts, part_of(parts, of, size_t(own)), turn);
    return turn.draws(own);
}

/// The largest weights of this rank's splats in the parts of the turn, as each part lists them.
std::vector<float> Step::weights_of(const StepParts& parts, const Views& of, const Turn& turn) {
    const size_t ranks = size_t(portions_.ranks().size()), own = size_t(portions_.ranks().rank());
    std::vector<float> drawn(turn.own()), listed(sum_of(turn.listed));
    if (turn.draws(int(own))) {
        const gpu::Buffer largest(parts.cache.device(), "largest weights",
                                  sizeof(float) * std::max<uint64_t>(turn.own(), 1));
        draw_own(parts, part_of(parts, of, own), turn, &largest);
        if (!drawn.empty()) drawn = largest.download<float>(drawn.size());
    }
    ranks_.exchange(pieces_of(std::as_writable_bytes(std::span(drawn)), turn.of_own, sizeof(float), ranks),
                    pieces_of(std::as_writable_bytes(std::span(listed)), turn.listed, sizeof(float), ranks));
    return listed;
}

void Step::raise_weights(const StepParts& parts, std::span<const StepView> views,
                         std::vector<std::vector<float>>& largest) {
    const Views of{views, 1};
    const Turn turn = list_views(parts, of);
    const std::vector<float> listed = weights_of(parts, of, turn);
    portions_.visit(Portions::Need::state, [&](int portion, const Model& model) {
        const gpu::Buffer listed_indices = std::move(portions_.holder().indices());
        const auto indices = listed_indices.download<uint32_t>(views.size() * model.splats);
        std::vector<float>& raised = largest[size_t(portion)];
        raised.resize(model.splats);
        size_t before = 0;
        for (size_t view = 0; view < views.size(); ++view) {
            const Seen& seen = buffers_.seen[view];
            const float* weights =
                listed.data() + before + sum_of(std::span(seen.listed).first(size_t(portion)));
            before += sum_of(seen.listed);
            for (uint32_t i = 0; i < model.splats; ++i) {
                const uint32_t index = indices[view * model.splats + i];
                if (index != shared::NOT_LISTED)
                    raised[i] = std::max(raised[i], weights[index - seen.first_indices[size_t(portion)]]);
            }
        }
    });
    buffers_.seen.clear();
}

StepSums Step::draw(const StepParts& parts, std::span<const StepView> views) {
    StepSums sums;
    const Views of{views, bands_};
    const size_t ranks = size_t(portions_.ranks().size()), own = size_t(portions_.ranks().rank());
    std::vector<PartLoss> losses(views.size() * bands_);
    lenses_ = 0;
    for (const StepView& view : views) lenses_ = std::max(lenses_, view.inputs.camera.lenses);
    buffers_.seen.assign(losses.size(), Seen(size_t(portions_.count())));
    // Lists on the device are drawn at once. In host memory those of all parts wait.
    const size_t round = lists_->at_once(losses.size(), ranks);
    for (size_t first = 0; first < losses.size(); first += round) {
        const size_t view_parts = std::min(round, losses.size() - first);
        list(parts, of, first, view_parts);
        const std::vector<uint64_t> listed = gather_counts(first, view_parts, sums);
        for (size_t begin = first; begin < first + view_parts; begin += ranks) {
            const Turn turn = turn_of(listed, first, view_parts, begin);
            send(parts, of, turn);
            std::vector<uint64_t> sent(kLossWords + parts.learned);
            if (turn.draws(int(own))) {
                const ViewPart view_part = part_of(parts, of, begin + own);
                const shared::Counts counts = draw_own(parts, view_part, turn);
                const PartLoss loss{terms_of(counts), double(counts.squared) / view_part.of.weight()};
                std::ranges::copy(std::bit_cast<LossWords>(loss), sent.begin());
                if (parts.learned > 0 && ranks > 1)
                    std::ranges::copy(view_part.of.learned(), sent.begin() + kLossWords);
            }
            // Waits for the slowest of them.
            const std::vector<uint64_t> all = ranks_.gather(sent);
            return_sums(parts, turn);
            for (size_t k = 0; k < turn.view_parts; ++k) {
                const auto of_part = std::span(all).subspan(sent.size() * k, sent.size());
                losses[begin + k] = loss_from(of_part.first<kLossWords>());
                if (parts.learned > 0 && k != own)
                    views[(begin + k) / bands_].learn(of_part.subspan(kLossWords));
            }
        }
    }
    add_losses(parts.plan.loss, losses, bands_, sums);
    return sums;
}

void Step::update(const StepParts& parts, const Rates& rates, int sh_degree,
                  const std::function<void(const passes::Recorder&, const Model&)>& more, StepSums& sums) {
    std::array<uint64_t, 2> own{};
    const FrameInputs inputs{.camera = {.lenses = lenses_}, .sh_degree = sh_degree};
    portions_.visit(Portions::Need::state, [&](int portion, const Model& model) {
        buffers_.portion.list_indices = std::move(portions_.holder().indices());
        lists_->begin_update(buffers_, size_t(portion), ViewBuffers::sum_bytes(parts.plan, 1));
        gpu::Recording recording(parts.cache.device().limits());
        recording.fill(parts.frame.counts, 0, 0, sizeof(shared::Counts));
        const FramePasses on{{recording, parts.cache}, parts.plan, parts.frame, inputs};
        on.update_views(model, buffers_.portion, rates, bands_);
        if (more) more(on, model);
        const shared::Counts counts = run(parts, recording);
        own[0] += counts.dropped_updates;
        own[1] += counts.limited_steps;
        portions_.changed();
        portions_.holder().indices() = lists_->end_update(buffers_);
    });
    buffers_.seen.clear();
    const std::vector<uint64_t> all = ranks_.gather(own);
    for (size_t i = 0; i < all.size(); i += 2) {
        sums.dropped_updates += all[i];
        sums.limited_steps += all[i + 1];
    }
}

}  // namespace ewa::portions
