// SPDX-License-Identifier: Apache-2.0
// The watcher's client, before servers that are no trainer, and the socket below both.
#include <gtest/gtest.h>

#include <cmath>

#include <nlohmann/json.hpp>

#include "ewa/error.h"
#include "live/raw_socket.h"
#include "live/wire.h"
#include "live_test.h"
#include "support/temp_folder.h"

namespace ewa::live {
namespace {

using test::RawServer;
using test::RawSocket;
using namespace std::chrono_literals;

TEST(LiveStatus, ComesBack) {
    const Status status{"r1", 7, 100, 12, std::nan(""), 3.5, State::paused, true, {line_of(1), line_of(2)}};
    const Status read = decode_status(encode(status));
    EXPECT_EQ(read.run, "r1");
    EXPECT_EQ(read.step, 7);
    EXPECT_EQ(read.steps, 100);
    EXPECT_EQ(read.splats, 12u);
    EXPECT_TRUE(std::isnan(read.loss));
    EXPECT_EQ(read.seconds, 3.5);
    EXPECT_EQ(read.state, State::paused);
    EXPECT_TRUE(read.commands);
    ASSERT_EQ(read.metrics.size(), 2u);
    EXPECT_EQ(read.metrics[1].test_psnr, 22);
}

TEST(LiveStatus, TellsTheTimeLeft) {
    Status status{.run = "r1", .step = 0, .steps = 1000};
    const auto add = [&](int step, double seconds) {
        report::MetricsLine line = line_of(step);
        line.wall_seconds = seconds;
        status.metrics.push_back(line);
        status.step = step;
    };
    add(100, 1000);  // too long ago to count
    EXPECT_TRUE(std::isnan(seconds_left(status)));
    for (int i = 0; i <= 10; ++i) add(200 + 10 * i, 1000 + 5 * i);
    status.step = 400;
    EXPECT_DOUBLE_EQ(seconds_left(status), 300);
    status.state = State::paused;
    EXPECT_TRUE(std::isnan(seconds_left(status)));
    status.state = State::running;
    status.step = status.steps;
    EXPECT_EQ(seconds_left(status), 0);
    status.metrics.back().step = 100;  // a clock or a run that goes back
    EXPECT_TRUE(std::isnan(seconds_left(status)));
}

TEST(LiveStatus, DamagedTextIsRefused) {
    EXPECT_THROW(decode_status("{}"), InputError);
    EXPECT_THROW(decode_status("[1"), InputError);
    const std::string status = encode(Status{});
    const auto with = [&](const std::string& from, const std::string& to) {
        std::string text = status;
        return text.replace(text.find(from), from.size(), to);
    };
    EXPECT_EQ(decode_status(status).step, 0);
    const std::string deep = std::string(200000, '[') + std::string(200000, ']');
    std::string lines;
    for (size_t i = 0; i <= kMostLines; ++i) lines += (i ? "," : "") + report::to_json(line_of(1)).dump();
    for (const std::string& text :
         {with("[]", "[" + deep + "]"), with("[]", "[3]"), with("[]", "{}"), with("[]", "[" + lines + "]"),
          with("\"step\":0", "\"step\":" + deep), with("\"step\":0", "\"step\":1e300"),
          with("\"step\":0", "\"step\":-1"), with("\"splats\":0", "\"splats\":5e9"),
          with("\"running\"", "[]"), with("\"steps\"", "\"step\""), with("\"run\":\"\"", "\"run\":1"),
          with("\"run\":\"\"", "\"run\":\"" + std::string(1000, 'x') + "\"")})
        test::expect_error<InputError>([&] { decode_status(text); }, {"the trainer's status"});
}

TEST(LiveClient, Addresses) {
    EXPECT_EQ(parse_address("10.0.0.7:81").host, "10.0.0.7");
    EXPECT_EQ(parse_address("[::1]:81").host, "::1");
    EXPECT_EQ(parse_address(":81").host, "localhost");
    EXPECT_EQ(parse_address(":81").port, 81);
    for (const char* text : {"", "localhost", "a:", "a:0", "a:70000", "a:1x"})
        EXPECT_THROW(parse_address(text), InputError) << text;
}

TEST(LiveClient, NamesReachAServer) {
    const Server server("127.0.0.1", 0, "secret");
    EXPECT_TRUE(Client({"localhost", server.port()}, "secret").status(0).commands);
    test::expect_error<RunError>(
        [] {
            Client({"127.0.0.1", 1}, "").status(0);
        },
        {"cannot reach 127.0.0.1:1"});
}

/// Whatever answers: an error, soon, in bounded memory.
TEST(LiveClient, AnswersOfOthersAreErrors) {
    const std::string ok = "HTTP/1.1 200 OK\r\nServer: ewa/1\r\n";
    std::string headers = ok;
    for (int i = 0; i < 10000; ++i) headers += "X" + std::to_string(i) + ": y\r\n";
    const std::string status = encode(Status{});
    const auto sized = [&](const std::string& body) {
        return ok + "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body;
    };
    std::string ply =
        "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\nend_header\n";
    for (const std::string& answer : std::vector<std::string>{
             std::string("ok 0\n"), std::string("no\r\n\r\n"), std::string(1, '\0'),
             "HTTP/1.1 200 " + std::string(1000000, 'a') + "\r\n\r\n",  // a stack overflow in cpp-httplib
             "HTTP/1.1 100 Continue\r\n\r\nHTTP/1.1 200 " + std::string(1000000, 'a') + "\r\n\r\n",
             std::string(1000000, 'a'), headers, ok + "X: " + std::string(1000000, 'a') + "\r\n\r\n",
             ok + "\r\n", ok + "Content-Length: 99999999999999\r\n\r\n{", ok + "Content-Length: -1\r\n\r\n{",
             ok + "Transfer-Encoding: chunked\r\n\r\nfffffffffffffff\r\n" + status, sized(""), sized("{}"),
             sized(status).substr(0, 100), sized(std::string(17u << 20, ' ') + status), sized(ply),
             "HTTP/1.1 301 Moved\r\nServer: ewa/1\r\nLocation: http://127.0.0.1:1/\r\nContent-Length: "
             "0\r\n\r\n",
             "HTTP/1.1 200 OK\r\nServer: other\r\nContent-Length: " + std::to_string(status.size()) +
                 "\r\n\r\n" + status}) {
        const RawServer server(answer);
        Client client({"127.0.0.1", server.port()}, "");
        const std::string told = answer.substr(0, 60);
        const auto fails = [&](const auto& action) {
            try {
                action();
                ADD_FAILURE() << told;
            } catch (const InputError& error) {
                EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << told;
            } catch (const RunError& error) {
                EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << told;
            }
        };
        fails([&] { client.status(0); });
        fails([&] { client.splats(""); });
    }
    const RawServer refuses("HTTP/1.1 403 No\r\nServer: ewa/1\r\nContent-Length: 9\r\n\r\nnot \x1b[you");
    test::expect_error<InputError>(
        [&] {
            Client({"127.0.0.1", refuses.port()}, "").status(0);
        },
        {"the trainer refuses: not \\x1b[you"});
}

TEST(LiveClient, EverySplatFileCutShortIsRefused) {
    Server server("127.0.0.1", 0, "");
    server.offer({1, some_splats(2, 0)}, 0);
    const RawSocket socket(server.port());
    socket.send("GET /splats HTTP/1.1\r\nHost: localhost\r\n\r\n");
    const std::string whole = socket.receive();
    const std::string ply = whole.substr(whole.find("\r\n\r\n") + 4);
    for (size_t size = 0; size < ply.size(); size += 7) {
        const RawServer cut("HTTP/1.1 200 OK\r\nServer: ewa/1\r\nContent-Length: " + std::to_string(size) +
                            "\r\n\r\n" + ply.substr(0, size));
        test::expect_error<InputError>(
            [&] {
                Client({"127.0.0.1", cut.port()}, "").splats("");
            },
            {"the trainer's splats cannot be read"});
    }
}

struct Pair {
    int ends[2] = {-1, -1};
    Pair() { EXPECT_EQ(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends), 0); }
    ~Pair() {
        for (const int end : ends) close(end);
    }
};

TEST(LiveWire, BoundsBytesAndTime) {
    const Pair pair;
    Wire wire(pair.ends[0], 6, 200ms);
    char to[16] = {};
    ASSERT_EQ(send(pair.ends[1], "123456789", 9, 0), 9);
    EXPECT_EQ(wire.read(to, 4), 4);
    EXPECT_EQ(wire.read(to, 4), 2);
    EXPECT_EQ(wire.read(to, 4), -1) << "six bytes and no more";
    wire.allow(5);
    EXPECT_EQ(wire.read(to, 16), 3);
    const auto start = std::chrono::steady_clock::now();
    EXPECT_EQ(wire.read(to, 16), -1) << "nothing comes";
    EXPECT_GE(std::chrono::steady_clock::now() - start, 150ms);

    constexpr int kDrips = 1200;  // a minute of them
    Wire late(pair.ends[0], 2 * kDrips, 200ms);
    std::atomic<bool> ended = false;
    std::atomic<int> dripped = 0;
    std::thread drips([&] {
        for (; !ended && dripped < kDrips; ++dripped) {
            send(pair.ends[1], "x", 1, 0);
            std::this_thread::sleep_for(50ms);
        }
    });
    while (late.read(to, 1) == 1) {
    }
    ended = true;
    drips.join();
    EXPECT_LT(dripped, kDrips) << "each byte came in time, all of them did not";
}

TEST(LiveWire, AnAnswerThatNobodyReadsEnds) {
    const Pair pair;
    const int large = 1 << 20;  // the kernel takes so much, and nobody reads it
    ASSERT_EQ(setsockopt(pair.ends[0], SOL_SOCKET, SO_SNDBUF, &large, sizeof(large)), 0);
    Wire wire(pair.ends[0], 1, 100ms, nullptr, 200ms);
    const std::string much(8u << 20, 'x');
    EXPECT_EQ(wire.write(much.data(), much.size()), -1);
}

}  // namespace
}  // namespace ewa::live
