// SPDX-License-Identifier: Apache-2.0
// Following a training run, by its files and over HTTP.
#include "live/watcher.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "ewa/error.h"
#include "ewa/splat_files.h"
#include "folders/run_folder.h"
#include "live/raw_socket.h"
#include "live_test.h"
#include "support/temp_folder.h"

namespace ewa::live {
namespace {

using test::TempFolder;

TEST(LiveFiles, TheTokenIsTheOwnersAlone) {
    const TempFolder folder;
    EXPECT_FALSE(read_live_file(folder.path()));
    // What is there of others' is not written to, nor does it make the token another's to read.
    const auto others = folder.write("others.txt", "theirs");
    std::filesystem::create_symlink(others, folder.path() / folders::kLiveFile);
    write_live_file(folder.path(), {7001, "abc"});
    EXPECT_EQ(test::file_bytes(others), "theirs");
    chmod((folder.path() / folders::kLiveFile).c_str(), 0644);
    write_live_file(folder.path(), {7001, "abc"});
    struct stat facts {};
    ASSERT_EQ(stat((folder.path() / folders::kLiveFile).c_str(), &facts), 0);
    EXPECT_EQ(facts.st_mode & 0777, 0600u);
    const auto live = read_live_file(folder.path());
    ASSERT_TRUE(live);
    EXPECT_EQ(live->port, 7001);
    EXPECT_EQ(live->token, "abc");
    const std::string deep(5000, '[');
    for (const char* text :
         {"", "{", "{\"port\": 70000, \"token\": \"\"}", "{\"port\": 1}", "[]", deep.c_str()}) {
        folder.write(folders::kLiveFile, text);
        EXPECT_FALSE(read_live_file(folder.path())) << text;
    }
}

TEST(LiveFiles, ATokenNeedsNoCommandLine) {
    const TempFolder folder;
    EXPECT_EQ(find_token("", {}), "");
    setenv("EWA_TOKEN", "from the environment", 1);
    EXPECT_EQ(find_token("", {}), "from the environment");
    write_live_file(folder.path(), {7001, "abc"});
    EXPECT_EQ(find_token("", folder.path() / folders::kLiveFile), "abc");
    EXPECT_EQ(find_token("", folder.write("token", "def\n")), "def");
    EXPECT_EQ(find_token("given", folder.path() / "none"), "given");
    unsetenv("EWA_TOKEN");
    for (const char* text : {"", "{\"port\": 1}", "{", "two words", "\x1b[0m"}) {
        const auto file = folder.write("wrong", text);
        EXPECT_THROW(find_token("", file), InputError) << text;
    }
    EXPECT_THROW(find_token("", folder.path() / "none"), InputError);
}

TEST(LiveWatcher, FollowsARunByItsFiles) {
    const TempFolder folder;
    folder.write("config.json", std::string(400000, '['));
    folder.write("metrics.jsonl", report::metrics_text({line_of(1)}));
    {
        const Watcher without({folder.path(), {}, {}}, [] {});
        ASSERT_TRUE(soon([&] { return without.update().status.step == 1; }));
        EXPECT_EQ(without.update().status.steps, 0);
    }
    folder.write("config.json", "{\"steps\": 50}");
    folder.write("metrics.jsonl", report::metrics_text({line_of(1)}) + "{\"step\": 2, \"los");
    Watcher watcher({folder.path(), {}, {}}, [] {});
    ASSERT_TRUE(soon([&] { return watcher.update().status.step == 1; }));
    EXPECT_EQ(watcher.update().status.steps, 50);
    EXPECT_FALSE(watcher.update().splats);
    save_splats(folder.path() / "splats.ply", some_splats(6));
    folder.write("metrics.jsonl", report::metrics_text({line_of(1), line_of(2)}));
    ASSERT_TRUE(soon([&] { return watcher.update().splats && watcher.update().status.step == 2; }));
    EXPECT_EQ(watcher.update().splats->size(), 6u);
    EXPECT_EQ(watcher.update().status.state, State::running);
    EXPECT_FALSE(watcher.update().connected);
    watcher.command("pause");
    EXPECT_TRUE(soon([&] { return watcher.update().problem.find("--serve") != std::string::npos; }));
    folder.write("metrics.jsonl", "nonsense\n");
    EXPECT_TRUE(
        soon([&] { return watcher.update().problem.find("metrics.jsonl: line 1") != std::string::npos; }));
}

TEST(LiveWatcher, FollowsARunByItsConnection) {
    const TempFolder folder;
    Watcher watcher({folder.path(), {}, {}}, [] {});
    Server server("127.0.0.1", 0, "secret");
    server.report(status_at(3));
    server.add_metrics(line_of(1));
    write_live_file(folder.path(), {server.port(), "secret"});
    ASSERT_TRUE(soon([&] { return watcher.update().connected && watcher.update().status.commands; }));
    ASSERT_TRUE(soon([&] { return server.wants_splats(3); }));
    server.offer({3, some_splats(2)}, 0);
    server.add_metrics(line_of(2));
    ASSERT_TRUE(soon([&] { return watcher.update().splats && watcher.update().status.metrics.size() == 2; }));
    EXPECT_EQ(watcher.update().splats_step, 3);
    EXPECT_TRUE(watcher.update().frozen.empty());
    ASSERT_TRUE(soon([&] { return server.wants_splats(4); }));
    server.offer({4, some_splats(2), {false, true}}, 0);
    ASSERT_TRUE(soon([&] { return watcher.update().splats_step == 4; }));
    EXPECT_EQ(watcher.update().frozen, (std::vector<bool>{false, true}));
    watcher.command("pause");
    EXPECT_TRUE(soon([&] { return server.paused(); }));
    watcher.command("resume");
    EXPECT_TRUE(soon([&] { return !server.paused(); }));
    watcher.command("dance");
    EXPECT_TRUE(soon([&] { return watcher.update().problem.find("the trainer refuses") == 0; }));
    EXPECT_TRUE(soon([&] { return watcher.update().connected; })) << "it connects again";
}

TEST(LiveWatcher, EditsTheSplats) {
    Server server("127.0.0.1", 0, "secret");
    Editing editing(server);
    Watcher watcher({{}, Address{"127.0.0.1", server.port()}, "secret"}, [] {});
    EXPECT_EQ(watcher.update().edits, 0u);
    watcher.edit("x");
    ASSERT_TRUE(soon([&] { return watcher.update().edits == 1; }));
    const Update done = watcher.update();
    ASSERT_TRUE(done.last_edit);
    EXPECT_EQ(done.last_edit->counts.removed, 10u);
    EXPECT_EQ(done.edit_refusal, "");
    watcher.edit("bad");
    ASSERT_TRUE(soon([&] { return watcher.update().edits == 2; }));
    EXPECT_FALSE(watcher.update().last_edit);
    EXPECT_EQ(watcher.update().edit_refusal, "the trainer refuses: --dance is no edit");
    EXPECT_TRUE(soon([&] { return watcher.update().connected; }));

    const TempFolder folder;
    Watcher of_files({folder.path(), {}, {}}, [] {});
    of_files.edit("x");
    ASSERT_TRUE(soon([&] { return of_files.update().edits == 1; }));
    EXPECT_NE(of_files.update().edit_refusal.find("--serve"), std::string::npos);
}

/// A pause lasts while the window is there, and ends after it has gone.
TEST(LiveWatcher, HoldsAPauseWhileItLives) {
    Server server("127.0.0.1", 0, "secret", std::chrono::seconds(1));
    auto watcher =
        std::make_unique<Watcher>(WhatToWatch{{}, Address{"127.0.0.1", server.port()}, "secret"}, [] {});
    watcher->command("pause");
    ASSERT_TRUE(soon([&] { return server.paused(); }));
    const auto start = std::chrono::steady_clock::now();
    while (std::chrono::steady_clock::now() - start < std::chrono::seconds(2)) ASSERT_TRUE(server.paused());
    watcher.reset();
    EXPECT_TRUE(soon([&] { return !server.paused(); }));
}

TEST(LiveWatcher, ATrainingThatGoesAwayAndOneBegunAnew) {
    auto server = std::make_unique<Server>("127.0.0.1", 0, "");
    const uint16_t port = server->port();
    Watcher watcher({{}, Address{"127.0.0.1", port}, {}}, [] {});
    const auto known = [&](size_t lines, int step) {
        return watcher.update().status.metrics.size() == lines && watcher.update().splats_step == step;
    };
    server->report(status_at(500, 1000));
    for (int i = 1; i <= 3; ++i) server->add_metrics(line_of(i));
    ASSERT_TRUE(soon([&] { return server->wants_splats(500); }));
    server->offer({500, some_splats(2)}, 0);
    ASSERT_TRUE(soon([&] { return known(3, 500); }));

    server.reset();
    ASSERT_TRUE(soon([&] { return !watcher.update().connected && !watcher.update().problem.empty(); }));
    EXPECT_TRUE(known(3, 500)) << "what was there stays to be seen";

    server = std::make_unique<Server>("127.0.0.1", port, "");
    server->report(status_at(2, 1000));
    server->add_metrics(line_of(1));
    ASSERT_TRUE(soon([&] { return server->wants_splats(2); }));
    server->offer({2, some_splats(2)}, 0);
    EXPECT_TRUE(soon([&] { return known(1, 2); })) << "the old run's curves, or its step, are kept";
    EXPECT_TRUE(watcher.update().connected);
    EXPECT_EQ(watcher.update().problem, "");
}

/// One that accepts and is silent. Closing the window does not wait for it: that would take an hour.
TEST(LiveWatcher, EndsAtOnceWhereNobodyAnswers) {
    const test::RawServer silent("");
    WhatToWatch what{{}, Address{"127.0.0.1", silent.port()}, {}};
    what.patience = std::chrono::hours(1);
    auto watcher = std::make_unique<Watcher>(what, [] {});
    ASSERT_TRUE(soon([&] { return silent.requests() > 0; }));
    watcher.reset();
    EXPECT_EQ(silent.requests(), 1) << "it asks again";
}

}  // namespace
}  // namespace ewa::live
