// SPDX-License-Identifier: Apache-2.0
// Any text as JSON: what nlohmann's own parser makes of it, or an InputError of one line; and as the options
// of a training and the metrics of one.
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <string_view>

#include "cli/config.h"
#include "core/json.h"
#include "ewa/error.h"
#include "input.h"
#include "report/summary.h"

namespace {

using namespace ewa;

template <class Action>
bool taken(const Action& action) {
    try {
        action();
        return true;
    } catch (const InputError& error) {
        const std::string text = error.what();
        EWA_REQUIRE(!text.empty() && text.find('\n') == std::string::npos && text.size() < 1000);
        return false;
    }
}

template <class Json>
void compare(const std::string& bytes) {
    const std::string text = bytes.substr(0, 200);
    for (const bool comments : {false, true}) {
        core::JsonLimits limits;
        limits.comments = comments;
        limits.depth = 2000;  // more than nlohmann's destructor and comparison mind
        Json ours;
        const bool good = taken([&] { ours = core::parse_json<Json>(bytes, "a.json", limits); });
        const Json theirs = Json::parse(bytes, nullptr, false, comments);
        EWA_REQUIRE(good ? ours == theirs : true);
        EWA_REQUIRE(good || theirs.is_discarded() || bytes.size() > 2000);
    }
    core::JsonLimits few;
    few.depth = 5;
    few.objects = few.values = 20;
    few.skipped = "extras";
    taken([&] { core::parse_json<Json>(bytes, "a.json", few); });
}

void configure(const std::string& path) {
    CLI::App app;
    int steps = 0;
    bool quiet = false;
    std::string kernel, background, dataset;
    app.add_option("DATASET", dataset);
    app.add_option("--steps", steps)->check(CLI::Range(1, 1000000));
    app.add_option("--background", background);
    app.add_option("--kernel", kernel)->check(CLI::IsMember({"peak", "antialias", "density", "ewa"}));
    app.add_flag("--absgrad", quiet);
    try {
        cli::apply_config(app, path);
    } catch (const CLI::Error&) {
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static fuzz::MemoryFile file;
    const std::string& path = file.hold(data, size);
    const std::string text(reinterpret_cast<const char*>(data), size);
    fuzz::read_within(size, 1, [&] {
        compare<nlohmann::json>(text);
        compare<nlohmann::ordered_json>(text);
        taken([&] { configure(path); });
        taken([&] { report::parse_metrics(text); });
    });
    return 0;
}
