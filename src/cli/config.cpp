// SPDX-License-Identifier: Apache-2.0
#include "cli/config.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "core/json.h"
#include "core/text.h"
#include "ewa/error.h"
#include "report/summary.h"

namespace ewa::cli {
namespace {

using report::Json;

/// As the value would stand on the command line.
std::string option_text(const Json& value, const std::string& where) {
    if (value.is_string()) return value.get<std::string>();
    if (value.is_number() || value.is_boolean()) return value.dump();
    if (value.is_array()) {  // a background
        std::string text;
        for (const Json& part : value) text += (text.empty() ? "" : ",") + option_text(part, where);
        return text;
    }
    throw InputError(where + " is neither a number, a text nor true or false");
}

CLI::Option* find_option(CLI::App& app, const std::string& name) {
    if (name == "dataset") return app.get_option_no_throw("DATASET");
    if (name == "config" || name == "help") return nullptr;
    return app.get_option_no_throw("--" + name);
}

bool given(CLI::App& app, const std::string& name) {
    if (name == "kernel" || name == "antialias")
        return app.get_option("--kernel")->count() > 0 || app.get_option("--antialias")->count() > 0;
    return find_option(app, name)->count() > 0;
}

}  // namespace

void apply_config(CLI::App& app, const std::filesystem::path& file) {
    const Json json = core::read_json_file<Json>(file);
    if (!json.is_object()) throw InputError(file.string() + ": not a JSON object of options");
    std::vector<std::pair<CLI::Option*, std::string>> values;
    for (const auto& [name, value] : json.items()) {
        const std::string where = file.string() + ": \"" + name + "\"";
        CLI::Option* option = find_option(app, name);
        if (!option) throw InputError(where + " is not an option of ewa " + app.get_name());
        if (!value.is_null() && !given(app, name)) values.emplace_back(option, option_text(value, where));
    }
    for (const auto& [option, text] : values) {
        option->add_result(text);
        option->run_callback();
    }
}

void apply_config_value(CLI::App& app, const std::string& name, const nlohmann::json& value,
                        const std::filesystem::path& where) {
    CLI::Option* option = find_option(app, name);
    if (!option || given(app, name)) return;
    try {
        option->add_result(option_text(value, where.string() + ": \"" + name + "\""));
        option->run_callback();
    } catch (const CLI::Error& error) {
        throw InputError(core::one_line(where.string()) + ": " + error.what());
    }
}

}  // namespace ewa::cli
