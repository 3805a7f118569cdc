// SPDX-License-Identifier: Apache-2.0
// Options that exclude or need each other. Errors have the names of the command line; the Python package replaces them by its own.
#pragma once
#include <string>
#include <string_view>

#include "ewa/error.h"

namespace ewa::core {

enum class Relation { excludes, needs };

/// A rule for two options. Relation::excludes: `option` may not be used with `other`. Relation::needs: not without `other`.
template <class Options>
struct Exclusion {
    std::string_view option;
    bool (*used)(const Options&);
    Relation relation;
    std::string_view other;
    bool (*other_used)(const Options&);
    std::string_view reason = {};
};

/// "A and B exclude each other: reason"
inline std::string excluded(std::string_view option, std::string_view other, std::string_view reason) {
    std::string text(option);
    text.append(" and ").append(other).append(" exclude each other");
    return reason.empty() ? text : text.append(": ").append(reason);
}

/// Throws InputError for the first row that the options violate.
template <class Rows, class Options>
void check_exclusions(const Rows& rows, const Options& options) {
    for (const Exclusion<Options>& row : rows) {
        const bool excludes = row.relation == Relation::excludes;
        if (!row.used(options) || row.other_used(options) != excludes) continue;
        if (excludes) throw InputError(excluded(row.option, row.other, row.reason));
        throw InputError(std::string(row.option).append(" is an option of ").append(row.other));
    }
}

/// Makes an empty value of any option an error: a shell variable that is not set gives one. Call it once all options are added.
/// A template, so that this module does not need CLI11: Validator is CLI::Validator.
template <class Validator, class App>
void refuse_empty_values(App& app) {
    const auto check = [](std::string& value) {
        return std::string(value.empty() ? "the value is empty; leave the option out, or give it one" : "");
    };
    for (auto* option : app.get_options())
        if (option->get_items_expected_max() > 0) option->transform(Validator(check, ""));
    for (auto* command : app.get_subcommands({})) refuse_empty_values<Validator>(*command);
}

}  // namespace ewa::core
