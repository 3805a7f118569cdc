// SPDX-License-Identifier: Apache-2.0
// Options from a JSON file, under the names they have on the command line.
#pragma once
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace CLI {
class App;
}

namespace ewa::cli {

/// Sets each option of `app` that the command line lacks to the file's value. --kernel and --points count as
/// one option. The file may use names of earlier versions of ewa. Unknown names with a null or empty value are ignored.
/// Throws InputError for a file that is not a JSON object of known names, and for a value of
/// another JSON type than a run's config.json has. Throws CLI::Error for a value that its option refuses.
void apply_config(CLI::App& app, const std::filesystem::path& file);

/// Sets the options as apply_config() does, from the values of a run. where: the run's config.json. Ignores names that `app`
/// lacks, because other versions of ewa have other options. Throws InputError for a value that its option refuses.
void apply_run_config(CLI::App& app, const nlohmann::json& values, const std::filesystem::path& where);

/// Sets one option as apply_config() does. Does nothing if `app` lacks it. where: the file that has the value. Throws
/// InputError for a value that its option refuses.
void apply_config_value(CLI::App& app, const std::string& name, const nlohmann::json& value,
                        const std::filesystem::path& where);

}  // namespace ewa::cli
