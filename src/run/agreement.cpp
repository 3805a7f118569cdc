// SPDX-License-Identifier: Apache-2.0
#include "run/agreement.h"

#include <array>

#include "core/hash.h"
#include "ewa/error.h"
#include "gpu/device.h"
#include "passes/kernel_config.h"
#include "portions/collect.h"
#include "run/option_table.h"
#include "run/resume.h"
#include "scene/splat_arrays.h"

namespace ewa::train {
namespace {

using Json = nlohmann::ordered_json;

/// The value as on the command line.
std::string shown(const Json& value) {
    return value.is_string() ? value.get<std::string>() : value.dump();
}

void take_options(const Json& settings, RunOptions& options) {
    for (const auto& [name, value] : settings.at("options").items())
        run_option(name).set(options, shown(value));
    const Json reached = settings.value("reached", Json::object());
    options.train.least_sh_degree = reached.value("sh_degree", TrainOptions().least_sh_degree);
    options.train.most_halvings = reached.value("halvings", TrainOptions().most_halvings);
}

uint64_t hash_of(const std::string& text) {
    core::Hash hash;
    hash.add(text);
    return hash.value();
}

uint64_t hash_of(const Gaussians& splats) {
    core::Hash hash;
    hash.add(splats.sh_degree);
    for (int axis = 0; axis < 3; ++axis) hash.add(splats.origin[axis]);
    for (const auto& [values, each] : scene::arrays_of(splats)) {
        hash.add(uint64_t(values->size()));
        hash.add(values->data(), values->size() * sizeof(float));
    }
    return hash.value();
}

Json parsed(const std::vector<std::byte>& text) {
    const char* begin = reinterpret_cast<const char*>(text.data());
    return Json::parse(begin, begin + text.size());
}

/// What of the device decides the bytes: which kernels it gets.
uint64_t kernels_of(const gpu::Device& device) {
    const passes::KernelConfig config = passes::config_for(device.limits());
    core::Hash hash;
    for (const uint32_t value : {config.subgroup, config.tile_width, config.tile_height, config.broadcast,
                                 uint32_t(config.ranked_sort), config.slots, config.quads,
                                 config.sorted_lists, uint32_t(config.texel_buffers)})
        hash.add(value);
    return hash.value();
}

}  // namespace

void agree_on_options(RunOptions& options) {
    Ranks& ranks = *options.ranks;
    if (ranks.size() == 1) return;
    Json asked{{"resume", options.resume}, {"options", Json::object()}};
    for (const RunOption& option : run_options())
        if (option.decides_result) asked["options"][option.name] = option.get(options);
    const std::string text = asked.dump(-1, ' ', false, Json::error_handler_t::replace);
    const Json first = parsed(portions::from_rank_0(ranks, std::as_bytes(std::span(text))));
    for (const auto& [name, value] : first.at("options").items()) {
        if (value == asked["options"].value(name, Json())) continue;
        // The run's folder has the options of a run that is resumed. Another node may lack it.
        if (!first.at("resume").get<bool>())
            throw InputError("--" + name + " is " + shown(asked["options"].value(name, Json())) + " on " +
                             ranks.name(ranks.rank()) + ", and " + shown(value) + " on " + ranks.name(0) +
                             "; all ranks need the same");
        run_option(name).set(options, shown(value));
    }
}

void agree(RunOptions& options, const Json& settings, const std::string& fingerprint, const Gaussians& start,
           const gpu::Device& device) {
    Ranks& ranks = *options.ranks;
    if (ranks.size() == 1) return;
    constexpr std::array kParts{"another version of ewa", "another dataset, or other images or cameras in it",
                                "other first splats (--init, or the dataset's points)",
                                "a device that runs other kernels"};
    const std::array<uint64_t, kParts.size()> own{hash_of(EWA_VERSION), hash_of(fingerprint), hash_of(start),
                                                  kernels_of(device)};
    const std::vector<uint64_t> all = ranks.gather(own);
    for (size_t i = 0; i < all.size(); ++i)
        if (all[i] != all[i % kParts.size()])
            throw InputError(ranks.name(int(i / kParts.size())) + " has " + kParts[i % kParts.size()] +
                             " than " + ranks.name(0));
    const std::string text = settings.dump();
    const std::vector<std::byte> received = portions::from_rank_0(ranks, std::as_bytes(std::span(text)));
    if (ranks.rank() != 0) take_options(parsed(received), options);
}

}  // namespace ewa::train
