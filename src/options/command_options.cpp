// SPDX-License-Identifier: Apache-2.0
#include "options/command_options.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "core/exclusion.h"
#include "core/text.h"
#include "ewa/error.h"
#include "options/rules.h"
#include "run/option_table.h"

namespace ewa::options {
namespace {

/// Accepts one of the words, in either spelling of colour. The help lists them.
CLI::Validator one_of(const std::vector<std::string>& words) {
    std::string all;
    for (const std::string& word : words) all += (all.empty() ? "" : "|") + word;
    return CLI::Validator([words](std::string& text) { return core::settle_word(text, words); }, all);
}

/// The check of a training run's option, which names neither the option nor where it was read. plain: numbers get plain digits.
CLI::Validator accepted_by(const train::RunOption& option, bool plain) {
    return CLI::Validator(
        [&option, plain](std::string& text) {
            try {
                RunOptions scratch;
                option.set(scratch, text);
                if (plain) text = train::value_text(option, scratch);
                return std::string();
            } catch (const InputError& error) {
                return std::string(error.what());
            }
        },
        "");
}

const Option* row_of(const CLI::App& command, const CLI::Option& option) {
    return find_option(command.get_name(),
                       option.get_lnames().empty() ? option.get_name() : option.get_lnames().front());
}

const CLI::Option* typed(const CLI::App& command, std::string_view name) {
    const CLI::Option* option = command.get_option_no_throw("--" + std::string(name));
    return option && option->count() > 0 ? option : nullptr;
}

/// Whether the condition holds: a name that was typed, or name=value|value, where the usual value counts, too.
bool holds(const CLI::App& command, std::string_view condition) {
    const size_t equals = condition.find('=');
    const std::string_view name = condition.substr(0, equals);
    const CLI::Option* option = typed(command, name);
    if (equals == std::string_view::npos) return option != nullptr;
    const std::string value =
        option ? option->results().back() : command.get_option("--" + std::string(name))->get_default_str();
    std::string values(condition.substr(equals + 1));
    std::ranges::replace(values, '|', ' ');
    return has_word(values, value);
}

/// "--mode color or alpha" of mode=color|alpha.
std::string shown(std::string_view condition) {
    std::string text = "--";
    for (const char c : condition) text += c == '=' ? " " : c == '|' ? " or " : std::string(1, c);
    return text;
}

std::vector<std::string_view> words_in(std::string_view list) {
    std::vector<std::string_view> words;
    while (!list.empty()) words.push_back(core::next_word(list));
    return words;
}

void check_rule(const CLI::App& command, const Rule& rule, std::string_view option, std::string_view other) {
    const bool excludes = rule.relation == core::Relation::excludes;
    if (!holds(command, option) || holds(command, other) != excludes) return;
    if (excludes) throw InputError(core::excluded(shown(option), shown(other), rule.reason));
    const Option& needed = option_of(command, other.substr(0, other.find('=')));
    const bool any_value = other.find('=') == std::string_view::npos && !needed.value.empty();
    throw InputError(shown(option) + " needs " + shown(other) + (any_value ? " " + needed.value : "") +
                     (*rule.reason ? std::string(": ") + rule.reason : ""));
}

}  // namespace

const Option& option_of(const CLI::App& command, std::string_view name) {
    const Option* option = find_option(command.get_name(), name);
    if (!option) throw std::logic_error(command.get_name() + " has no row of " + std::string(name));
    return *option;
}

std::string spelled(const Option& option) {
    return is_positional(option) ? option.name : "--" + option.name + option.also;
}

CLI::Option* as_in_row(CLI::Option* added, const Option& option, bool number) {
    const bool flag = is_flag(option);
    if (!flag) added->type_name(option.choices.empty() ? option.value : "TEXT");
    if (!option.choices.empty())
        added->transform(one_of(option.choices));
    else if (option.run && !flag)
        added->transform(accepted_by(*option.run, number));
    if (option.run && !flag)
        added->default_str(train::value_text(*option.run, RunOptions()));
    else if (option.shows_usual)
        added->capture_default_str();
    if (option.repeats) {
        if (flag)
            added->disable_flag_override();
        else
            added->expected(1);
        added->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    }
    if (!is_positional(option)) added->group(option.subject);
    return added->required(option.is_required);
}

CLI::Option* add(CLI::App& command, std::string_view name, RunOptions& variable) {
    const Option& option = option_of(command, name);
    const train::RunOption& run = *option.run;
    if (run.flag)
        return as_in_row(command.add_flag(spelled(option), run.flag(variable), option.help), option);
    const auto set = [&run, &variable](const std::string& text) { run.set(variable, text); };
    return as_in_row(command.add_option_function<std::string>(spelled(option), set, option.help), option);
}

CLI::Option* add(CLI::App& command, std::string_view name) {
    const Option& option = option_of(command, name);
    return as_in_row(is_flag(option) ? command.add_flag(spelled(option), option.help)
                                     : command.add_option(spelled(option), option.help),
                     option);
}

void arrange_help(CLI::App& command) {
    constexpr size_t kFewOptions = 8;  // more have subjects
    const std::vector<CLI::Option*> all = command.get_options();
    core::ShortHelp brief;
    for (CLI::Option* added : all) {
        const Option* option = row_of(command, *added);
        if (!option) continue;
        if (is_in_short_help(*option, command.get_name())) brief[option->name] = option->brief;
        const bool apart = option->subject == kHidden || option->subject == kDevelopers;
        if (all.size() <= kFewOptions && !apart) added->group("Options");
    }
    if (brief.empty()) return;
    brief.insert({{"help", "Print this help and exit"}, {"help-all", ""}});
    command.set_help_all_flag("--help-all", "Print the help of all options and exit");
    core::use_help_text<CLI::Formatter>(command, std::move(brief));
}

std::vector<std::string> option_names(const CLI::App& command) {
    std::vector<std::string> names;
    for (const CLI::Option* option : command.get_options())
        for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    return names;
}

TypedFiles typed_files(const CLI::App& command) {
    TypedFiles files;
    for (const CLI::Option* given : command.get_options()) {
        const Option* option = row_of(command, *given);
        if (!option || option->role == Role::none) continue;
        for (const std::string& path : given->results())
            (option->role == Role::output ? files.written : files.read)
                .push_back({is_positional(*option) ? option->name : "--" + option->name, path});
    }
    return files;
}

void check_typed(const CLI::App& command) {
    for (const Rule& rule : rules())
        if (has_word(rule.commands, command.get_name()))
            for (const std::string_view option : words_in(rule.options))
                for (const std::string_view other : words_in(rule.others))
                    check_rule(command, rule, option, other);
}

}  // namespace ewa::options
