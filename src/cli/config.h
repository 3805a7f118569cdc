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

/// Gives each option of `app` the file's value if the command line has none. --kernel and --points
/// count as one option. It reads names of earlier versions of ewa, and ignores unknown names without a value.
/// Throws InputError for a file that is not a JSON object of known names, and for a value of
/// another JSON type than a run's config.json has. Throws CLI::Error for a value that its option refuses.
void apply_config(CLI::App& app, const std::filesystem::path& file);

/// The same with the values of a run, whose config.json `where` is. It ignores names that `app` lacks: other versions of ewa
/// have other options. Throws InputError for a value that its option refuses.
void apply_run_config(CLI::App& app, const nlohmann::json& values, const std::filesystem::path& where);

/// The same for one option, which `app` may lack. where: the file that has the value. Throws InputError for a value
/// that its option refuses.
void apply_config_value(CLI::App& app, const std::string& name, const nlohmann::json& value,
                        const std::filesystem::path& where);

}  // namespace ewa::cli
