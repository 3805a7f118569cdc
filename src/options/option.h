// SPDX-License-Identifier: Apache-2.0
// The options of all commands in one table: their names, what they take, and what the help says of them.
#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace ewa::train {
struct RunOption;
}

namespace ewa::options {

/// The headings under which the help lists options.
inline constexpr const char *kData = "Data", *kQuality = "Quality", *kOutput = "Output", *kDevice = "Device",
                            *kTraining = "Training", *kEdits = "Edits, in the order typed",
                            *kDevelopers = "For developers", *kHidden = "";

/// Whether the option's value names a file that the command reads or writes. An output never replaces an input.
enum class Role { none, input, output };

struct Option {
    std::string name;           // "steps" of --steps, or a positional in capitals
    std::string commands = {};  // separated by blanks; "name!" if the command's short help has the option
    std::string subject = {};   // the heading in the help
    std::string value = {};     // how the help shows the value; empty: a flag, or the words of `choices`
    std::string help = {};

    Role role = Role::none;
    double low = 0, high = 0;  // the range of a number; low >= high: any number
    std::vector<std::string> choices = {};
    std::string brief = {};  // text of the short help; empty: the first sentence of `help`
    std::string also = {};   // other spellings, such as ",-o"
    bool is_required = false, repeats = false;
    bool shows_usual = false;               // the help shows the value of an option that is not given
    const train::RunOption* run = nullptr;  // the training option that sets its values
};

bool is_positional(const Option& option);
bool is_flag(const Option& option);

/// The rows of rows.cpp. A row without `help` is an option of a training run that other commands share; its `commands` names them.
std::vector<Option> rows();
/// All options of all commands, sorted by name, with the options of training runs and the edits of scenes.
const std::vector<Option>& all_options();
/// The option of a command. Null: the command has none of this name.
const Option* find_option(std::string_view command, std::string_view name);

/// Whether a list of words separated by blanks has the word.
bool has_word(std::string_view list, std::string_view word);
/// Whether the short help of the command has the option.
bool is_in_short_help(const Option& option, const std::string& command);

/// The values that --through takes, for its help.
inline constexpr const char* kLensForms =
    "fisheye[:DEGREES] (180), equirectangular, orthographic or opencv:K1[,K2[,P1,P2]]";

}  // namespace ewa::options
