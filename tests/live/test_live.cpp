// SPDX-License-Identifier: Apache-2.0
// Watching a training run: protocol, server and client over the loopback, and a run's folder.
#include <gtest/gtest.h>

#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "ewa/error.h"
#include "ewa/splat_files.h"
#include "live/client.h"
#include "live/server.h"
#include "live/watcher.h"
#include "support/temp_folder.h"

namespace ewa::live {
namespace {

using test::TempFolder;

Gaussians some_splats(size_t count, int degree = 1) {
    Gaussians splats;
    splats.sh_degree = degree;
    splats.resize(count);
    float value = 0.5f;
    for (auto* values :
         {&splats.means, &splats.quaternions, &splats.log_scales, &splats.opacity_logits, &splats.sh})
        for (float& v : *values) v = value += 0.25f;
    return splats;
}

report::MetricsLine line_of(int step) {
    report::MetricsLine line;
    line.step = step;
    line.loss = 1.0 / step;
    line.splats = 10;
    if (step % 2 == 0) line.test_psnr = 20 + step;
    return line;
}

Client client_of(const Server& server, const std::string& token = "") {
    return Client({"127.0.0.1", server.port()}, token);
}

/// Until it holds, at most a minute.
template <class Holds>
bool soon(Holds holds) {
    for (int i = 0; i < 6000; ++i) {
        if (holds()) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
}

TEST(LiveProtocol, StatusAndSplatsComeBack) {
    Status status{7, 100, 12, std::nan(""), 3.5, State::paused, true, {line_of(1), line_of(2)}};
    const Status read = decode_status(encode(status));
    EXPECT_EQ(read.step, 7);
    EXPECT_EQ(read.steps, 100);
    EXPECT_TRUE(std::isnan(read.loss));
    EXPECT_EQ(read.state, State::paused);
    EXPECT_TRUE(read.commands);
    ASSERT_EQ(read.metrics.size(), 2u);
    EXPECT_EQ(read.metrics[1].test_psnr, 22);

    Snapshot snapshot{41, some_splats(5, 2)};
    snapshot.gaussians.origin = {5e6, -3, 0.25};
    const Snapshot back = decode_snapshot(encode(snapshot));
    EXPECT_EQ(back.step, 41);
    EXPECT_EQ(back.gaussians.sh, snapshot.gaussians.sh);
    EXPECT_EQ(back.gaussians.means, snapshot.gaussians.means);
    EXPECT_EQ(back.gaussians.origin, snapshot.gaussians.origin);
    EXPECT_EQ(decode_snapshot(encode(Snapshot{})).gaussians.size(), 0u);
}

TEST(LiveProtocol, DamagedBytesAreRefused) {
    const std::vector<std::byte> good = encode(Snapshot{1, some_splats(3)});
    for (size_t size = 0; size < good.size(); ++size)
        EXPECT_THROW(decode_snapshot({good.begin(), good.begin() + std::ptrdiff_t(size)}), InputError);
    for (size_t at = 0; at < 12; ++at) {  // mark, count and degree
        std::vector<std::byte> bad = good;
        bad[at] = std::byte(0xff);
        EXPECT_THROW(decode_snapshot(bad), InputError) << at;
    }
    std::vector<std::byte> nowhere = good;
    for (size_t at = 16; at < 24; ++at) nowhere[at] = std::byte(0xff);
    EXPECT_THROW(decode_snapshot(nowhere), InputError);
    EXPECT_THROW(decode_status("{}"), InputError);
    EXPECT_THROW(decode_status("[1"), InputError);
    const std::string status = encode(Status{});
    const auto with = [&](const std::string& from, const std::string& to) {
        std::string text = status;
        return text.replace(text.find(from), from.size(), to);
    };
    EXPECT_EQ(decode_status(status).step, 0);
    const std::string deep = std::string(200000, '[') + std::string(200000, ']');
    for (const std::string& text :
         {with("[]", "[" + deep + "]"), with("[]", "[3]"), with("[]", "{}"),
          with("\"step\":0", "\"step\":" + deep), with("\"step\":0", "\"step\":1e300"),
          with("\"step\":0", "\"step\":-1"), with("\"splats\":0", "\"splats\":5e9"),
          with("\"running\"", "[]"), with("\"steps\"", "\"step\"")})
        test::expect_error<InputError>([&] { decode_status(text); }, {"the trainer's status"});
    EXPECT_EQ(payload_of("ok 12"), 12u);
    for (const char* line : {"", "ok", "ok -1", "ok 1 2", "ok 99999999999", "no reason", "HTTP/1.1 400 Bad"})
        EXPECT_THROW(payload_of(line), InputError) << line;
}

TEST(LiveProtocol, Addresses) {
    EXPECT_EQ(parse_address("10.0.0.7:81").host, "10.0.0.7");
    EXPECT_EQ(parse_address("[::1]:81").host, "::1");
    EXPECT_EQ(parse_address(":81").host, "localhost");
    EXPECT_EQ(parse_address(":81").port, 81);
    for (const char* text : {"", "localhost", "a:", "a:0", "a:70000", "a:1x"})
        EXPECT_THROW(parse_address(text), InputError) << text;
}

TEST(LiveServer, ShowsWhatTheTrainerLeaves) {
    Server server("127.0.0.1", 0, "secret");
    Client client = client_of(server);
    EXPECT_FALSE(server.wants_splats(3)) << "nobody has asked";
    server.report({3, 10, 5, 0.25, 1.5, State::running, true, {}});
    server.add_metrics(line_of(1));
    server.add_metrics(line_of(2));
    const Status status = client.status(1);
    EXPECT_EQ(status.step, 3);
    EXPECT_FALSE(status.commands) << "it has not shown the token";
    ASSERT_EQ(status.metrics.size(), 1u);
    EXPECT_EQ(status.metrics[0].step, 2);

    EXPECT_FALSE(client.splats(-1));
    EXPECT_TRUE(server.wants_splats(3));
    server.offer({3, some_splats(4)}, 0.001);
    EXPECT_FALSE(server.wants_splats(3)) << "nobody has asked since";
    const auto splats = client.splats(-1);
    ASSERT_TRUE(splats);
    EXPECT_EQ(splats->step, 3);
    EXPECT_EQ(splats->gaussians.size(), 4u);
    EXPECT_FALSE(client.splats(3)) << "nothing later";
    EXPECT_FALSE(server.wants_splats(3)) << "the same step again";
    EXPECT_TRUE(soon([&] { return server.wants_splats(4); })) << "after a pause";
    server.offer({4, some_splats(4)}, 100);
    client.splats(-1);
    EXPECT_FALSE(server.wants_splats(5)) << "taking them was slow";
}

TEST(LiveServer, TakesCommandsFromWhoHasTheToken) {
    Server server("127.0.0.1", 0, "secret");
    Client stranger = client_of(server);
    for (const char* command : {"pause", "go", "save"}) EXPECT_THROW(stranger.command(command), InputError);
    EXPECT_FALSE(server.paused());
    EXPECT_FALSE(server.take_save());
    EXPECT_THROW(client_of(server, "secreT"), InputError);
    EXPECT_THROW(client_of(server, "secret1"), InputError);
    {
        Client owner = client_of(server, "secret");
        EXPECT_TRUE(owner.status(0).commands);
        owner.command("pause");
        EXPECT_TRUE(server.paused());
        EXPECT_EQ(owner.status(0).state, State::paused);
        owner.command("go");
        EXPECT_FALSE(server.paused());
        owner.command("save");
        EXPECT_TRUE(server.take_save());
        EXPECT_FALSE(server.take_save());
        owner.command("pause");
    }
    EXPECT_TRUE(soon([&] { return !server.paused(); })) << "a pause ends with its connection";
    Server open("127.0.0.1", 0, "");
    EXPECT_THROW(client_of(open, "x"), InputError) << "without a token there are no commands";
}

TEST(LiveServer, StrangersAreTurnedAway) {
    Server server("127.0.0.1", 0, "secret");
    {
        const Socket socket = connect_to("127.0.0.1", server.port(), kPatience);
        socket.send(std::string(100000, 'x'), kPatience);
        EXPECT_FALSE(socket.receive_line(100, kPatience)) << "a line too long ends the connection";
    }
    {
        const Socket socket = connect_to("127.0.0.1", server.port(), kPatience);
        for (const char* request :
             {"", "GET / HTTP/1.1", "status", "status -1", "status x", "splats", "splats 99999999999"}) {
            ASSERT_TRUE(socket.send(std::string(request) + "\n", kPatience));
            const auto line = socket.receive_line(200, kPatience);
            ASSERT_TRUE(line) << request;
            EXPECT_EQ(line->rfind("no ", 0), 0u) << request;
        }
    }
    EXPECT_TRUE(soon([&] {
        try {
            client_of(server).status(0);
            return true;
        } catch (const std::exception&) {
            return false;
        }
    }));
}

/// As many as there are places, each with an answer had.
std::vector<Socket> all_places(const Server& server) {
    std::vector<Socket> taken;
    for (int i = 0; i < kMostClients; ++i) {
        taken.push_back(connect_to("127.0.0.1", server.port(), kPatience));
        taken.back().send(std::string(kHello) + "\n", kPatience);
        EXPECT_EQ(taken.back().receive_line(200, kPatience), "ok 0");
    }
    return taken;
}

bool answers(const Socket& socket) {
    return socket.send("status x\n", kPatience) && socket.receive_line(200, kPatience);
}

TEST(LiveServer, WhoIsSilentGivesWay) {
    Server server("127.0.0.1", 0, "secret", std::chrono::seconds(0));
    const std::vector<Socket> taken = all_places(server);
    ASSERT_TRUE(answers(taken[0]));  // any other has been silent for longer now
    Client newcomer = client_of(server);
    EXPECT_EQ(newcomer.status(0).step, 0);
    // Which of them is for the server's threads to know, who write down when they are done with an answer.
    EXPECT_EQ(std::count_if(taken.begin() + 1, taken.end(), answers), kMostClients - 2);
    EXPECT_TRUE(answers(taken[0]));
}

TEST(LiveServer, StrangersCannotShutOutTheOwner) {
    Server server("127.0.0.1", 0, "secret", std::chrono::hours(1));
    const std::vector<Socket> taken = all_places(server);
    try {
        client_of(server).status(0);
        ADD_FAILURE() << "there was a place too many";
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("8 connections"), std::string::npos) << error.what();
    }
    EXPECT_THROW(client_of(server, "secreT"), InputError);
    std::vector<Socket> crowd;  // that says nothing, where the token would be shown
    for (int i = 0; i < 3 * kMostClients; ++i)
        crowd.push_back(connect_to("127.0.0.1", server.port(), kPatience));
    Client owner = client_of(server, "secret");
    EXPECT_TRUE(owner.status(0).commands);
    owner.command("pause");
    EXPECT_TRUE(server.paused());
    for (int i = 0; i < 3 * kMostClients; ++i)
        crowd.push_back(connect_to("127.0.0.1", server.port(), kPatience));
    EXPECT_EQ(owner.status(0).state, State::paused);
    for (const Socket& socket : taken) EXPECT_TRUE(answers(socket));
}

TEST(LiveServer, EndsWhileSomebodyLooksOn) {
    auto server = std::make_unique<Server>("127.0.0.1", 0, "secret");
    Client client = client_of(*server);
    server.reset();
    EXPECT_THROW(client.status(0), RunError);
    EXPECT_THROW(connect_to("127.0.0.1", 1, 2), RunError);
}

TEST(LiveFiles, TheTokenIsTheOwnersAlone) {
    const TempFolder folder;
    EXPECT_FALSE(read_live_file(folder.path()));
    // What is there of others' is not written to, nor does it make the token another's to read.
    const auto others = folder.write("others.txt", "theirs");
    std::filesystem::create_symlink(others, folder.path() / kLiveFile);
    write_live_file(folder.path(), {7001, "abc"});
    EXPECT_EQ(test::file_bytes(others), "theirs");
    chmod((folder.path() / kLiveFile).c_str(), 0644);
    write_live_file(folder.path(), {7001, "abc"});
    struct stat facts {};
    ASSERT_EQ(stat((folder.path() / kLiveFile).c_str(), &facts), 0);
    EXPECT_EQ(facts.st_mode & 0777, 0600u);
    const auto live = read_live_file(folder.path());
    ASSERT_TRUE(live);
    EXPECT_EQ(live->port, 7001);
    EXPECT_EQ(live->token, "abc");
    const std::string deep(5000, '[');
    for (const char* text :
         {"", "{", "{\"port\": 70000, \"token\": \"\"}", "{\"port\": 1}", "[]", deep.c_str()}) {
        folder.write(kLiveFile, text);
        EXPECT_FALSE(read_live_file(folder.path())) << text;
    }
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
    server.report({3, 10, 5, 0.25, 1.5, State::running, false, {}});
    server.add_metrics(line_of(1));
    write_live_file(folder.path(), {server.port(), "secret"});
    ASSERT_TRUE(soon([&] { return watcher.update().connected && watcher.update().status.commands; }));
    ASSERT_TRUE(soon([&] { return server.wants_splats(3); }));
    server.offer({3, some_splats(2)}, 0);
    server.add_metrics(line_of(2));
    ASSERT_TRUE(soon([&] { return watcher.update().splats && watcher.update().status.metrics.size() == 2; }));
    EXPECT_EQ(watcher.update().splats_step, 3);
    watcher.command("pause");
    EXPECT_TRUE(soon([&] { return server.paused(); }));
}

TEST(LiveWatcher, ATrainingThatGoesAwayAndOneBegunAnew) {
    auto server = std::make_unique<Server>("127.0.0.1", 0, "");
    const uint16_t port = server->port();
    Watcher watcher({{}, Address{"127.0.0.1", port}, {}}, [] {});
    const auto known = [&](size_t lines, int step) {
        return watcher.update().status.metrics.size() == lines && watcher.update().splats_step == step;
    };
    server->report({500, 1000, 5, 0.25, 1.5, State::running, false, {}});
    for (int i = 1; i <= 3; ++i) server->add_metrics(line_of(i));
    ASSERT_TRUE(soon([&] { return server->wants_splats(500); }));
    server->offer({500, some_splats(2)}, 0);
    ASSERT_TRUE(soon([&] { return known(3, 500); }));

    server.reset();
    ASSERT_TRUE(soon([&] { return !watcher.update().connected && !watcher.update().problem.empty(); }));
    EXPECT_TRUE(known(3, 500)) << "what was there stays to be seen";

    server = std::make_unique<Server>("127.0.0.1", port, "");
    server->report({2, 1000, 5, 0.25, 1.5, State::running, false, {}});
    server->add_metrics(line_of(1));
    ASSERT_TRUE(soon([&] { return server->wants_splats(2); }));
    server->offer({2, some_splats(2)}, 0);
    EXPECT_TRUE(soon([&] { return known(1, 2); })) << "the old run's curves, or its step, are kept";
    EXPECT_TRUE(watcher.update().connected);
    EXPECT_EQ(watcher.update().problem, "");
}

/// One that accepts and is silent: closing the window does not wait for it.
TEST(LiveWatcher, EndsAtOnceWhereNobodyAnswers) {
    const Listener silent("127.0.0.1", 0);
    const auto start = std::chrono::steady_clock::now();
    {
        const Watcher watcher({{}, Address{"127.0.0.1", silent.port()}, {}}, [] {});
        std::this_thread::sleep_for(std::chrono::milliseconds(300));
    }
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(5));
}

}  // namespace
}  // namespace ewa::live
