// SPDX-License-Identifier: Apache-2.0
// libewa prints nothing: what it has to say goes to a handler of the caller's.
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "core/messages.h"
#include "ewa/log.h"
#include "ewa/splat_files.h"
#include "support/splat_scenes.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;

/// Restores that nobody listens.
struct Heard {
    std::vector<std::string> lines;
    Heard() {
        set_log_handler([this](LogLevel level, std::string_view text) {
            EXPECT_EQ(level, LogLevel::warning);
            lines.emplace_back(text);
        });
    }
    ~Heard() { set_log_handler(nullptr); }
};

TEST(Log, WarningsGoToTheHandlerAlone) {
    const test::TempFolder folder;
    const Gaussians g = test::storable_splats(1, 9, 0);
    testing::internal::CaptureStderr();
    save_splats(folder / "silent.splat", g);
    {
        const Heard heard;
        save_splats(folder / "a.spz", g);
        ASSERT_EQ(heard.lines.size(), 1u);
        EXPECT_NE(heard.lines[0].find("a.spz: "), std::string::npos) << heard.lines[0];
        core::warn("of two\nlines");
        EXPECT_EQ(heard.lines.back(), "of two lines");
    }
    save_splats(folder / "silent.splat", g);
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    core::print_warnings();
    testing::internal::CaptureStderr();
    core::warn("printed");
    set_log_handler(nullptr);
    core::warn("dropped");
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "warning: printed\n");
}

TEST(Log, AHandlerIsCalledOnceAtATimeAndMayReplaceItself) {
    int inside = 0, calls = 0;  // not atomic: the handler is called once at a time
    set_log_handler([&](LogLevel, std::string_view) {
        EXPECT_EQ(++inside, 1);
        ++calls;
        --inside;
    });
    {
        std::vector<std::jthread> threads;
        for (int i = 0; i < 4; ++i)
            threads.emplace_back([] {
                for (int k = 0; k < 500; ++k) core::warn("w");
            });
    }
    EXPECT_EQ(calls, 2000);
    const auto count = std::make_shared<int>(0);
    set_log_handler([count](LogLevel, std::string_view) {
        set_log_handler(nullptr);
        core::warn("of the handler itself");
        ++*count;
    });
    core::warn("first");
    core::warn("second");
    EXPECT_EQ(*count, 1);
    EXPECT_EQ(count.use_count(), 1);
}

}  // namespace
