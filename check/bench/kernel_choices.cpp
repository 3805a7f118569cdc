// SPDX-License-Identifier: Apache-2.0
#include "bench/kernel_choices.h"

#include <sstream>

#include "core/typing.h"
#include "core/words.h"
#include "ewa/error.h"

namespace ewa::bench {
namespace {

[[noreturn]] void refuse(const std::string& choice, const std::string& expected) {
    throw InputError("--kernels: '" + choice + "' is not " + expected);
}

uint32_t number_in(const std::string& choice, std::string text, uint32_t most) {
    const std::string fault = core::settle_number<uint32_t>(text, 1, most);
    if (!fault.empty()) throw InputError("--kernels: " + choice + ": " + fault);
    return *core::parse_integer<uint32_t>(text);
}

template <class T>
T one_of(const std::string& choice, std::string text, const core::Words<T>& words) {
    const std::string fault = core::settle_word(text, core::words_of(words));
    if (!fault.empty()) throw InputError("--kernels: " + choice + ": " + fault);
    return *core::find_value(words, text);
}

void set_tile(passes::KernelConfig& config, const std::string& choice, const std::string& value) {
    const size_t cross = value.find('x');
    if (cross == std::string::npos) refuse(choice, "tile=WIDTHxHEIGHT");
    config.tile_width = number_in(choice, value.substr(0, cross), 32);
    config.tile_height = number_in(choice, value.substr(cross + 1), 32);
    const uint32_t pixels = config.tile_width * config.tile_height;
    // Lanes are side by side in rows of the tile. A lane keeps its pixels in registers.
    if (config.subgroup % config.tile_width != 0 || pixels % config.subgroup != 0 ||
        pixels > 16 * config.subgroup)
        refuse(choice, "a tile of rows of a subgroup's " + std::to_string(config.subgroup) +
                           " lanes, with at most 16 pixels a lane");
}

void set_choice(passes::KernelConfig& config, const std::string& choice, const gpu::Limits& limits) {
    const size_t sign = choice.find('=');
    const std::string name = choice.substr(0, sign);
    const std::string value = sign == std::string::npos ? "" : choice.substr(sign + 1);
    if (name == "tile") {
        set_tile(config, choice, value);
    } else if (name == "broadcast") {
        config.broadcast = one_of<uint32_t>(choice, value,
                                            {{"shuffles", shared::BROADCAST_SHUFFLES},
                                             {"shared", shared::BROADCAST_SHARED},
                                             {"uniform", shared::BROADCAST_UNIFORM}});
    } else if (name == "sort") {
        config.ranked_sort = one_of<bool>(choice, value, {{"ranked", true}, {"counted", false}});
        if (config.ranked_sort && !passes::can_rank(limits)) refuse(choice, "what this device can do");
    } else if (name == "quads") {
        config.quads = number_in(choice, value, 1024);
        if (config.quads % config.subgroup != 0 || config.quads > passes::most_quads(limits))
            refuse(choice, "a multiple of " + std::to_string(config.subgroup) + " lanes up to " +
                               std::to_string(passes::most_quads(limits)));
    } else if (name == "slots") {
        config.slots = one_of<uint32_t>(
            choice, value, {{"sorted", shared::SLOTS_SORTED}, {"emitted", shared::SLOTS_EMITTED}});
    } else if (name == "order") {
        const bool lists = one_of<bool>(choice, value, {{"splats", false}, {"lists", true}});
        config.sorted_lists = lists ? passes::most_sorted_lists(limits) : 0;
    } else if (name == "counts") {
        config.live_counts = one_of<bool>(choice, value, {{"live", true}, {"capacity", false}});
    } else if (name == "few") {
        config.few_blocks = number_in(choice, value, 65535);
    } else if (name == "scan") {
        config.scan_turns = number_in(choice, value, 1024);
    } else if (name == "elements") {
        config.element_group = number_in(choice, value, limits.max_invocations);
        if (config.element_group % config.subgroup != 0)
            refuse(choice, "a multiple of " + std::to_string(config.subgroup) + " lanes");
    } else if (name == "interleave") {
        config.tile_interleave = number_in(choice, value, 1024);
    } else {
        refuse(choice,
               "one of tile, quads, broadcast, sort, slots, order, counts, few, scan, elements and "
               "interleave with "
               "a value");
    }
}

}  // namespace

passes::KernelConfig config_with(const std::string& text, const gpu::Limits& limits) {
    passes::KernelConfig config = passes::config_for(limits);
    std::istringstream choices(text);
    for (std::string choice; std::getline(choices, choice, ',');) set_choice(config, choice, limits);
    return config;
}

}  // namespace ewa::bench
