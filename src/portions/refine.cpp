// SPDX-License-Identifier: Apache-2.0
#include "portions/refine.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "portions/collect.h"

namespace ewa::portions {

using namespace pipeline;

Refinement densify(Portions& portions, const Phase& phase, const DensifyRules& rules) {
    const Densified next = decide_densify(rules, [&](float threshold) {
        uint64_t own = 0;
        const auto need = rules.frozen ? Portions::Need::state : Portions::Need::statistics;
        portions.visit(
            need, [&](int, const Model& model) { own += count_densified(phase, model, rules, threshold); });
        const std::vector<uint64_t> all = portions.ranks().gather(std::span(&own, 1));
        return std::accumulate(all.begin(), all.end(), uint64_t(0));
    });
    const uint32_t before = portions.splats();
    if (next.splats == 0) return {before, before, 0};
    portions.visit(Portions::Need::state,
                   [&](int, Model& model) { write_densified(phase, model, rules, next.threshold); });
    portions.level();
    return {before, portions.splats(), 0};
}

namespace {

/// A source that a portion's draw hit, on its way to the portion of the target. Its texels follow, if that is another one.
struct SentSource {
    uint32_t draw = 0, index = 0, hits = 0, portion = 0;
};
static_assert(sizeof(SentSource) == kTexelBytes);

/// Sources on the host, and what a portion's write needs of its own.
struct Draws {
    std::vector<std::vector<std::byte>> to;  // by the target's portion
    std::vector<uint32_t> hits;
};

/// The portion of a draw's target. The dead splats of a portion follow those of the portions before; then come new splats.
size_t portion_of(const std::vector<McmcPart>& parts, uint32_t draw) {
    const auto after = std::upper_bound(parts.begin(), parts.end(), draw,
                                        [](uint32_t d, const McmcPart& part) { return d < part.first_draw; });
    return size_t(after - parts.begin()) - 1;
}

/// Moments say which splats are frozen.
Portions::Need need_of(const McmcRules& rules) {
    return rules.frozen ? Portions::Need::state : Portions::Need::params;
}

std::vector<McmcPart> weighed(Portions& portions, const Phase& phase, const McmcRules& rules) {
    std::vector<uint64_t> own(2 * size_t(portions.count()));
    portions.visit(need_of(rules), [&](int portion, const Model& model) {
        const McmcPart part = weigh_mcmc(phase, model, rules);
        own[2 * size_t(portion)] = part.weight;
        own[2 * size_t(portion) + 1] = part.dead;
    });
    const std::vector<uint64_t> all = portions.ranks().gather(own);
    std::vector<McmcPart> parts(all.size() / 2);
    for (size_t p = 0; p < parts.size(); ++p) {
        parts[p].weight = uint32_t(all[2 * p]);
        parts[p].dead = uint32_t(all[2 * p + 1]);
    }
    return parts;
}

/// What a portion's splats are the sources of.
Draws sources_of(const Phase& phase, const Model& model, const McmcRules& rules,
                 const std::vector<McmcPart>& parts, size_t portion) {
    McmcSources drawn = draw_mcmc(phase, model, rules, parts[portion]);
    const auto sources = drawn.sources.download<uint32_t>(parts[portion].draws);
    Draws draws{std::vector<std::vector<std::byte>>(parts.size()),
                drawn.hits.download<uint32_t>(model.splats)};
    drawn = {};
    const uint32_t planes = model.planes();
    const auto params = model.params.download<std::byte>(parameter_bytes(model.splats, model.sh_degree));
    for (uint32_t d = 0; d < sources.size(); ++d) {
        const uint32_t index = sources[d];
        if (index == shared::NOT_LISTED) continue;
        const size_t target = portion_of(parts, d);
        const SentSource sent{d, index, draws.hits[index], uint32_t(portion)};
        std::vector<std::byte>& to = draws.to[target];
        const size_t at = to.size();
        to.resize(at + sizeof(sent) + (target == portion ? 0 : planes * kTexelBytes));
        std::memcpy(&to[at], &sent, sizeof(sent));
        if (target != portion) pack_splat(params.data(), planes, index, &to[at + sizeof(sent)]);
    }
    return draws;
}

/// A portion's sources. Those of other portions are appended to model.params.
McmcSources fetched(gpu::Device& device, Model& model, const std::vector<McmcPart>& parts, size_t portion,
                    std::vector<uint32_t> hits, const std::vector<std::vector<std::byte>>& sent_by_ranks) {
    const uint32_t planes = model.planes();
    const McmcPart& part = parts[portion];
    std::vector<uint32_t> sources(part.dead + part.added);
    std::vector<const std::byte*> foreign;  // texels
    for (const std::vector<std::byte>& bytes : sent_by_ranks)
        for (size_t at = 0; at < bytes.size();) {
            SentSource sent;
            std::memcpy(&sent, &bytes[at], sizeof(sent));
            at += sizeof(sent);
            const size_t target = portion_of(parts, sent.draw);
            const std::byte* texels = target == sent.portion ? nullptr : &bytes[at];
            if (texels) at += planes * kTexelBytes;
            if (target != portion) continue;
            sources[sent.draw - part.first_draw] = texels ? uint32_t(hits.size()) : sent.index;
            if (!texels) continue;
            foreign.push_back(texels);
            hits.push_back(sent.hits);
        }
    if (!foreign.empty()) {
        auto values = model.params.download<std::byte>(parameter_bytes(model.splats, model.sh_degree));
        const uint32_t extended = uint32_t(hits.size());
        values.resize(parameter_bytes(extended, model.sh_degree));
        for (size_t i = 0; i < foreign.size(); ++i)
            unpack_splat(foreign[i], planes, model.splats + i, values.data());
        model.params = parameter_buffer(device, "params", model.params.texel(), extended, model.sh_degree);
        model.params.upload(std::span<const std::byte>(values));
    }
    McmcSources result{gpu::Buffer(device, "sources", std::max<uint64_t>(4 * sources.size(), 4)),
                       gpu::Buffer(device, "hits", 4 * hits.size())};
    if (!sources.empty()) result.sources.upload(std::span<const uint32_t>(sources));
    result.hits.upload(std::span<const uint32_t>(hits));
    return result;
}

}  // namespace

Refinement refine_mcmc(Portions& portions, const Phase& phase, const McmcRules& rules) {
    std::vector<McmcPart> parts = weighed(portions, phase, rules);
    const Refinement result = decide_mcmc(parts, portions.splats(), rules);
    if (parts.front().draws == 0) return result;
    if (portions.alone()) {  // the sources stay on the device
        portions.visit(Portions::Need::state, [&](int, Model& model) {
            write_mcmc(phase, model, rules, parts[0], draw_mcmc(phase, model, rules, parts[0]));
        });
    } else {
        const size_t first = size_t(portions.first());
        std::vector<Draws> draws(size_t(portions.count()));
        portions.visit(need_of(rules), [&](int portion, const Model& model) {
            draws[size_t(portion)] = sources_of(phase, model, rules, parts, first + size_t(portion));
        });
        std::vector<std::vector<std::byte>> out(size_t(portions.ranks().size()));
        for (Draws& own : draws)
            for (size_t p = 0; p < parts.size(); ++p) {
                std::vector<std::byte>& to = out[size_t(portions.rank_of(int(p)))];
                const std::vector<std::byte> sent = std::exchange(own.to[p], {});
                to.insert(to.end(), sent.begin(), sent.end());
            }
        const auto in = exchanged(portions.ranks(), std::move(out));
        portions.visit(Portions::Need::state, [&](int portion, Model& model) {
            const size_t p = first + size_t(portion);
            const McmcSources from =
                fetched(phase.cache.device(), model, parts, p, std::move(draws[size_t(portion)].hits), in);
            write_mcmc(phase, model, rules, parts[p], from);
        });
    }
    portions.level();
    return result;
}

namespace {

/// The bits of a float of at least zero. They are ordered as such floats are.
uint32_t bits_of(float weight) {
    return std::bit_cast<uint32_t>(weight);
}

/// Which splats have the `kept` largest weights.
class Largest {
  public:
    /// Collective. There are at least `kept` splats.
    Largest(Portions& portions, std::span<const std::vector<float>> weights, uint32_t kept)
        : weights_(weights) {
        // The bisection ends at the bits of the smallest weight that is kept.
        uint64_t low = 0, high = uint64_t(1) << 32;
        while (high - low > 1) {
            const uint64_t middle = low + (high - low) / 2;
            (all_from(portions, uint32_t(middle)) >= kept ? low : high) = middle;
        }
        least_ = uint32_t(low);
        const uint64_t above =
            least_ == std::numeric_limits<uint32_t>::max() ? 0 : all_from(portions, least_ + 1);
        uint64_t room = kept - above;
        std::vector<uint64_t> equal;
        for (const std::vector<float>& own : weights)
            equal.push_back(uint64_t(
                std::ranges::count_if(own, [&](float weight) { return bits_of(weight) == least_; })));
        const auto first = size_t(portions.first());
        const std::vector<uint64_t> all = portions.ranks().gather(equal);
        for (size_t p = 0; p < first + weights.size(); ++p) {
            if (p >= first) equal_.push_back(std::min(room, all[p]));
            room -= std::min(room, all[p]);
        }
    }

