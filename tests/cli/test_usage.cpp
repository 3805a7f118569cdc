// SPDX-License-Identifier: Apache-2.0
// Wrong use: exit status 2, one line, nothing written.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <sstream>

#include "cli/expect.h"

namespace {

using namespace ewa::test;

TEST(Usage, HelpAndVersion) {
    const Outcome version = run_ewa({"--version"});
    EXPECT_EQ(version.status, 0);
    EXPECT_EQ(version.out.rfind("ewa ", 0), 0u) << version.out;
    for (const char* command : {"train", "render", "eval", "grad", "info", "devices", "compare"}) {
        const Outcome help = run_ewa({command, "--help"});
        expect_success(help);
        EXPECT_NE(help.out.find("--"), std::string::npos) << command;
    }
    EXPECT_NE(run_ewa({"train", "--help"}).out.find("--max-splats"), std::string::npos);
}

/// Terminals of 80 columns break longer lines inside words. Manual pages and completion are made of this
/// text, by cmake/write-manual; tests/install/check looks at those.
TEST(Usage, HelpFitsATerminal) {
    for (const char* command : {"", "train", "render", "eval", "grad", "convert", "info", "devices", "doctor",
                                "dataset", "bench", "compare"}) {
        std::vector<std::string> arguments{"--help"};
        if (*command) arguments.insert(arguments.begin(), command);
        std::istringstream help(run_ewa(arguments).out);
        size_t lines = 0;
        for (std::string line; std::getline(help, line); ++lines) EXPECT_LE(line.size(), 80u) << line;
        EXPECT_GT(lines, 5u) << command;
    }
    const std::string help = run_ewa({"train", "--help-all"}).out;
    EXPECT_NE(help.find("\n  -o, --output DIR  "), std::string::npos) << help;
    EXPECT_NE(help.find("--strategy auto|adc|mcmc|none [auto]"), std::string::npos) << help;
    EXPECT_EQ(help.find("Excludes:"), std::string::npos) << help;
}

constexpr const char* kWithShortHelp[] = {"train", "render", "convert", "compare"};

/// Each line of the help, and that no line breaks a word: a terminal of 80 columns wraps longer lines
/// anywhere.
void expect_80_columns(const std::string& name, const Outcome& outcome) {
    expect_success(outcome);
    std::istringstream lines(outcome.out);
    size_t count = 0;
    for (std::string line; std::getline(lines, line); ++count)
        EXPECT_LE(line.size(), 80u) << name << ": " << line;
    EXPECT_GT(count, 5u) << name;
}

TEST(Usage, HelpFits80ColumnsForEveryCommand) {
    const Outcome all = run_ewa({"--help"});
    expect_80_columns("ewa", all);
    std::istringstream lines(all.out.substr(all.out.find("Subcommands:")));
    std::vector<std::string> commands;
    for (std::string line; std::getline(lines, line);)
        if (line.size() > 3 && line.starts_with("  ") && line[2] != ' ')
            commands.push_back(line.substr(2, line.find(' ', 2) - 2));
    EXPECT_GE(commands.size(), 10u) << all.out;
    for (const std::string& command : commands) expect_80_columns(command, run_ewa({command, "--help"}));
    for (const char* command : kWithShortHelp) expect_80_columns(command, run_ewa({command, "--help-all"}));
#ifdef EWA_VIEW_PROGRAM
    expect_80_columns("ewa-view", run_ewa({"--help"}, {.program = EWA_VIEW_PROGRAM}));
#endif
    // Wrapping loses no words, and the rest of a description continues in its own column.
    const std::string train = run_ewa({"train", "--help-all"}).out;
    const size_t from = train.find("--strategy"), to = train.find("\n  --max-splats");
    ASSERT_TRUE(from < to && to != std::string::npos) << train;
    const std::string strategy = train.substr(from, to - from);
    EXPECT_NE(strategy.find("\n" + std::string(30, ' ')), std::string::npos) << strategy;
    for (const char* word : {"adc", "mcmc", "none", "auto", "5000"})
        EXPECT_NE(strategy.find(word), std::string::npos) << strategy;
}

/// The lines of a help that name an option or a positional, up to the description.
std::set<std::string> entries_of(const std::string& help) {
    std::set<std::string> entries;
    std::istringstream lines(help);
    for (std::string line; std::getline(lines, line);)
        if (line.size() > 2 && line.starts_with("  ") && line[2] != ' ') {
            constexpr size_t kDescriptions = 30;  // their column
            const size_t end = std::min(line.find("  ", 2), kDescriptions);
            entries.insert(line.substr(2, line.find_last_not_of(' ', end - 1) - 1));
        }
    return entries;
}

TEST(Usage, HelpOfLargeCommandsIsShort) {
    const std::string train = run_ewa({"train", "--help"}).out;
    EXPECT_LE(std::ranges::count(train, '\n'), 53) << train;
    for (const char* command : kWithShortHelp) {
        const std::string brief = run_ewa({command, "--help"}).out,
                          whole = run_ewa({command, "--help-all"}).out;
        const std::set<std::string> some = entries_of(brief), all = entries_of(whole);
        EXPECT_TRUE(std::ranges::includes(all, some)) << brief;
        EXPECT_LT(some.size() + 3, all.size()) << brief;
        EXPECT_LT(4 * std::ranges::count(brief, '\n'), 3 * std::ranges::count(whole, '\n')) << brief;
        EXPECT_TRUE(brief.ends_with("\newa " + std::string(command) +
                                    " --help-all has the other options, and says more about these.\n"))
            << brief;
        EXPECT_EQ(whole.find("--help-all has"), std::string::npos) << whole;
    }
    EXPECT_NE(run_ewa({"info", "--help-all"}).status, 0) << "its help has all options";
}

TEST(Usage, HelpOfTrainHasTheOptionsThatPeopleUse) {
    const std::string help = run_ewa({"train", "--help"}).out;
    for (const char* option :
         {"DATASET",      "-h, --help",     "--help-all",  "-o, --output", "--steps",      "--quality",
          "--max-splats", "--downscale",    "--max-width", "--test-every", "--frames",     "--init",
          "--masks",      "--lens",         "--strategy",  "--sh-degree",  "--background", "--appearance",
          "--robust",     "--refine-poses", "--seed",      "--device",     "--eval-every", "--save-every",
          "--resume",     "--force",        "--config",    "--serve"})
        EXPECT_NE(help.find("\n  " + std::string(option)), std::string::npos) << option;
    for (const char* option : {"--bands", "--moments", "--validation", "For developers"})
        EXPECT_EQ(help.find(option), std::string::npos) << option;
}

struct WrongUse {
    std::vector<std::string> arguments;
    std::string text;
};

void PrintTo(const WrongUse& use, std::ostream* out) {
    for (const std::string& argument : use.arguments) *out << argument << ' ';
}

class WrongUseTest : public testing::TestWithParam<WrongUse> {};

TEST_P(WrongUseTest, IsOneLineAndStatus2) {
    const Outcome outcome = run_ewa(GetParam().arguments);
    expect_failure(outcome, 2, GetParam().text);
    EXPECT_EQ(outcome.out, "");
}

INSTANTIATE_TEST_SUITE_P(
    Usage, WrongUseTest,
    testing::Values(
        WrongUse{{}, "subcommand"}, WrongUse{{"fly"}, "fly"}, WrongUse{{"train"}, "DATASET"},
        WrongUse{{"bench", "--accuracy"}, "DATASET"}, WrongUse{{"bench", "/nowhere.ply"}, "--stability"},
        WrongUse{{"bench", "--stability", "/nowhere.ply"}, "/nowhere.ply"},
        WrongUse{{"bench", "--stability", "--cases", "nosuchcase"}, "nosuchcase"},
        WrongUse{{"bench", "--svg", "a.svg"}, "--svg is an option of --accuracy"},
        WrongUse{{"bench", "--splats", "a.ply"}, "--splats is an option of --accuracy"},
        WrongUse{{"bench", "--accuracy", "--stability", "a"},
                 "--stability and --accuracy exclude each other"},
        WrongUse{{"bench", "--accuracy", "a", "--cases", "b"}, "--cases and --accuracy exclude each other"},
        WrongUse{{"train", "/nowhere", "--wings"}, "--wings"},
        WrongUse{{"convert", "a.ply", "b.ply", "--decimate", ""}, "--decimate: the value is empty"},
        WrongUse{{"convert", "a.ply", "b.ply", "--crop", ""}, "--crop: the value is empty"},
        WrongUse{{"render", "a.ply", "--device="}, "--device needs a value"},
        WrongUse{{"train", "/nowhere", "--init", ""}, "--init: the value is empty"},
        WrongUse{{"info", ""}, "the value is empty"},
        WrongUse{{"train", "/nowhere", "--steps", "0"}, "--steps"},
        WrongUse{{"train", "/nowhere", "--steps", "-3"}, "--steps"},
        WrongUse{{"train", "/nowhere", "--steps", "many"}, "--steps"},
        WrongUse{{"train", "/nowhere", "--steps", "1e99"}, "--steps"},
        WrongUse{{"train", "/nowhere", "--steps"}, "--steps"},
        WrongUse{{"train", "/nowhere", "--sh-degree", "4"}, "--sh-degree"},
        WrongUse{{"train", "/nowhere", "--downscale", "0"}, "--downscale"},
        WrongUse{{"train", "/nowhere", "--test-every", "-1"}, "--test-every"},
        WrongUse{{"train", "/nowhere", "--max-splats", "0"}, "--max-splats"},
        WrongUse{{"train", "/nowhere", "--max-splats", "-1"}, "--max-splats"},
        WrongUse{{"train", "/nowhere", "--seed", "-1"}, "--seed"},
        WrongUse{{"train", "/nowhere", "--eval-every", "-1"}, "--eval-every"},
        WrongUse{{"train", "/nowhere", "--save-every", "x"}, "--save-every"},
        WrongUse{{"train", "/nowhere", "--strategy", "luck"}, "--strategy"},
        WrongUse{{"train", "/nowhere", "--kernel", "box"}, "--kernel"},
        WrongUse{{"train", "/nowhere", "--background", "1,1"}, "--background"},
        WrongUse{{"train", "/nowhere", "--background", "1,nan,1"}, "--background"},
        WrongUse{{"train", "/nowhere", "--background", "0,0,2"}, "--background"},
        WrongUse{{"train", "/nowhere", "--quiet", "--verbose"}, "--verbose"},
        WrongUse{{"train", "/nowhere"}, "/nowhere"}, WrongUse{{"render", "/nowhere.ply"}, "/nowhere.ply"},
        WrongUse{{"render", "/nowhere.ply", "--cameras", "/nowhere"}, "/nowhere.ply"},
        WrongUse{{"render", "/a.ply", "--cameras", "/b", "--background", "random"}, "--background"},
        WrongUse{{"render", "/a.ply", "--cameras", "/b", "--format", "gif"}, "--format"},
        WrongUse{{"render", "/a.ply", "--cameras", "/b", "--mode", "smell"}, "--mode"},
        WrongUse{{"eval", "/a.ply"}, "DATASET"},
        WrongUse{{"eval", "/a.ply", "/b", "--split", "x"}, "--split"},
        WrongUse{{"grad", "/a.ply", "/b", "--frame", "0"}, "--output"},
        WrongUse{{"grad", "/a.ply", "/b", "-o", "/c.ply"}, "--frame"},
        WrongUse{{"grad", "/a.ply", "/b", "--frame", "-1", "-o", "/c.ply"}, "--frame"},
        WrongUse{{"grad", "/a.ply", "/b", "--frame", "0", "-o", "/c.txt"}, ".ply"},
        WrongUse{{"info"}, "PATH"}, WrongUse{{"info", "/nowhere"}, "/nowhere"},
        WrongUse{{"devices", "extra"}, "extra"},
        WrongUse{{"render", "/a.ply", "pic.png"},
                 "unexpected argument: pic.png; -o pic.png names the output"},
        WrongUse{{"view", "/a.ply"},
                 "unknown command 'view'; the window is the program ewa-view: ewa-view /a.ply"},
        WrongUse{{"gui", "/a.ply"}, "the window is the program ewa-view: ewa-view /a.ply"},
        WrongUse{{"ui"}, "unknown command 'ui'; the window is the program ewa-view (see"},
        WrongUse{{"help", "nothere"}, "unknown command 'nothere'"}, WrongUse{{"help", "train", "x"}, "help"},
        WrongUse{{"render", "/a.ply", "-o", "o.png", "--size", "16384x16384"},
                 "of at most 16384 a side and 134 million pixels"}));

TEST(Usage, HelpAndVersionAsPeopleTypeThem) {
    const auto printed = [](const std::vector<std::string>& arguments) {
        const Outcome outcome = run_ewa(arguments);
        expect_success(outcome);
        EXPECT_EQ(outcome.err, "");
        return outcome.out;
    };
    EXPECT_EQ(printed({"help"}), printed({"--help"}));
    EXPECT_EQ(printed({"help", "train"}), printed({"train", "--help"}));
    for (const char* version : {"version", "-v", "-V"}) EXPECT_EQ(printed({version}), printed({"--version"}));
    EXPECT_NE(printed({"train", "--help"}).find("--serve [ADDRESS:]PORT"), std::string::npos);
    EXPECT_NE(printed({"convert", "--help-all"}).find("--spz-version 3|4"), std::string::npos);
}

TEST(Usage, TheEnvironmentMayNameTheDevice) {
    const Folder folder;
    make_splats(folder / "s.ply");
    const std::vector<std::string> render{"render",         folder / "s.ply", "-o",
                                          folder / "o.png", "--size",         "8x8"};
    const Circumstances none{.environment = {{"EWA_DEVICE", "no such device"}}};
    expect_failure(run_ewa(render, none), 2, "no usable Vulkan device matches 'no such device'");
    std::vector<std::string> given = render;
    given.insert(given.end(), {"--device", "0"});
    expect_success(run_ewa(given, none));
}

TEST(Usage, ConfigNamesItsMistake) {
    const Folder folder;
    const std::string file = folder / "c.json";
    const std::pair<const char*, const char*> cases[] = {
        {R"({"wings": 2})", "wings"},
        {R"({"steps": 0})", "--steps"},
        {R"({"steps": "many"})", "\"steps\" must be a number"},
        {R"({"steps": {}})", "steps"},
        {R"([1])", "object"},
        {R"({"steps": 3)", "byte"},
        {R"({"seed": 1e400})", "1e400"},
        {R"({"config": "c.json"})", "config"},
        {R"({"strategy": "magic"})", "magic"}};
    for (const auto& [text, mistake] : cases) {
        write_file(file, text);
        expect_failure(run_ewa({"train", "/nowhere", "--config", file}), 2, mistake);
    }
    write_file(file, "{\"background\":" + std::string(400000, '[') + std::string(400000, ']') + "}");
    expect_failure(run_ewa({"train", "/nowhere", "--config", file}), 2, "c.json: the JSON nests deeper");
    expect_failure(run_ewa({"train", "/nowhere", "--config", folder / "absent.json"}), 2, "absent.json");
    // The command line wins over the file, so its mistake does not count.
    write_file(file, R"({"steps": 0, "dataset": "/elsewhere"})");
    expect_failure(run_ewa({"train", "/nowhere", "--steps", "5", "--config", file}), 2, "/nowhere");
}

}  // namespace
