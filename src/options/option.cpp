// SPDX-License-Identifier: Apache-2.0
#include "options/option.h"

#include <algorithm>
#include <cctype>

#include "edit/edits.h"
#include "run/option_table.h"

namespace ewa::options {
namespace {

/// Gives the row what the option of a training run has, and its command.
void join(Option& row, const train::RunOption& run) {
    row.commands += run.brief.empty() ? " train" : " train!";
    row.subject = run.subject;
    row.value = run.flag || is_positional(row) ? "" : run.value;
    row.help = run.help;
    row.choices = run.choices;
    row.run = &run;
    if (!run.brief.empty()) row.brief = run.brief;
}

void add_run_options(std::vector<Option>& all) {
    for (const train::RunOption& run : train::run_options()) {
        const std::string name = run.name == "dataset" ? "DATASET" : run.name;
        const auto shared = std::ranges::find_if(
            all, [&](const Option& row) { return row.name == name && row.help.empty(); });
        join(shared == all.end() ? all.emplace_back(Option{.name = name}) : *shared, run);
    }
}

void add_edits(std::vector<Option>& all) {
    for (const edit::Row& row : edit::rows()) {
        all.push_back({row.name, *row.brief ? "convert!" : "convert", kEdits, row.value, row.help});
        all.back().brief = row.brief;
        all.back().repeats = true;
    }
}

}  // namespace

bool is_positional(const Option& option) {
    return std::isupper(static_cast<unsigned char>(option.name[0]));
}

bool is_flag(const Option& option) {
    return option.value.empty() && option.choices.empty() && !is_positional(option);
}

const std::vector<Option>& all_options() {
    static const std::vector<Option> table = [] {
        std::vector<Option> all = rows();
        add_run_options(all);
        add_edits(all);
        std::ranges::stable_sort(all, {}, &Option::name);
        return all;
    }();
    return table;
}

const Option* find_option(std::string_view command, std::string_view name) {
    for (const Option& option : all_options())
        if (option.name == name &&
            (has_word(option.commands, command) || is_in_short_help(option, std::string(command))))
            return &option;
    return nullptr;
}

bool is_in_short_help(const Option& option, const std::string& command) {
    return has_word(option.commands, command + "!");
}

bool has_word(std::string_view list, std::string_view word) {
    while (!list.empty()) {
        const size_t end = std::min(list.find(' '), list.size());
        if (list.substr(0, end) == word) return true;
        list.remove_prefix(std::min(end + 1, list.size()));
    }
    return false;
}

}  // namespace ewa::options
