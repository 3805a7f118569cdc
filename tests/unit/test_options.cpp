// SPDX-License-Identifier: Apache-2.0
// The table of options agrees with the parsers of all commands, and its rules speak of options that there are.
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "cli/command.h"
#include "ewa/error.h"
#include "options/command_options.h"
#include "options/rules.h"
#include "run/option_table.h"

namespace {

using namespace ewa;

/// ewa bench adds its options by itself.
const std::set<std::string> kByThemselves{"bench"};

/// The words of a list with blanks, without the ! of commands whose short help has an option.
std::vector<std::string> listed_words(const std::string& list) {
    std::vector<std::string> all;
    std::istringstream rest(list);
    for (std::string word; rest >> word;)
        all.push_back(word.ends_with('!') ? word.substr(0, word.size() - 1) : word);
    return all;
}

struct Program {
    CLI::App app{"ewa"};
    std::vector<cli::Command> commands = cli::add_commands(app, "ewa");

    /// The command after it has parsed the words.
    const CLI::App& parsed(const std::string& words) {
        app.parse(words);
        return *app.get_subcommands().front();
    }
};

std::string name_in_table(const CLI::Option& option) {
    return option.get_lnames().empty() ? option.get_name() : option.get_lnames().front();
}

using CommandAndName = std::pair<std::string, std::string>;

TEST(OptionTable, CommandsHaveTheOptionsThatItLists) {
    std::set<CommandAndName> added, listed;
    const Program program;
    for (const cli::Command& command : program.commands)
        for (const CLI::Option* option : command.app->get_options())
            if (const std::string name = name_in_table(*option);
                !name.starts_with("help") && !kByThemselves.contains(command.name))
                added.emplace(command.name, name);
    for (const options::Option& option : options::all_options())
        for (const std::string& command : listed_words(option.commands))
            EXPECT_TRUE(listed.emplace(command, option.name).second)
                << command << " has --" << option.name << " twice";
    std::erase_if(listed, [](const CommandAndName& one) { return one.first == "ewa-view"; });
    EXPECT_EQ(added, listed);
    EXPECT_GT(added.size(), 200u);
}

TEST(OptionTable, EveryOptionHasASubjectAndAHelp) {
    const std::set<std::string> subjects{options::kData,      options::kQuality,  options::kOutput,
                                         options::kDevice,    options::kTraining, options::kEdits,
                                         options::kDevelopers};
    for (const options::Option& option : options::all_options()) {
        EXPECT_NE(option.help, "") << option.name;
        const bool advanced = option.run && option.run->subject.empty();
        const bool hidden = advanced || option.name == "check-options";
        EXPECT_EQ(option.subject == options::kHidden, hidden) << option.name;
        EXPECT_EQ(subjects.contains(option.subject), !hidden) << option.name << ": " << option.subject;
    }
}

/// One name means one thing, or is listed here.
TEST(OptionTable, NamesMeanOneThing) {
    const std::set<std::string> several{"depth",           "frames",  "level", "points",
                                        "rolling-shutter", "samples", "views"};
    // These mean the same for several commands, whose texts differ.
    const std::set<std::string> told_in_other_words{
        "DATASET",   "PATH",  "film-seconds", "frame", "kernel",  "mode",   "background",
        "cameras",   "force", "integrator",   "json",  "metrics", "output", "scale-to",
        "sh-degree", "size",  "transform",    "up",    "verbose"};
    std::map<std::string, int> rows;
    for (const options::Option& option : options::all_options()) ++rows[option.name];
    for (const auto& [name, count] : rows)
        EXPECT_EQ(count > 1, several.contains(name) + told_in_other_words.contains(name) == 1) << name;
}

TEST(OptionTable, RulesSpeakOfOptionsThatThereAre) {
    for (const options::Rule& rule : options::rules())
        for (const std::string& command : listed_words(rule.commands))
            for (const char* list : {rule.options, rule.others})
                for (const std::string& condition : listed_words(list)) {
                    const size_t equals = condition.find('=');
                    const options::Option* option =
                        options::find_option(command, condition.substr(0, equals));
                    ASSERT_TRUE(option) << command << ": " << condition;
                    std::istringstream values(equals == std::string::npos ? ""
                                                                          : condition.substr(equals + 1));
                    for (std::string value; std::getline(values, value, '|');)
                        EXPECT_NE(std::ranges::find(option->choices, value), option->choices.end())
                            << condition;
                }
}

/// What check_typed throws; empty: nothing.
std::string refusal_of(const std::string& words) {
    Program program;
    try {
        options::check_typed(program.parsed(words));
        return {};
    } catch (const InputError& error) {
        return error.what();
    }
}

TEST(OptionTable, RulesFollowWhatWasTyped) {
    EXPECT_EQ(refusal_of("train d --force --resume"), "--force and --resume exclude each other");
    EXPECT_EQ(refusal_of("train d --force"), "");
    EXPECT_EQ(refusal_of("render s.ply --size 8x8 --cameras d"), "--size and --cameras exclude each other");
    EXPECT_EQ(refusal_of("render s.ply --film-seconds 2"), "--film-seconds needs --views FILE");
    EXPECT_EQ(refusal_of("render s.ply --film-seconds 2 --views v.json"), "");
    EXPECT_EQ(refusal_of("render s.ply --transparent --mode alpha"), "--transparent needs --mode color");
    EXPECT_EQ(refusal_of("render s.ply --transparent"), "") << "color is the usual mode";
    EXPECT_EQ(refusal_of("render s.ply --aperture 1 --mode depth"),
              "--aperture needs --mode color or alpha: such renders average colours");
    EXPECT_EQ(refusal_of("render s.ply --aperture 1 --mode alpha"), "");
    EXPECT_EQ(refusal_of("render s.ply --mode depth --integrator ray"), "");
    EXPECT_EQ(
        refusal_of("render s.ply --mode depth --integrator march"),
        "--mode depth and --integrator march exclude each other: the integrator march draws no depth; the "
        "others do");
    EXPECT_EQ(refusal_of("compare a b --points"), "--points needs --cameras DATASET");
}

TEST(OptionTable, FilesAreReadOrWrittenByTheirRoles) {
    const auto names = [](const std::vector<core::NamedFile>& files) {
        std::vector<std::string> all;
        for (const core::NamedFile& file : files) all.push_back(file.name + " " + file.path.string());
        return all;
    };
    using Names = std::vector<std::string>;
    Program grad, render;
    const options::TypedFiles files = options::typed_files(
        grad.parsed("grad s.ply d --frame 0 -o g.ply --json g.json --background sky.json"));
    EXPECT_EQ(names(files.written), (Names{"--output g.ply", "--json g.json"}));
    EXPECT_EQ(names(files.read), (Names{"SPLATS s.ply", "DATASET d", "--background sky.json"}));
    const options::TypedFiles drawn =
        options::typed_files(render.parsed("render s.ply --views v.json -o out"));
    EXPECT_EQ(names(drawn.written), Names{});
    EXPECT_EQ(names(drawn.read), (Names{"SPLATS s.ply", "--views v.json"}));
}

/// The message for a value that its option refuses; empty: it is taken.
template <class T>
std::string taken(const char* command, const char* name, T& variable, const std::string& typed) {
    CLI::App app{"", command};
    options::add(app, name, variable);
    try {
        app.parse(std::string("--") + name + " " + typed);
        return {};
    } catch (const CLI::ParseError& error) {
        return error.what();
    }
}

TEST(OptionTable, ValuesAreCheckedByTheRow) {
    int width = 0;
    EXPECT_EQ(taken("render", "max-width", width, "1.5k"), "");
    EXPECT_EQ(width, 1500);
    EXPECT_EQ(taken("render", "max-width", width, "-1"),
              "--max-width: '-1' is not a whole number from 0 to 65535");
    std::optional<double> error;
    EXPECT_EQ(taken("compare", "max-error", error, "0.5"), "");
    EXPECT_EQ(error, 0.5);
    EXPECT_NE(taken("compare", "max-error", error, "-1").find("is not a number from 0 to"),
              std::string::npos);
    std::string mode;
    EXPECT_EQ(taken("render", "mode", mode, "colour"), "");
    EXPECT_EQ(mode, "color");
    EXPECT_NE(taken("render", "mode", mode, "smell").find("is not one of color"), std::string::npos);
    RunOptions run;
    EXPECT_EQ(taken("eval", "lens", run, "native"), "");
    EXPECT_EQ(run.lens, LensUse::native);
    std::optional<int> nearest;
    EXPECT_EQ(taken("eval", "nearest", nearest, "12"), "");
    EXPECT_EQ(nearest, 12);
}

TEST(OptionTable, RowsAreSortedByName) {
    EXPECT_TRUE(std::ranges::is_sorted(options::rows(), {}, &options::Option::name));
}

TEST(OptionTable, AnotherCommandHasNoRow) {
    EXPECT_EQ(options::find_option("devices", "steps"), nullptr);
    EXPECT_EQ(options::find_option("nothing", "json"), nullptr);
    EXPECT_TRUE(options::has_word("render! eval", "eval"));
    EXPECT_FALSE(options::has_word("render! evaluate", "eval"));
}

}  // namespace
