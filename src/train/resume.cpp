// SPDX-License-Identifier: Apache-2.0
#include "train/resume.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/json.h"
#include "ewa/error.h"
#include "train/run_options.h"

namespace ewa::train {
namespace {

using Json = nlohmann::ordered_json;

// Of an option's value in an error. The checkpoint may come from a stranger.
constexpr size_t kLongestValue = 200;
constexpr double kLeastPause = 30;      // seconds
constexpr double kPausePerSaving = 50;  // times the duration of a save

Json parse_settings(const std::filesystem::path& path, const std::string& stored) {
    const std::string way_out = "; without --resume the training starts anew";
    Json json;
    try {
        json = core::parse_json<Json>(stored, path.string() + ": its settings");
    } catch (const InputError& error) {
        throw InputError(error.what() + way_out);
    }
    if (!json.is_object() || !json.contains("options") || !json["options"].is_object())
        throw InputError(path.string() + ": its settings cannot be read" + way_out);
    return json;
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

}  // namespace

Json checkpoint_settings(const RunOptions& options, const std::string& fingerprint) {
    Json decisive;
    for (const RunOption& option : run_options())
        if (option.decides_result) decisive[option.name] = option.get(options);
    Json json;
    json["version"] = EWA_VERSION;
    json["dataset"] = fingerprint;
    json["options"] = decisive;
    return json;
}

void check_resumable(const std::filesystem::path& path, const std::string& stored, const Json& now) {
    const Json then = parse_settings(path, stored);
    const std::string way_out = "; without --resume the training starts anew, -o takes another folder";
    if (then.value("dataset", Json()) != now["dataset"])
        throw InputError(path.string() + ": is of another dataset, or its images or cameras have changed" +
                         way_out);
    for (const auto& [name, value] : now["options"].items()) {
        const Json other = then["options"].value(name, Json());
        if (normalised(run_option(name), other) != value)
            throw InputError(path.string() + ": was written with --" + name + " " +
                             other.dump().substr(0, kLongestValue) + ", not " + value.dump() + way_out);
    }
}

std::string resume_remark(const std::string& stored, const Json& now) {
    const Json then = core::parse_json<Json>(stored, "the checkpoint's settings");
    for (const char* name : {"version", "device"})
        if (then.value(name, Json()) != now[name])
            return std::string("resumed with another ") + name + " than it began with";
    return {};
}

bool SavePace::due(int step) const {
    if (every_ > 0) return step % every_ == 0;
    return std::chrono::duration<double>(Clock::now() - last_).count() >= pause_;
}

void SavePace::saved(double seconds_taken) {
    last_ = Clock::now();
    pause_ = std::max(kLeastPause, kPausePerSaving * seconds_taken);
}

}  // namespace ewa::train
