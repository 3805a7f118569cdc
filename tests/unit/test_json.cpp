// SPDX-License-Identifier: Apache-2.0
#include "core/json.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "report/summary.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using core::JsonLimits;
using core::parse_json;
using nlohmann::json;
using nlohmann::ordered_json;
using test::expect_error;

std::string times(size_t n, const std::string& text) {
    std::string result;
    for (size_t i = 0; i < n; ++i) result += text;
    return result;
}

std::string between(const char* open, const std::string& inner, const char* close) {
    return std::string(open).append(inner).append(close);
}

std::string keys(size_t n, const std::string& value) {
    std::string text = "{";
    for (size_t i = 0; i < n; ++i)
        text.append(i ? ",\"" : "\"").append(std::to_string(i)).append("\":").append(value);
    return text + "}";
}

void refuse(const std::string& text, std::initializer_list<std::string> parts,
            const JsonLimits& limits = {}) {
    expect_error<InputError>([&] { parse_json<json>(text, "a.json", limits); }, parts);
    expect_error<InputError>([&] { parse_json<ordered_json>(text, "a.json", limits); }, parts);
}

TEST(Json, IsWhatNlohmannReads) {
    for (const std::string text :
         {"3", "-4", "2.5e-3", "18446744073709551615", "true", "null", R"("a\u00e4\n\u0000")", "[]", "{}",
          R"({"b": [1, [], {"x": {}}, [[2]]], "a": {"c": null, "d": "e"}, "b": [3]})", " [1 ,\t2]\n"}) {
        EXPECT_EQ(parse_json<json>(text, "a.json"), json::parse(text)) << text;
        EXPECT_EQ(parse_json<ordered_json>(text, "a.json").dump(), ordered_json::parse(text).dump()) << text;
    }
    const std::string commented = "// one\n{/* two */\"a\": 1}";
    EXPECT_EQ(parse_json<json>(commented, "a.json", JsonLimits{.comments = true}), (json{{"a", 1}}));
    refuse(commented, {"a.json: byte 1: not valid JSON"});
}

TEST(Json, TakesNumbersThatAreNotFiniteWhereAsked) {
    const std::string text =
        R"({"a": NaN, "b": [1, -Infinity, Infinity], "c": "NaN \\\" Infinity", "d": {"e": NaN}, "f": 2})";
    const JsonLimits limits{.comments = true, .not_finite = true};
    const json parsed = parse_json<json>(text, "a.json", limits);
    for (const char* at : {"/a", "/b/1", "/b/2", "/d/e"}) {
        const json& value = parsed[json::json_pointer(at)];
        ASSERT_TRUE(value.is_number_float()) << at;
        EXPECT_TRUE(std::isnan(value.get<double>())) << at;
    }
    EXPECT_EQ(parsed["b"][0], 1);
    EXPECT_EQ(parsed["c"], "NaN \\\" Infinity");
    EXPECT_EQ(parsed["f"], 2);
    EXPECT_EQ(parse_json<json>("[NaN, /* \" NaN */ 1, // it's \" Infinity\n \"NaN\"]", "a.json", limits)[2],
              "NaN");
    EXPECT_TRUE(std::isnan(parse_json<json>("NaN", "a.json", limits).get<double>()));
    for (const char* none : {"[NaN", "[nan]", "[-NaN]", "[Infinity1]", "[NaN NaN]", "[\"NaN]"})
        refuse(none, {"not valid JSON"}, limits);
    // The offsets are those of the file.
    refuse("[NaN, -Infinity, oops]", {"a.json: byte 18: not valid JSON: unexpected '"}, limits);
    refuse(text, {"a.json: byte 7: not valid JSON"});
}

TEST(Json, SaysWhereItIsNone) {
    refuse("", {"a.json: byte 1: not valid JSON: the text ends too early"});
    refuse("[1, 2", {"a.json: byte 6: not valid JSON: the text ends too early"});
    refuse("[1] 2", {"a.json: byte 5: not valid JSON: unexpected '"});
    refuse("{\"a\":\n oops}", {"a.json: byte 8: not valid JSON: unexpected '"});
    refuse("[1e999]", {"a.json: byte 6: not valid JSON: the number 1e999 is too large"});
    refuse("[\"\xff\"]", {"a.json: byte 3: not valid JSON: a text that is not UTF-8"});
    refuse("nope", {"a.json: byte 102: "}, JsonLimits{.begin = 100});
    // The library's own words quote the text at any length.
    try {
        parse_json<json>(between("[\"", std::string(100000, 'x'), "\" \""), "a.json");
        ADD_FAILURE() << "nothing was thrown";
    } catch (const InputError& error) {
        EXPECT_LT(std::string(error.what()).size(), 500u);
        EXPECT_EQ(std::string(error.what()).find("json.exception"), std::string::npos) << error.what();
    }
}

