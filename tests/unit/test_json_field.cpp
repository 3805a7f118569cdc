// SPDX-License-Identifier: Apache-2.0
#include "core/json_field.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>

#include "ewa/error.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using core::JsonField;
using nlohmann::json;
using test::expect_error;

/// One problem is the whole error: file, place, key and what is expected.
void field_refuses(const std::function<void()>& read, const std::string& problem) {
    expect_error<InputError>(read, {"a.json: " + problem});
}

TEST(JsonField, ListsOfNumbersHaveTheirLength) {
    const json value = {
        {"flat", {1, 2, 3, 4}},      {"rows", {{1, 2}, {3, 4}}}, {"ragged", {{1}, {2, 3, 4}}},
        {"mixed", {1, 2, {3, 4}}},   {"text", "1234"},           {"deep", {{{1, 2}}, {{3, 4}}}},
        {"word", {1, 2, 3, "four"}}, {"large", {1e39}}};
    const JsonField field(value, "a.json");
    const std::vector<double> four{1, 2, 3, 4};
    EXPECT_EQ(field.numbers("flat", 4), four);
    EXPECT_EQ(field.numbers("rows", 4), four);
    EXPECT_EQ(field.numbers("flat", 1, 9), four);
    for (const char* key : {"ragged", "mixed", "text", "deep", "word"})
        field_refuses([&] { field.numbers(key, 4); },
                      "\"" + std::string(key) + "\" is not a list of 4 finite numbers");
    field_refuses([&] { field.numbers("flat", 5); }, "\"flat\" is not a list of 5 finite numbers");
    field_refuses([&] { field.numbers("flat", 1, 3); }, "\"flat\" is not a list of 1 to 3 finite numbers");
    field_refuses([&] { field.numbers("flat", 2, 2, "a pair"); }, "\"flat\" is not a pair");
    EXPECT_EQ(field.numbers("large", 1)[0], 1e39);
    field_refuses([&] { field.floats("large", 1); }, "\"large\" is not a list of numbers that float32 has");
    EXPECT_EQ(JsonField(value["flat"], "a.json").numbers(nullptr, 4), four);
    field_refuses([&] { JsonField(value["text"], "a.json").numbers(nullptr, 4); }, "is not a list of 4");
}

TEST(JsonField, WholeNumbersHaveARange) {
    const json value = {{"zero", 0},   {"seven", 7},  {"float", 7.0},
                        {"half", 7.5}, {"below", -1}, {"large", 1e300}};
    const JsonField field(value, "a.json");
    EXPECT_EQ(field.whole("seven", 7), 7u);
    EXPECT_EQ(field.whole("float", 7), 7u);
    EXPECT_EQ(field.whole("zero", 7), 0u);
    for (const char* key : {"half", "below", "large"})
        field_refuses([&] { field.whole(key, UINT64_MAX); },
                      "\"" + std::string(key) + "\" is not a whole number of 0");
    field_refuses([&] { field.whole("seven", 6); }, "\"seven\" is not a whole number of 0 to 6");
    field_refuses([&] { field.whole("zero", 7, 1); }, "\"zero\" is not a whole number of 1 to 7");
    field_refuses([&] { field.side("zero"); }, "\"zero\" is not a whole number of 1 to 1048576");
}

TEST(JsonField, SaysWhereAValueIs) {
    const json value = {{"a", {{"b", json::array({1, 2})}, {"c", nullptr}}}, {"list", {1, "x"}}};
    const JsonField field(value, "a.json", "; it is damaged");
    field_refuses([&] { field.part("a").number("b"); }, "\"a\": \"b\" is not a finite number");
    field_refuses([&] { field.object("a").number("b"); }, "\"b\" is not a finite number");
    field_refuses([&] { field.part("a").number("c"); }, "\"a\": \"c\" is missing; it is damaged");
    field_refuses([&] { field.items("list")[1].number(nullptr); }, "\"list\" 1: is not a finite number");
    field_refuses([&] { field.items("list")[0].number("x"); },
                  "\"list\" 0: is not a JSON object with \"x\"; it is damaged");
    field_refuses([&] { field.members("list"); }, "\"list\" is not a JSON object");
    field_refuses([&] { field.list("a"); }, "\"a\" is not a list");
    EXPECT_EQ(field.items("list")[1].text(nullptr), "x");
    EXPECT_FALSE(JsonField(value["list"], "a.json").has("a"));
}

TEST(JsonField, TakesFromAnotherObjectWhatItLacks) {
    const json frame = {{"w", 5}, {"h", nullptr}}, top = {{"w", 7}, {"h", 8}, {"on", true}, {"name", "n"}};
    const JsonField field = JsonField(frame, "a.json").or_of(top);
    EXPECT_EQ(field.number("w"), 5);
    EXPECT_EQ(field.number("h"), 8);
    EXPECT_EQ(field.number("x", 3), 3);
    EXPECT_FALSE(field.number_if("x"));
    EXPECT_TRUE(field.flag("on"));
    EXPECT_FALSE(field.flag("off"));
    EXPECT_EQ(field.text("name", "none"), "n");
    EXPECT_EQ(field.text("other", "none"), "none");
    field_refuses([&] { field.flag("w"); }, "\"w\" is neither true nor false");
    field_refuses([&] { field.text("w"); }, "\"w\" is not a string");
}

TEST(JsonField, KeepsTheTextThatItIsOf) {
    std::vector<JsonField> fields;
    for (const char* text : {R"({"x": "one"})", R"({"x": "two"})"})
        fields.push_back(JsonField::of_text(text, "a.json"));
    EXPECT_EQ(fields[0].text("x"), "one");
    EXPECT_EQ(fields[1].text("x"), "two");
    field_refuses([] { JsonField::of_text("{", "a.json"); }, "byte");
}

TEST(JsonField, ValuesOfOthersMayBeAnything) {
    const json value = {{"text", "t"}, {"number", 2}, {"three", {1, 2, 3}}, {"four", {1, 2, 3, 4}}};
    for (const json& other : {value, json(3), json(), json::array({1})}) {
        const bool whole = other.is_object();
        EXPECT_EQ(core::text_in(other, "text"), whole ? "t" : "");
        EXPECT_EQ(core::text_in(other, "number"), "");
        EXPECT_EQ(core::number_in(other, "number"), whole ? std::optional(2.0) : std::nullopt);
        EXPECT_EQ(core::number_in(other, "text"), std::nullopt);
        EXPECT_EQ(core::three_numbers(other, "three").has_value(), whole);
        EXPECT_FALSE(core::three_numbers(other, "four"));
    }
}

}  // namespace
