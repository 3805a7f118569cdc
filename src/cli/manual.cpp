// SPDX-License-Identifier: Apache-2.0
#include "cli/manual.h"

#include <spdlog/fmt/fmt.h>

#include <filesystem>
#include <set>

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

const char* const kExitStatus =
    ".SH EXIT STATUS\n"
    "0 done; 1 it failed while running; 2 wrong use or unreadable input; 130 interrupted.\n"
    "An error is one line on standard error.\n";

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

}  // namespace

std::vector<const CLI::App*> shown_commands(const CLI::App& program) {
    std::vector<const CLI::App*> shown;
    for (const CLI::App* command : program.get_subcommands([](const CLI::App*) { return true; }))
        if (!command->get_group().empty()) shown.push_back(command);
    return shown;
}

std::string manual_page(const CLI::App& program, const CLI::App* command) {
    const CLI::App& app = command ? *command : program;
    const std::string dashed = command ? "ewa-" + command->get_name() : "ewa";
    const std::string who = command ? "ewa " + command->get_name() : "ewa";
    std::string page = fmt::format(".TH {} 1 \"\" \"ewa {}\"\n.SH NAME\n{} \\- {}\n.SH SYNOPSIS\n", dashed,
                                   EWA_VERSION, troff(dashed), troff(app.get_description()));
    page += command ? synopsis(who, app) : ".B ewa\n\\fIcommand\\fR [\\fIarguments\\fR]\n";
    if (!command) {
        page += ".SH COMMANDS\n";
        for (const CLI::App* one : shown_commands(program))
            page += ".TP\n.BR ewa\\-" + one->get_name() + " (1)\n" + troff(one->get_description()) + "\n";
    }
    if (!positionals_of(app).empty()) page += ".SH ARGUMENTS\n";
    for (const CLI::Option* option : positionals_of(app))
        page += ".TP\n.I " + troff(option->get_name(true)) + "\n" + troff(option->get_description()) + "\n";
    page += ".SH OPTIONS\n";
    for (const CLI::Option* option : options_of(app)) page += option_entry(*option);
    page += kExitStatus;
    if (command) page += ".SH SEE ALSO\n.BR ewa (1)\n";
    return page;
}

std::string bash_completion(const CLI::App& program) {
    std::string commands;
    for (const CLI::App* command : shown_commands(program)) commands += " " + command->get_name();
    std::string cases, values;
    std::set<std::string> seen;
    for (const CLI::App* command : shown_commands(program)) {
        std::vector<std::string> names;
        for (const CLI::Option* option : options_of(*command)) {
            for (const std::string& name : names_of(*option)) {
                names.push_back(name);
                const std::vector<std::string> choice = values_of(*option);
                if (!choice.empty() && seen.insert(command->get_name() + name).second)
                    values += fmt::format("        '{} {}') words='{}' ;;\n", command->get_name(), name,
                                          joined(choice));
            }
        }
        cases += fmt::format("        {}) words='{}' ;;\n", command->get_name(), joined(names));
    }
    return "# Completion of ewa for bash; zsh reads it after `autoload -U bashcompinit && bashcompinit`.\n"
           "_ewa() {\n"
           "    local word=${COMP_WORDS[COMP_CWORD]} words=\n"
           "    COMPREPLY=()\n"
           "    if ((COMP_CWORD == 1)); then\n"
           "        COMPREPLY=($(compgen -W '" +
           commands.substr(1) +
           " --help --version' -- \"$word\"))\n"
           "        return\n"
           "    fi\n"
           "    case \"${COMP_WORDS[1]} ${COMP_WORDS[COMP_CWORD-1]}\" in\n" +
           values +
           "    esac\n"
           "    if [[ -z $words && $word == -* ]]; then\n"
           "        case ${COMP_WORDS[1]} in\n" +
           cases +
           "        esac\n"
           "    fi\n"
           "    COMPREPLY=($(compgen -W \"$words\" -- \"$word\"))\n"
           "}\n"
           "complete -o default -F _ewa ewa\n";
}

std::string fish_completion(const CLI::App& program) {
    std::string out = "# Completion of ewa for fish.\n";
    for (const CLI::App* command : shown_commands(program)) {
        out += fmt::format("complete -c ewa -n __fish_use_subcommand -a {} -d {}\n", command->get_name(),
                           quoted(command->get_description()));
        for (const CLI::Option* option : options_of(*command)) {
            out += fmt::format("complete -c ewa -n '__fish_seen_subcommand_from {}'", command->get_name());
            for (const std::string& name : option->get_snames()) out += " -s " + name;
            for (const std::string& name : option->get_lnames()) out += " -l " + name;
            const std::vector<std::string> choice = values_of(*option);
            if (!choice.empty())
                out += " -x -a " + quoted(joined(choice));
            else if (takes_value(*option))
                out += " -r";
            out += " -d " + quoted(option->get_description()) + "\n";
        }
    }
    return out;
}

void write_manual(const CLI::App& program, const std::string& folder) {
    const auto write = [&](const std::string& place, const std::string& text) {
        const std::filesystem::path path = std::filesystem::path(folder) / place;
        make_folder(path.parent_path());
        core::write_text_file(path, text);
    };
    write("man/man1/ewa.1", manual_page(program, nullptr));
    for (const CLI::App* command : shown_commands(program))
        write("man/man1/ewa-" + command->get_name() + ".1", manual_page(program, command));
    write("bash-completion/completions/ewa", bash_completion(program));
    write("fish/vendor_completions.d/ewa.fish", fish_completion(program));
}

}  // namespace ewa::cli