TEST(Json, LeavesOutWhatIsNotWanted) {
    const JsonLimits limits{.objects = 2, .values = 5, .skipped = "extras"};
    EXPECT_EQ(parse_json<json>(R"({"extras": {"a": [1, {"extras": 2}], "b": {}}, "a": 1,
                                  "c": {"extras": 3, "d": [2]}, "extras": [[]], "e": null})",
                               "a.json", limits),
              json::parse(R"({"a": 1, "c": {"d": [2]}, "e": null})"));
    EXPECT_EQ(parse_json<json>(R"({"extras": "extras", "a": "extras"})", "a.json", limits),
              json::parse(R"({"a": "extras"})"));
}

TEST(Json, LimitsHold) {
    const JsonLimits few{.bytes = 40, .depth = 3, .objects = 2, .values = 5};
    EXPECT_EQ(parse_json<json>("[[[1, 2]]]", "a.json", few).size(), 1u);
    refuse("[[[[]]]]", {"a.json", "nests deeper than 3"}, few);
    refuse("[{\"a\":{\"b\":[", {"nests deeper than 3"}, few);
    refuse("[{},{},{}]", {"more than 2 objects"}, few);
    refuse("[1,2,3,4,5]", {"or 5 values"}, few);
    refuse("[[],[],[],[],[]]", {"or 5 values"}, few);
    refuse(std::string(41, ' '), {"41 bytes, more than 40"}, few);
    refuse("{\"extras\":[[[[", {"nests deeper"}, JsonLimits{.depth = 3, .skipped = "extras"});
    for (const char* open : {"[", "{\"a\":", "[{\"a\":", "[[],"})
        refuse(times(1000000, open), {"a.json", "nests deeper than 64 levels"});
    refuse(between("[", times(1 << 22, "0,"), ""), {"4194304 values"});
    refuse(between("[", times(1 << 20, "{},"), "{}]"), {"1048576 objects"});
    // Each key of these is looked for among all the others.
    parse_json<ordered_json>(keys(1024, "1"), "a.json");
    expect_error<InputError>([] { parse_json<ordered_json>(keys(1025, "1"), "a.json"); },
                             {"a.json", "more than 1024 keys"});
    const test::TempFolder folder;
    expect_error<InputError>(
        [&] { core::read_json_file<json>(folder.write("a.json", std::string(41, ' ')), few); },
        {"a.json", "41 bytes"});
    expect_error<InputError>([&] { core::read_json_file<json>(folder / "none.json"); }, {"none.json"});
}

/// Linear time is a second for each of these sizes. Quadratic time would be longer than CTest waits.
TEST(Json, TakesLinearTime) {
    constexpr size_t kMany = 1000000;
    const std::string list = between("[", times(kMany, "[],"), "0]"),
                      objects = between("[", times(kMany, "{\"a\":1},"), "0]");
    for (const std::string& text : {list, objects, between("[", times(kMany, "\"\\u00e4\","), "0]")})
        EXPECT_EQ(parse_json<json>(text, "a.json").size(), kMany + 1) << text.substr(0, 20);
    for (const std::string& text : {keys(kMany, "[]"), keys(kMany, "{}"), keys(kMany, "0")})
        EXPECT_EQ(parse_json<json>(text, "a.json").size(), kMany) << text.substr(0, 20);
    EXPECT_EQ(parse_json<json>(between("{\"a\":", objects, "}"), "a.json")["a"].size(), kMany + 1);
}

TEST(Json, MetricsThatAreNone) {
    const std::string good = R"({"step":1,"seconds":1,"wall_seconds":null,"loss":0.5,"splats":7})";
    EXPECT_EQ(report::parse_metrics(good + "\n" + good + "\n").size(), 2u);
    const auto refused = [&](const std::string& line, const std::string& part) {
        expect_error<InputError>([&] { report::parse_metrics(good + "\n" + line); },
                                 {"line 2 of the metrics", part});
    };
    refused(times(400000, "["), "nests deeper");
    refused(between("{\"step\":", times(400000, "["), ""), "nests deeper");
    refused("[]", "is not a JSON object");
    refused(R"({"step":1e300,"seconds":1,"wall_seconds":1,"loss":1,"splats":7})", "\"step\"");
    refused(R"({"step":1,"seconds":1,"wall_seconds":1,"loss":"x","splats":7})", "\"loss\"");
    refused(R"({"step":1,"seconds":1,"wall_seconds":1,"loss":1,"splats":-7})", "\"splats\"");
}

}  // namespace
