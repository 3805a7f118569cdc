// SPDX-License-Identifier: Apache-2.0
#include "cli/manual.h"

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <filesystem>

#include "cli/output.h"
#include "core/atomic_file.h"

namespace ewa::cli {
namespace {

/// Text that troff prints as it is: no escapes, no line that begins as a request.
std::string troff(const std::string& text) {
    std::string out;
    for (const char c : text) {
        if (c == '\\')
            out += "\\e";
        else if (c == '-')
            out += "\\-";
        else if ((c == '.' || c == '\'') && (out.empty() || out.back() == '\n'))
            out += std::string("\\&") + c;
        else
            out += c;
    }
    return out;
}

std::vector<const CLI::Option*> options_of(const CLI::App& app) {
    std::vector<const CLI::Option*> named;
    for (const CLI::Option* option : app.get_options())
        if (!option->get_positional() && !option->get_group().empty()) named.push_back(option);
    return named;
}

std::vector<const CLI::Option*> positionals_of(const CLI::App& app) {
    std::vector<const CLI::Option*> found;
    for (const CLI::Option* option : app.get_options())
        if (option->get_positional()) found.push_back(option);
    return found;
}

std::vector<std::string> names_of(const CLI::Option& option) {
    std::vector<std::string> names;
    for (const std::string& name : option.get_snames()) names.push_back("-" + name);
    for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
    return names;
}

bool takes_value(const CLI::Option& option) {
    return option.get_items_expected_max() > 0;
}

/// {adc,mcmc,none} of an option that takes one of a set, as CLI11 describes it; else nothing.
std::vector<std::string> values_of(const CLI::Option& option) {
    std::vector<std::string> values;
    const std::string text = option.get_type_name();
    const size_t begin = text.find('{'), end = text.find('}');
    if (begin == std::string::npos || end == std::string::npos || end < begin) return values;
    std::string value;
    for (size_t i = begin + 1; i <= end; ++i) {
        if (i < end && text[i] != ',') {
            value += text[i];
            continue;
        }
        values.push_back(value);
        value.clear();
    }
    return values;
}

std::string option_entry(const CLI::Option& option) {
    std::string line = ".TP\n";
    std::string names;
    for (const std::string& name : names_of(option)) names += (names.empty() ? "" : ", ") + name;
    line += ".B " + troff(names);
    const std::vector<std::string> values = values_of(option);
    std::string type = option.get_type_name();
    if (!values.empty()) type = type.substr(type.find('{') + 1, type.find('}') - type.find('{') - 1);
    if (takes_value(option) && !type.empty()) line += " \\fI" + troff(type) + "\\fR";
    line += "\n" + troff(option.get_description());
    if (!option.get_default_str().empty() && takes_value(option))
        line += troff(" [" + option.get_default_str() + "]");
    return line + "\n";
}

std::string synopsis(const std::string& who, const CLI::App& app) {
    std::string line = ".B " + who + "\n";
    for (const CLI::Option* option : positionals_of(app)) {
        const std::string name = option->get_name(true);
        line += "\\fI" + troff(name) + "\\fR" + (option->get_items_expected_max() > 1 ? "..." : "") + "\n";
    }
    return line + "[\\fIoptions\\fR]\n";
}

constexpr const char* kExitStatus =
    ".SH EXIT STATUS\n"
    "0 done; 1 it failed while running; 2 wrong use or unreadable input{}.\n"
    "An error is one line on standard error.\n";

constexpr const char* kSignals =
    ".SH SIGNALS\n"
    "SIGINT (Ctrl\\-C), SIGTERM and SIGHUP end a training after its step, rendering after the picture and\n"
    "photographing after the view in hand; what is done is saved, however often they come meanwhile.\n"
    "Other commands end at once, and what they were to write stays as it was.\n"
    "SIGQUIT (Ctrl\\-\\e) ends each at once; a training then goes on from its last checkpoint.\n";

std::string quoted(const std::string& text) {
    std::string out = "'";
    for (const char c : text) out += c == '\'' ? std::string("\\'") : std::string(1, c);
    return out + "'";
}

std::string joined(const std::vector<std::string>& words) {
    std::string out;
    for (const std::string& word : words) out += (out.empty() ? "" : " ") + word;
    return out;
}

/// What completes the options of `app`: their names, and for those that take one of a set an entry of a
/// `case` whose patterns begin with `before`.
struct BashWords {
    std::string names, values;
};

BashWords bash_words(const CLI::App& app, const std::string& before) {
    BashWords words;
    for (const CLI::Option* option : options_of(app)) {
        const std::vector<std::string> choice = values_of(*option);
        for (const std::string& name : names_of(*option)) {
            words.names += (words.names.empty() ? "" : " ") + name;
            if (!choice.empty())
                words.values += fmt::format("        '{}{}') words='{}' ;;\n", before, name, joined(choice));
        }
    }
    return words;
}

std::string fish_options(const CLI::App& app, const std::string& begin) {
    std::string out;
    for (const CLI::Option* option : options_of(app)) {
        out += begin;
        for (const std::string& name : option->get_snames()) out += " -s " + name;
        for (const std::string& name : option->get_lnames()) out += " -l " + name;
        const std::vector<std::string> choice = values_of(*option);
        if (!choice.empty())
            out += " -x -a " + quoted(joined(choice));
        else if (takes_value(*option))
            out += " -r";
        out += " -d " + quoted(option->get_description()) + "\n";
    }
    return out;
}

}  // namespace

std::vector<const CLI::App*> shown_commands(const CLI::App& program) {
    std::vector<const CLI::App*> shown;
    for (const CLI::App* command : program.get_subcommands([](const CLI::App*) { return true; }))
        if (!command->get_group().empty()) shown.push_back(command);
    return shown;
}

std::string manual_page(const CLI::App& program, const CLI::App* command) {
    const CLI::App& app = command ? *command : program;
    const std::string name = program.get_name();
    const std::string dashed = command ? name + "-" + command->get_name() : name;
    const std::string who = command ? name + " " + command->get_name() : name;
    const std::vector<const CLI::App*> commands =
        command ? std::vector<const CLI::App*>() : shown_commands(program);
    std::string page = fmt::format(".TH {} 1 \"\" \"ewa {}\"\n.SH NAME\n{} \\- {}\n.SH SYNOPSIS\n", dashed,
                                   EWA_VERSION, troff(dashed), troff(app.get_description()));
    page += commands.empty() ? synopsis(who, app) : ".B " + name + "\n\\fIcommand\\fR [\\fIarguments\\fR]\n";
    if (!commands.empty()) page += ".SH COMMANDS\n";
    for (const CLI::App* one : commands)
        page += ".TP\n.BR " + troff(name + "-" + one->get_name()) + " (1)\n" + troff(one->get_description()) +
                "\n";
    if (!positionals_of(app).empty()) page += ".SH ARGUMENTS\n";
    for (const CLI::Option* option : positionals_of(app))
        page += ".TP\n.I " + troff(option->get_name(true)) + "\n" + troff(option->get_description()) + "\n";
    page += ".SH OPTIONS\n";
    for (const CLI::Option* option : options_of(app)) page += option_entry(*option);
    page += fmt::format(kExitStatus, command || !commands.empty() ? "; 130 interrupted" : "");
    if (command || !commands.empty()) page += kSignals;
    if (commands.empty()) page += ".SH SEE ALSO\n.BR ewa (1)\n";
    return page;
}

std::string bash_completion(const CLI::App& program) {
    const std::string& name = program.get_name();
    std::string function = "_" + name;
    std::replace(function.begin(), function.end(), '-', '_');
    std::string commands, cases, values, before_values = "${COMP_WORDS[COMP_CWORD-1]}";
    for (const CLI::App* command : shown_commands(program)) {
        const BashWords words = bash_words(*command, command->get_name() + " ");
        commands += command->get_name() + " ";
        values += words.values;
        cases += fmt::format("            {}) words='{}' ;;\n", command->get_name(), words.names);
    }
    std::string first, options;
    if (commands.empty()) {
        const BashWords words = bash_words(program, "");
        values = words.values;
        options = fmt::format("        words='{}'\n", words.names);
    } else {
        first =
            "    if ((COMP_CWORD == 1)); then\n"
            "        COMPREPLY=($(compgen -W '" +
            commands +
            "--help --version' -- \"$word\"))\n"
            "        return\n"
            "    fi\n";
        options = "        case ${COMP_WORDS[1]} in\n" + cases + "        esac\n";
        before_values = "${COMP_WORDS[1]} " + before_values;
    }
    return "# Completion of " + name +
           " for bash; zsh reads it after `autoload -U bashcompinit && bashcompinit`.\n" + function +
           "() {\n"
           "    local word=${COMP_WORDS[COMP_CWORD]} words=\n"
           "    COMPREPLY=()\n" +
           first + "    case \"" + before_values + "\" in\n" + values +
           "    esac\n"
           "    if [[ -z $words && $word == -* ]]; then\n" +
           options +
           "    fi\n"
           "    COMPREPLY=($(compgen -W \"$words\" -- \"$word\"))\n"
           "}\n"
           "complete -o default -F " +
           function + " " + name + "\n";
}

std::string fish_completion(const CLI::App& program) {
    const std::string complete = "complete -c " + program.get_name();
    std::string out = "# Completion of " + program.get_name() + " for fish.\n";
    for (const CLI::App* command : shown_commands(program)) {
        const std::string& name = command->get_name();
        out += fmt::format("{} -n __fish_use_subcommand -a {} -d {}\n", complete, name,
                           quoted(command->get_description()));
        out += fish_options(*command, fmt::format("{} -n '__fish_seen_subcommand_from {}'", complete, name));
    }
    if (shown_commands(program).empty()) out += fish_options(program, complete);
    return out;
}

void write_manual(const CLI::App& program, const std::string& folder) {
    const auto write = [&](const std::string& place, const std::string& text) {
        const std::filesystem::path path = std::filesystem::path(folder) / place;
        make_folder(path.parent_path());
        core::write_text_file(path, text);
    };
    const std::string& name = program.get_name();
    write("man/man1/" + name + ".1", manual_page(program, nullptr));
    for (const CLI::App* command : shown_commands(program))
        write("man/man1/" + name + "-" + command->get_name() + ".1", manual_page(program, command));
    write("bash-completion/completions/" + name, bash_completion(program));
    write("fish/vendor_completions.d/" + name + ".fish", fish_completion(program));
}

}  // namespace ewa::cli