    /// A flag for each splat of one of this rank's portions.
    std::vector<bool> of(size_t portion) const {
        std::vector<bool> kept;
        uint64_t room = equal_[portion];
        for (const float weight : weights_[portion]) {
            const bool equal = bits_of(weight) == least_;
            kept.push_back(bits_of(weight) > least_ || (equal && room > 0));
            if (equal && room > 0) --room;
        }
        return kept;
    }

  private:
    uint64_t all_from(Portions& portions, uint32_t bits) const {
        uint64_t own = 0;
        for (const std::vector<float>& each : weights_)
            own += uint64_t(std::ranges::count_if(each, [&](float w) { return bits_of(w) >= bits; }));
        const std::vector<uint64_t> all = portions.ranks().gather(std::span(&own, 1));
        return std::accumulate(all.begin(), all.end(), uint64_t(0));
    }

    std::span<const std::vector<float>> weights_;
    uint32_t least_ = 0;
    std::vector<uint64_t> equal_;  // of each portion: splats of the least weight that are kept
};

}  // namespace

Refinement keep_largest(Portions& portions, const Phase& phase, std::span<const std::vector<float>> largest,
                        uint32_t kept) {
    const uint32_t before = portions.splats();
    if (before <= kept) return {before, before, 0};
    const Largest chosen(portions, largest, kept);
    const DensifyRules rules{.prune_logit = std::numeric_limits<float>::lowest()};
    portions.visit(Portions::Need::state, [&](int portion, Model& model) {
        const std::vector<bool> stays = chosen.of(size_t(portion));
        // Without views nothing grows; a negative number of them prunes.
        std::vector<float> statistics(2 * stays.size());
        for (size_t i = 0; i < stays.size(); ++i) statistics[2 * i + 1] = stays[i] ? 0.0f : -1.0f;
        model.statistics = fresh_statistics(phase.cache.device(), model.splats);
        model.statistics.upload(std::span<const float>(statistics));
        write_densified(phase, model, rules, std::numeric_limits<float>::infinity());
    });
    portions.level();
    return {before, portions.splats(), 0};
}

}  // namespace ewa::portions
