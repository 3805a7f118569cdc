// SPDX-License-Identifier: Apache-2.0
#include "core/typing.h"

#include <gtest/gtest.h>

#include <string>

#include "core/exclusion.h"
#include "core/words.h"
#include "ewa/error.h"

namespace {

using namespace ewa::core;

TEST(Typing, DistanceCountsLettersAndSwaps) {
    EXPECT_EQ(edit_distance("", ""), 0u);
    EXPECT_EQ(edit_distance("", "abc"), 3u);
    EXPECT_EQ(edit_distance("abc", ""), 3u);
    EXPECT_EQ(edit_distance("train", "trian"), 1u) << "neighbours in the other order are one mistake";
    EXPECT_EQ(edit_distance("step", "steps"), 1u);
    EXPECT_EQ(edit_distance("kitten", "sitting"), 3u);
    EXPECT_EQ(edit_distance("Steps", "sTEPS"), 0u);
    EXPECT_EQ(edit_distance("ca", "abc"), 3u) << "a swapped pair is not edited again";
}

TEST(Typing, SuggestsWhatIsNear) {
    const std::vector<std::string> options{"--steps", "--strategy", "--max-splats", "--seed", "-o"};
    EXPECT_EQ(closest("--step", options), "--steps");
    EXPECT_EQ(closest("-steps", options), "--steps");
    EXPECT_EQ(closest("--step=300", options), "--steps");
    EXPECT_EQ(closest("--max", options), "--max-splats") << "the beginning of one";
    EXPECT_EQ(closest("--maxsplats", options), "--max-splats");
    EXPECT_EQ(closest("--wings", options), "");
    EXPECT_EQ(closest("--x", options), "");
    EXPECT_EQ(closest("trian", {"train", "render"}), "train");
    EXPECT_EQ(closest("fly", {"train", "grad", "info"}), "");
    EXPECT_EQ(did_you_mean("trian", {"train"}), "; did you mean train?");
    EXPECT_EQ(did_you_mean("fly", {"train"}), "");
}

TEST(Typing, UnexpectedArgumentsStayInOrder) {
    const char* argv[] = {"ewa", "train", "photos", "--step", "300"};
    EXPECT_EQ(unexpected_arguments(5, argv, {"300", "--step"}, {"--seed", "--steps"}),
              "unexpected arguments: --step 300; did you mean --steps?");
    EXPECT_EQ(unexpected_arguments(5, argv, {"300"}, {"--steps"}), "unexpected argument: 300");
    EXPECT_EQ(unexpected_arguments(5, argv, {"-q", "--step"}, {"--wings"}),
              "unexpected arguments: --step -q");
}

TEST(Typing, CountsAreExact) {
    const std::pair<const char*, uint64_t> good[] = {
        {"0", 0},        {"7", 7},          {"007", 7},
        {"7k", 7000},    {"30K", 30000},    {"1.5k", 1500},
        {"1M", 1000000}, {"0.25m", 250000}, {"1e3", 1000},
        {"1E+3", 1000},  {"1.25e2", 125},   {"2500e-2", 25},
        {"3.0", 3},      {"0e-20", 0},      {"0.000k", 0},
        {"1.k", 1000},   {".5k", 500},      {"18446744073709551615", UINT64_MAX}};
    for (const auto& [text, count] : good) EXPECT_EQ(parse_count<uint64_t>(text), count) << text;
    for (const char* text : {"",     "k",    ".",   "e3", "1e",  "1e+-3", "1.5",  "1.2345k",
                             "1e-1", "1e3k", "7kk", "7g", "7 k", "0x7",   "1e99", "18446744073709551616",
                             "1e20", "nan",  "inf", "+7", "-7",  "1,000", "7k\n"})
        EXPECT_EQ(parse_count<uint64_t>(text), std::nullopt) << text;
    EXPECT_EQ(parse_count<int>("-7"), -7);
    EXPECT_EQ(parse_count<int>("2147483648"), std::nullopt);
    EXPECT_EQ(parse_count<int>("3e9"), std::nullopt);
}

TEST(Typing, NumbersAreSettledInTheirRange) {
    std::string text = "1.5k";
    EXPECT_EQ(settle_number(text, 1, 2000), "");
    EXPECT_EQ(text, "1500") << "for a parser that knows digits alone";
    EXPECT_EQ(settle_number(text, 1, 1000), "'1500' is not a whole number from 1 to 1000");
    text = "0.5";
    EXPECT_EQ(settle_number(text, 0.0, 1.0), "");
    text = "nan";
    EXPECT_EQ(settle_number(text, 0.0, 1e9), "'nan' is not a number from 0 to 1e+09");
}

TEST(Typing, WordsInEitherSpelling) {
    std::string word = "colour";
    EXPECT_EQ(settle_word(word, {"color", "depth"}), "");
    EXPECT_EQ(word, "color");
    EXPECT_EQ(settle_word(word, {"colour", "depth"}), "");
    EXPECT_EQ(word, "colour");
    word = "dept";
    EXPECT_EQ(settle_word(word, {"color", "depth"}),
              "'dept' is not one of color, depth; did you mean depth?");
    EXPECT_EQ(word, "dept");
    EXPECT_EQ(settle_word(word = "x", {"morton"}), "'x' is not morton");
}

TEST(Typing, Colours) {
    using Rgb = std::array<float, 3>;
    const float half = 128.0f / 255;
    const std::pair<const char*, Rgb> good[] = {{"0,0.5,1", {0, 0.5f, 1}},
                                                {"0, 0.5, 1", {0, 0.5f, 1}},
                                                {"0 0.5 1", {0, 0.5f, 1}},
                                                {"white", {1, 1, 1}},
                                                {"Black", {0, 0, 0}},
                                                {"gray", {half, half, half}},
                                                {"grey", {half, half, half}},
                                                {"red", {1, 0, 0}},
                                                {"green", {0, half, 0}},
                                                {"#fff", {1, 1, 1}},
                                                {"#FFFFFF", {1, 1, 1}},
                                                {"#08f", {0, 136.0f / 255, 1}},
                                                {"#010203", {1.0f / 255, 2.0f / 255, 3.0f / 255}}};
    for (const auto& [text, colour] : good) EXPECT_EQ(parse_colour(text), colour) << text;
    for (const char* text :
         {"",       ",",        "1,1",     "1,1,", "1,1,1,",  "1,1,1,1", ",1,1,1", "1,,1,1",
          "0,0,2",  "-0.1,0,0", "1,nan,1", "1 1",  "1 1 1 1", "#",       "#ff",    "#ffff",
          "#fffff", "#fffffff", "#ggg",    "#-ff", "fff",     "whit",    "random"})
        EXPECT_EQ(parse_colour(text), std::nullopt) << text;
    EXPECT_NE(not_a_colour("whit").find("did you mean white?"), std::string::npos);
}

TEST(Typing, Boxes) {
    EXPECT_EQ(parse_box(" -1, 2e0,-.5,1,2,7"), (std::array<double, 6>{-1, 2, -0.5, 1, 2, 7}));
    for (const char* text : {"", "1,2,3", "0,0,0,1,1,1,", "0,0,0,1,1,1,1", "0,0,0,1,1,x", "0,0,2,1,1,1",
                             "0,0,0,1,1,inf", "0,0,0,1,,1"})
        EXPECT_EQ(parse_box(text), std::nullopt) << text;
    EXPECT_EQ(not_a_box("1,2"), "'1,2' is not x,y,z,X,Y,Z with the lower corner first");
}

TEST(Typing, ListsHaveCommasBetweenTheirParts) {
    using Parts = std::vector<std::string_view>;
    EXPECT_EQ(split_list("a, b c ,d"), (Parts{"a", "b c", "d"}));
    EXPECT_EQ(split_list("a,"), (Parts{"a", ""}));
    EXPECT_EQ(split_list(""), Parts{""});
    EXPECT_EQ(parse_list(" -1, 2e0,-.5"), (std::vector<double>{-1, 2, -0.5}));
    EXPECT_EQ(parse_list("7"), std::vector<double>{7});
    for (const char* text : {"", "1,", ",1", "1,,2", "1,x", "1 2", "inf", "1,nan"})
        EXPECT_EQ(parse_list(text), std::nullopt) << text;
}

TEST(Typing, WordsHaveValues) {
    const ewa::core::Words<int> words{{"gray", 1}, {"black", 2}, {"dark", 2}};
    EXPECT_EQ(value_of(words, "dark"), 2);
    EXPECT_EQ(value_of(words, "grey"), 1);
    EXPECT_STREQ(word_for(words, 2), "black");
    EXPECT_STREQ(word_for(words, 3), "");
    EXPECT_EQ(find_value(words, "dark"), 2);
    EXPECT_EQ(find_value(words, "blak"), std::nullopt);
    EXPECT_THROW(value_of(words, "blak"), ewa::InputError);
}

TEST(Typing, ExclusionsNameBothOptions) {
    struct Asked {
        bool a = false, b = false, c = false;
    };
    using Row = Exclusion<Asked>;
    const std::array rows{Row{"--a", [](const Asked& asked) { return asked.a; }, Relation::excludes, "--b",
                              [](const Asked& asked) { return asked.b; }, "because"},
                          Row{"--c", [](const Asked& asked) { return asked.c; }, Relation::needs, "--a",
                              [](const Asked& asked) { return asked.a; }}};
    const auto refusal = [&](const Asked& asked) -> std::string {
        try {
            check_exclusions(rows, asked);
        } catch (const ewa::InputError& error) {
            return error.what();
        }
        return {};
    };
    EXPECT_EQ(refusal({}), "");
    EXPECT_EQ(refusal({.b = true}), "");
    EXPECT_EQ(refusal({.a = true, .c = true}), "");
    EXPECT_EQ(refusal({.a = true, .b = true}), "--a and --b exclude each other: because");
    EXPECT_EQ(refusal({.c = true}), "--c is an option of --a");
}

TEST(Typing, Plurals) {
    EXPECT_EQ(counted(0, "image"), "0 images");
    EXPECT_EQ(counted(1, "image"), "1 image");
    EXPECT_EQ(counted(2, "image"), "2 images");
    EXPECT_EQ(is_or_are(1), "is");
    EXPECT_EQ(is_or_are(0), "are");
}

TEST(Typing, ReasonsLoseTheNameOfTheException) {
    EXPECT_EQ(plain_reason("[json.exception.type_error.302] type must be number"), "type must be number");
    EXPECT_EQ(plain_reason("type must be number"), "type must be number");
    EXPECT_EQ(plain_reason("[1, 2]"), "[1, 2]");
}

}  // namespace
