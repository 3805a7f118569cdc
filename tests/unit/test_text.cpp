// SPDX-License-Identifier: Apache-2.0
#include "core/composed.h"
#include "core/terminal.h"
#include "core/text.h"

#include <gtest/gtest.h>

namespace {

using ewa::core::one_line;

TEST(Text, OneLineShowsWhatItIsSafeToShow) {
    const std::pair<std::string, std::string> cases[] = {
        {" a\n\tb\r\n", "a  b"},
        {"caf\u00e9 \u65e5\u672c \U0001f98a", "caf\u00e9 \u65e5\u672c \U0001f98a"},
        {"\x1b[2J\x7f", "\\x1b[2J\\x7f"},
        {std::string("a\0b", 3), "a\\x00b"},
        {"\xc2\x80\xc2\x9b"
         "2J\u00a0",
         "\\xc2\\x80\\xc2\\x9b2J\u00a0"},                              // control characters beyond ASCII
        {"a\u202egnp.\u2066", "a\\xe2\\x80\\xaegnp.\\xe2\\x81\\xa6"},  // the direction of text
        {"a\u2028b", "a\\xe2\\x80\\xa8b"},                             // the end of a line
        {"caf\xe9", "caf\\xe9"},                                       // Latin-1
        {"\x9b"
         "2J",
         "\\x9b2J"},
        {"\xc0\x9b\xe0\x80\x9b", "\\xc0\\x9b\\xe0\\x80\\x9b"},  // too many bytes for what they say
        {"\xf4\x90\x80\x80\xf0\x9f\x98", "\\xf4\\x90\\x80\\x80\\xf0\\x9f\\x98"}};
    for (const auto& [text, shown] : cases) {
        EXPECT_EQ(one_line(text), shown);
        EXPECT_EQ(one_line(shown), shown);
    }
    EXPECT_EQ(one_line(""), "");
}

TEST(Text, AShortHelpHasTheFirstSentence) {
    EXPECT_EQ(ewa::core::first_sentence("Splat file (.ply, .spz). Or a run. Or"), "Splat file (.ply, .spz)");
    EXPECT_EQ(ewa::core::first_sentence("What masks/ do"), "What masks/ do");
}

TEST(Text, HelpBreaksBetweenWords) {
    const std::string twelve = "twelve chars", long_word(90, 'x');
    const auto repeated = [&](int count) {
        std::string text = twelve;
        for (int i = 1; i < count; ++i) text += " " + twelve;
        return text;
    };
    const auto help_text = [](std::string_view text, size_t column) {
        return ewa::core::wrapped_help(text, column, 80);
    };
    EXPECT_EQ(help_text("", 10), "");
    EXPECT_EQ(help_text("a\n\n  b\n", 10), "a\n\n  b\n");
    EXPECT_EQ(help_text("a\n\n\n\n  b\n", 10), "a\n\n  b\n") << "one blank line between groups";
    EXPECT_EQ(help_text("  -a,--bb,--cc   d\n", 20), "  -a, --bb, --cc d\n");
    EXPECT_EQ(help_text(std::string(80, 'x'), 10), std::string(80, 'x') + "\n");
    EXPECT_EQ(help_text(long_word, 10), long_word + "\n") << "a word is never broken";
    EXPECT_EQ(help_text(repeated(7), 10), repeated(6) + "\n" + twelve + "\n");
    EXPECT_EQ(help_text("  -o,--out   " + repeated(6), 13),
              "  -o, --out  " + repeated(5) + "\n" + std::string(13, ' ') + twelve + "\n");
    EXPECT_EQ(help_text(std::string(13, ' ') + repeated(6), 13),
              std::string(13, ' ') + repeated(5) + "\n" + std::string(13, ' ') + twelve + "\n");
}

TEST(Text, LettersWithMarksAsOneCharacter) {
    const std::pair<const char*, const char*> cases[] = {
        {"cafe\xcc\x81", "caf\xc3\xa9"},                           // acute
        {"e\xcc\x82\xcc\x81", "\xe1\xba\xbf"},                     // circumflex and acute
        {"\xe3\x81\x8b\xe3\x82\x99", "\xe3\x81\x8c"},              // Hiragana ka with a voiced mark
        {"\xe1\x84\x92\xe1\x85\xa1\xe1\x86\xab", "\xed\x95\x9c"},  // Hangul han
        {"\xd0\xb8\xcc\x86", "\xd0\xb9"},                          // Cyrillic short i
        {"plain", "plain"},
        {"x\xcc\x81", "x\xcc\x81"},
        {"e\xcc", "e\xcc"}};
    for (const auto& [apart, whole] : cases) {
        EXPECT_EQ(ewa::core::composed(apart), whole);
        EXPECT_EQ(ewa::core::composed(whole), whole);
    }
}

}  // namespace
