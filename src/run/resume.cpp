// SPDX-License-Identifier: Apache-2.0
#include "run/resume.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/hash.h"
#include "core/json.h"
#include "core/json_field.h"
#include "core/text.h"
#include "ewa/error.h"
#include "folders/former_options.h"
#include "folders/run_folder.h"
#include "run/option_table.h"
#include "train/schedule.h"

namespace ewa::train {
namespace {

using core::Hash;
using Json = nlohmann::ordered_json;

// Characters of an option's value that an error shows. The checkpoint may come from a stranger.
constexpr size_t kLongestValue = 200;
constexpr const char* kWaysOut = "; -o DIR starts another run, --force replaces this one";
constexpr double kLeastPause = 30;      // seconds
constexpr double kPausePerSaving = 50;  // times the duration of a save

Json parse_settings(const std::filesystem::path& path, const std::string& stored) {
    Json json;
    try {
        json = core::parse_json<Json>(stored, path.string() + ": its settings");
    } catch (const InputError& error) {
        throw InputError(std::string(error.what()) + kWaysOut);
    }
    if (!json.is_object() || !json.contains("options") || !json["options"].is_object())
        throw InputError(path.string() + ": its settings cannot be read" + kWaysOut);
    json["options"] = folders::with_present_names(std::move(json["options"]));
    return json;
}

/// A value of "reached", which only a run continued with another number of steps has. Wrong values count as absent.
int reached(const Json& settings, const char* name, int absent, int most) {
    const double value = core::number_in(settings.value("reached", Json()), name).value_or(absent);
    return value >= 0 && value <= most && value == std::floor(value) ? int(value) : absent;
}

/// The largest number of splats that a run may have had. 0 if it is not known.
uint32_t cap_of(const Json& settings) {
    const double cap = core::number_in(settings, "cap").value_or(0);
    return cap >= 0 && cap <= UINT32_MAX && cap == std::floor(cap) ? uint32_t(cap) : 0;
}

/// The value as to_config writes it: "1.0,1,1" and "1,1,1" are the same background.
Json normalised(const RunOption& option, const Json& value) {
    try {
        RunOptions options;
        option.set(options, value.is_string() ? value.get<std::string>() : value.dump());
        return option.get(options);
    } catch (const InputError&) {
        return value;
    }
}

bool is_option(const std::string& name) {
    return std::ranges::any_of(run_options(), [&](const RunOption& option) { return option.name == name; });
}

void add_camera(Hash& hash, const Camera& camera) {
    hash.add(camera.width);
    hash.add(camera.height);
    for (const double x : {camera.fx, camera.fy, camera.cx, camera.cy}) hash.add(x);
    for (int c = 0; c < 3; ++c) {
        hash.add(camera.translation[c]);
        for (int r = 0; r < 3; ++r) hash.add(camera.rotation[c][r]);
    }
    if (!camera.readout) return;
    hash.add(int(camera.readout->from));
    for (int c = 0; c < 3; ++c) {
        hash.add(camera.readout->translation[c]);
        for (int r = 0; r < 3; ++r) hash.add(camera.readout->rotation[c][r]);
    }
}

void add_distortion(Hash& hash, const Distortion& d) {
    hash.add(int(d.lens));
    for (const double k : {d.k1, d.k2, d.p1, d.p2, d.k3, d.k4, d.k5, d.k6, d.s1, d.s2, d.s3, d.s4})
        hash.add(k);
    if (d.skew != 0) hash.add(d.skew);
}

}  // namespace

std::string dataset_fingerprint(const Dataset& dataset, const Split& split, bool points) {
    Hash hash;
    if (points)
        for (const glm::dvec3& p : dataset.points.positions)
            for (int c = 0; c < 3; ++c) hash.add(p[c]);
    for (const auto* frames : {&split.train, &split.test}) {
        hash.add(uint64_t(frames->size()));
        for (const int index : *frames) {
            const Frame& frame = dataset.frames[size_t(index)];
            hash.add(frame.name);
            add_camera(hash, frame.camera);
            add_camera(hash, frame.source);
            add_distortion(hash, frame.distortion);
            if (!frame.camera.distortion.none()) add_distortion(hash, frame.camera.distortion);
            hash.add(frame.orientation);
            hash.add(int(frame.masks));
            hash.add(int(frame.mask_path.empty()));
            if (frame.image_exists) core::add_file(hash, frame.image_path);
            if (!frame.mask_path.empty()) core::add_file(hash, frame.mask_path);
            if (!frame.depth_path.empty()) {
                hash.add(frame.depth_unit);
                core::add_file(hash, frame.depth_path);
            }
        }
    }
    return core::digits_of(hash);
}

int continue_from(const std::filesystem::path& path, const Checkpoint& earlier, const RunOptions& asked,
                  RunOptions& options) {
    const Json then = parse_settings(path, earlier.settings);
    RunOptions before = options;
    const auto take = [&](const char* name, RunOptions& into) {
        const RunOption& option = run_option(name);
        Json value = then["options"].value(name, Json());
        if (value.is_null() && !option.before.empty()) value = option.before;
        if (value.is_null()) return;
        try {
            option.set(into, value.is_string() ? value.get<std::string>() : value.dump());
        } catch (const InputError& error) {
            throw InputError(path.string() + ": its settings have --" + name + " " +
                             value.dump().substr(0, kLongestValue) + ", which is no value of it" + kWaysOut);
        }
    };
    take("steps", before);
    if (asked.train.strategy == Strategy::automatic) take("strategy", options);
    if (asked.train.appearance == AppearanceModel::automatic) take("appearance", options);
    if (asked.automatic_background) {
        take("background", options);
        take("background-noise", options);
    }
    if (asked.train.final_splats == kAutomaticFinalSplats) take("final-splats", options);
    if (asked.train.halvings == kAutomaticHalvings) {
        options.train.resolution_every = asked.train.resolution_every;
        take("resolution-schedule", options);
        if (asked.train.resolution_every == TrainOptions().resolution_every)
            take("resolution-every", options);
    }
    options.train.measure_exposures = false;
    const int step = earlier.state.report.step;
    if (options.train.steps < step)
        throw InputError(path.string() + ": is at step " + std::to_string(step) +
                         ", after the last of --steps " + std::to_string(options.train.steps) +
                         "; a larger --steps trains it further, -o DIR starts another run");
    options.train.least_max_splats = cap_of(then);
    options.train.least_sh_degree = reached(then, "sh_degree", 0, kMaxShDegree);
    options.train.most_halvings =
        reached(then, "halvings", TrainOptions().most_halvings, TrainOptions().most_halvings);
    if (before.train.steps == options.train.steps || step == 0) return before.train.steps;
    before.train.least_sh_degree = options.train.least_sh_degree;
    before.train.most_halvings = options.train.most_halvings;
    const Schedule schedule = schedule_for(before.train);
    options.train.least_sh_degree = schedule.degree(step);
    // The steps of the smaller images were chosen for fewer steps in all.
    options.train.most_halvings = asked.train.halvings == kAutomaticHalvings ? 0 : schedule.halvings_at(step);
    return before.train.steps;
}

Json checkpoint_settings(const RunOptions& options, const std::string& fingerprint) {
    Json decisive;
    for (const RunOption& option : run_options())
        if (option.decides_result && is_listed(option, options)) decisive[option.name] = option.get(options);
    Json settings{{"version", EWA_VERSION}, {"dataset", fingerprint}, {"options", decisive}};
    const TrainOptions none;
    if (options.train.least_sh_degree != none.least_sh_degree ||
        options.train.most_halvings != none.most_halvings)
        settings["reached"] = {{"sh_degree", options.train.least_sh_degree},
                               {"halvings", options.train.most_halvings}};
    return settings;
}

void check_resumable(const std::filesystem::path& path, const std::string& stored, const Json& now) {
    const Json then = parse_settings(path, stored);
    for (const RunOption& option : run_options()) {
        if (!option.decides_result || option.name == "steps") continue;
        const Json value = now["options"].value(option.name, option.get(RunOptions()));
        Json other = then["options"].value(option.name, Json());
        if (other.is_null() && !option.before.empty()) other = normalised(option, option.before);
        if (normalised(option, other) != value)
            throw InputError(path.string() + ": was written with --" + option.name + " " +
                             other.dump().substr(0, kLongestValue) + ", not " + value.dump() +
                             "; with its own value the run continues, -o DIR starts another run");
    }
    const auto is_usual = [](const Json& value) {
        return value == false || (value.is_string() && value.get_ref<const std::string&>().empty());
    };
    for (const auto& [name, value] : then["options"].items())
        if (!is_option(name) && !is_usual(value))
            throw InputError(path.string() + ": was written with --" + core::one_line(name) + " " +
                             value.dump().substr(0, kLongestValue) + ", which this version of ewa lacks" +
                             kWaysOut);
    if (now.contains(kMasksSetting) && then.value(kMasksSetting, Json()) != now[kMasksSetting])
        throw InputError(path.string() + ": the masks of --robust beside it, in " +
                         folders::kPassersByFolder +
                         "/, have changed; with the former ones it continues, -o DIR starts another run");
    // Options such as --downscale change the dataset too, and say more.
    if (then.value("dataset", Json()) != now["dataset"])
        throw InputError(path.string() +
                         ": is of another dataset, or its images or cameras have changed; with the "
                         "former images it continues, -o DIR starts another run");
}

std::string resume_remark(const std::string& stored, const Json& now) {
    const Json then = core::parse_json<Json>(stored, "the checkpoint's settings");
    for (const char* name : {"version", "device"})
        if (then.value(name, Json()) != now[name])
            return std::string("resumed with another ") + name + " than it began with";
    return {};
}

bool SavePace::due() const {
    return std::chrono::duration<double>(Clock::now() - last_).count() >= pause_;
}

void SavePace::saved(double seconds_taken) {
    last_ = Clock::now();
    pause_ = std::max(kLeastPause, kPausePerSaving * seconds_taken);
}

}  // namespace ewa::train
