// SPDX-License-Identifier: Apache-2.0
// A training run, for those who read its folder: its splats, its dataset and its options.
#pragma once
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "folders/run_folder.h"

namespace ewa::folders {

struct Run {
    std::filesystem::path folder;
    std::filesystem::path splats;  // folder/splats.ply; empty if there is none yet
    /// Of the splats: config.json's dataset, or the one that the run made of a mesh scene, photos or a video. Empty if it was not
    /// found; named_dataset then says which.
    std::filesystem::path dataset;
    std::string named_dataset;                         // as in config.json; empty: none
    nlohmann::json config = nlohmann::json::object();  // of the run; empty if it cannot be read

    /// folder/cameras.json, the refined cameras of the dataset; empty if there is none.
    std::filesystem::path refined_cameras() const;
    /// Whether the run made its dataset, of named_dataset.
    bool made_dataset() const;
    /// The option's text in config.json; empty if it is not a text.
    std::string text(const char* option) const;
    /// The option's number in config.json, in this range; `absent` if it is not a number.
    int number(const char* option, int least, int most, int absent) const;
    /// Whether the option is a flag that is set.
    bool flag(const char* option) const;
};

/// The folder that a path of the run's config.json is relative to: empty for the current one, or any folder above the run.
/// No value if the path names nothing there.
std::optional<std::filesystem::path> base_of(const std::filesystem::path& run,
                                             const std::filesystem::path& named);

/// The run whose folder this is, also if it has just begun: with config.json, splats.ply or metrics.jsonl. Empty for
/// any other path. The dataset is searched relative to the folder where the training was started: the current one, or
/// any folder above the run.
std::optional<Run> find_run(const std::filesystem::path& folder);

/// The runs in this folder, such as "out/a, out/b and 3 more". Empty if there are none.
std::string runs_in(const std::filesystem::path& folder);

/// The run that wrote this splat file: splats.ply, or one that --keep stores, with config.json beside it. Empty for any other path.
std::optional<Run> run_of_splats(const std::filesystem::path& splats);

/// The folder of the run that this path is a file of, also through symbolic links: it has the name of such a file, and a
/// run's config.json is in its folder. The file itself need not exist. Empty for any other path.
std::optional<std::filesystem::path> run_of_file(const std::filesystem::path& file);

}  // namespace ewa::folders
