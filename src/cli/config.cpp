// SPDX-License-Identifier: Apache-2.0
#include "cli/config.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>
#include <vector>

#include "core/folders.h"
#include "core/json.h"
#include "core/text.h"
#include "ewa/error.h"
#include "folders/former_options.h"
#include "report/summary.h"
#include "run/option_table.h"

namespace ewa::cli {
namespace {

using report::Json;

constexpr std::array<std::string_view, 4> kOnlyOnCommandLine{"output", "force", "resume", "serve"};

/// Whether the option's value is a number, as config.json of a run has it.
bool takes_number(const std::string& name, const Json& value) {
    const auto& all = train::run_options();
    const auto option =
        std::find_if(all.begin(), all.end(), [&](const auto& one) { return one.name == name; });
    if (option == all.end()) return false;
    RunOptions options;
    if (option->get(options).is_number()) return true;
    try {
        option->set(options, value.get<std::string>());
    } catch (const InputError&) {
        return false;  // the option itself will refuse it
    }
    return option->get(options).is_number();
}

/// Refuses a value of another JSON type than config.json of a run has.
void check_type(const CLI::Option& option, const Json& value, const std::string& where) {
    const std::string name = option.get_lnames().empty() ? "dataset" : option.get_lnames().front();
    const bool flag = option.get_expected_max() == 0;
    if (flag && !value.is_boolean()) throw InputError(where + " must be true or false, without quotes");
    if (!flag && value.is_boolean()) throw InputError(where + " takes a value, not true or false");
    if (value.is_string() && takes_number(name, value))
        throw InputError(where + " must be a number, without quotes");
    // A device and a port may be numbers or texts.
    const bool text = name == "dataset" || name == "init";
    if (text && !value.is_string()) throw InputError(where + " must be a text in quotes");
    if (value.is_array() && name != "background") throw InputError(where + " takes one value, not a list");
}

/// The value as the command line takes it.
std::string option_text(const Json& value, const std::string& where) {
    if (value.is_string()) return core::with_home(value.get<std::string>());
    if (value.is_number() || value.is_boolean()) return value.dump();
    if (value.is_array()) {  // a background
        std::string text;
        for (const Json& part : value) text += (text.empty() ? "" : ",") + option_text(part, where);
        return text;
    }
    throw InputError(where + " is neither a number, a text nor true or false");
}

/// Runs write their options without a value, too.
bool says_nothing(const Json& value) {
    return value.is_null() || value == "";
}

CLI::Option* find_option(CLI::App& app, const std::string& name) {
    if (name == "dataset") return app.get_option_no_throw("DATASET");
    if (name == "config" || name == "help" || name == "help-all") return nullptr;
    return app.get_option_no_throw("--" + name);
}

bool given(CLI::App& app, const std::string& name) {
    // Each of these says how a splat is drawn.
    const std::array ways{"kernel", "points"};
    if (std::ranges::find(ways, name) != ways.end())
        return std::ranges::any_of(ways, [&](const char* way) {
            const CLI::Option* option = find_option(app, way);
            return option && option->count() > 0;
        });
    return find_option(app, name)->count() > 0;
}

}  // namespace

void apply_config(CLI::App& app, const std::filesystem::path& file) {
    const auto json = folders::with_present_names(core::read_json_file<Json>(file));
    if (!json.is_object()) throw InputError(file.string() + ": not a JSON object of options");
    std::vector<std::pair<CLI::Option*, std::string>> values;
    for (const auto& [name, value] : json.items()) {
        const std::string where = file.string() + ": \"" + name + "\"";
        CLI::Option* option = find_option(app, name);
        // A run of another version of ewa writes its options without a value, too.
        if (!option && (says_nothing(value) || value == false)) continue;
        if (!option) throw InputError(where + " is not an option of ewa " + app.get_name());
        // A file from a stranger decides neither what is replaced nor who may connect.
        if (std::ranges::find(kOnlyOnCommandLine, name) != kOnlyOnCommandLine.end())
            throw InputError(where + " belongs on the command line, not into a file: --" + name);
        if (says_nothing(value) || given(app, name)) continue;
        values.emplace_back(option, option_text(value, where));
        check_type(*option, value, where);
    }
    for (const auto& [option, text] : values) {
        option->add_result(text);
        option->run_callback();
    }
}

void apply_run_config(CLI::App& app, const nlohmann::json& values, const std::filesystem::path& where) {
    std::vector<std::pair<CLI::Option*, std::string>> given_by_run;
    for (const auto& [name, value] : values.items()) {
        CLI::Option* option = find_option(app, name);
        if (!option || says_nothing(value) || value == false || given(app, name)) continue;
        given_by_run.emplace_back(option, option_text(value, where.string() + ": \"" + name + "\""));
    }
    try {
        for (const auto& [option, text] : given_by_run) {
            option->add_result(text);
            option->run_callback();
        }
    } catch (const CLI::Error& error) {
        throw InputError(core::one_line(where.string()) + ": " + error.what());
    }
}

void apply_config_value(CLI::App& app, const std::string& name, const nlohmann::json& value,
                        const std::filesystem::path& where) {
    apply_run_config(app, {{name, value}}, where);
}

}  // namespace ewa::cli
