// SPDX-License-Identifier: Apache-2.0
// A training run as its folder has it: splats, dataset and options.
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
    /// The dataset of the splats: that of config.json, or the one that the run made of a mesh scene, photos or a video. Empty if
    /// the dataset was not found; named_dataset is then its name.
    std::filesystem::path dataset;
    std::string named_dataset;                         // the dataset's path in config.json; empty: none
    nlohmann::json config = nlohmann::json::object();  // contents of config.json; empty if it cannot be read

    /// folder/cameras.json, the refined cameras of the dataset; empty if there is none.
    std::filesystem::path refined_cameras() const;
    /// Whether the run made its dataset, from the input named_dataset.
    bool made_dataset() const;
    /// The option's text in config.json; empty if it is not a text.
    std::string text(const char* option) const;
    /// The option's number in config.json, in this range; `absent` if it is not a number.
    int number(const char* option, int least, int most, int absent) const;
    /// Whether the option is a flag that is set.
    bool flag(const char* option) const;
};

/// The folder to which a path in the run's config.json is relative: the current one (an empty path), or a folder above the run. No
/// value if the path exists in none of them.
std::optional<std::filesystem::path> base_of(const std::filesystem::path& run,
                                             const std::filesystem::path& named);

/// The run in this folder, which has config.json, splats.ply or metrics.jsonl; the run may just have begun. Empty for any other
/// path. The dataset is searched relative to the folder where the training was started: the current one, or any folder above the
/// run.
std::optional<Run> find_run(const std::filesystem::path& folder);

/// A text on the runs in this folder, such as "out/a, out/b and 3 more". Empty if there are none.
std::string runs_in(const std::filesystem::path& folder);

/// The run that wrote this splat file: splats.ply, or one that --keep stores, with config.json beside it. Empty for any other path.
std::optional<Run> run_of_splats(const std::filesystem::path& splats);

/// The folder of the run to which this file belongs, also through symbolic links. The file has the name of a run's file, and its
/// folder has a run's config.json. The file need not exist. Empty for any other path.
std::optional<std::filesystem::path> run_of_file(const std::filesystem::path& file);

}  // namespace ewa::folders
