// SPDX-License-Identifier: Apache-2.0
// The changes of structure that the readers are tested with (tests/fuzz/structure.h): each kind is met, and containers fit again.
#include "fuzz/structure.h"

#include <gtest/gtest.h>

#include <functional>
#include <nlohmann/json.hpp>

#include "ewa/splat_files.h"
#include "support/splat_scenes.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using nlohmann::json;

constexpr const char* kStructured =
    R"({"poses": [[1, 2], [3, 4]], "w": 640, "name": "a b", "lens": {"k1": 0.5, "on": true}})";

/// How many of `count` changed files fulfil the condition.
int changed_as(int count, const std::string& from, const std::string& other,
               const std::function<bool(const std::string&)>& condition) {
    int sum = 0;
    for (int seed = 0; seed < count; ++seed)
        sum += condition(fuzz::Structure(uint32_t(seed)).of(from, other));
    return sum;
}

TEST(Structure, OfJsonIsChangedInEachWay) {
    const auto some = [&](const std::function<bool(const json&)>& condition) {
        return changed_as(3000, kStructured, R"({"stranger": [7]})", [&](const std::string& text) {
            const json value = json::parse(text, nullptr, false);
            return value.is_object() && condition(value);
        });
    };
    EXPECT_GT(some([](const json& v) { return v.contains("poses") && v["poses"] == json::array(); }), 10)
        << "emptied";
    EXPECT_GT(some([](const json& v) {
                  return v.contains("poses") && v["poses"].is_array() && v["poses"].size() == 2 &&
                         v["poses"][0] == json::array();
              }),
              10);
    EXPECT_GT(some([](const json& v) { return v.contains("lens") && v["lens"] == json::object(); }), 10);
    EXPECT_GT(some([](const json& v) { return v.contains("w") && !v["w"].is_number(); }), 10)
        << "another type";
    EXPECT_GT(some([](const json& v) { return v.contains("name") && v["name"].is_null(); }), 0);
    EXPECT_GT(some([](const json& v) { return v.contains("w") && v["w"] == 4294967296; }), 0) << "a limit";
    EXPECT_GT(some([](const json& v) { return v.contains("stranger"); }), 10)
        << "a name or property of another file";
    EXPECT_GT(some([](const json& v) { return !v.contains("w"); }), 10) << "renamed or missing";
    EXPECT_GT(some([](const json& v) { return v.contains("poses") && v["poses"].size() > 20; }), 3)
        << "repeated";
    EXPECT_EQ(fuzz::Structure(7).of(kStructured, ""), fuzz::Structure(7).of(kStructured, ""));
}

TEST(Structure, OfXmlIsChanged) {
    const std::string xml =
        "<cameras><camera id=\"0\" label=\"a\"><transform>1 0 0 0</transform></camera></cameras>";
    EXPECT_GT(changed_as(3000, xml, xml,
                         [](const std::string& text) { return text.find("id=[]") != std::string::npos; }),
              1);
    EXPECT_GT(
        changed_as(3000, xml, xml,
                   [&](const std::string& text) { return text.find("<transform>") == std::string::npos; }),
        10);
}

/// Half of the changed files have to come to the reader of what is inside.
TEST(Structure, OfContainersFitsAgain) {
    const test::TempFolder folder;
    const Gaussians scene = test::storable_splats(3, 20, 1);
    for (const char* name : {"a.glb", "a.sog"}) {
        SCOPED_TRACE(name);
        save_splats(folder / name, scene);
        const std::string bytes = test::file_bytes(folder / name);
        int read = 0, refused_inside = 0;
        for (uint32_t seed = 0; seed < 100; ++seed) {
            const std::string changed = fuzz::Structure(seed).of(bytes, bytes);
            folder.write(name, changed);
            try {
                read += read_splats(folder / name).gaussians.size() > 0;
            } catch (const InputError& error) {
                const std::string text = error.what();
                refused_inside +=
                    text.find("\"") != std::string::npos || text.find("JSON") != std::string::npos ||
                    text.find("line ") != std::string::npos || text.find("node") != std::string::npos ||
                    text.find("accessor") != std::string::npos;
            }
        }
        EXPECT_GT(read + refused_inside, 50);
        EXPECT_GT(refused_inside, 5);
    }
}

}  // namespace
