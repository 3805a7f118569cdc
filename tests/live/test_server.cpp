// SPDX-License-Identifier: Apache-2.0
// The HTTP server of a training: what it gives, and what it refuses.
#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <regex>

#include "ewa/dataset.h"
#include "ewa/error.h"
#include "ewa/splat_files.h"
#include "live/raw_socket.h"
#include "live_test.h"
#include "support/splat_scenes.h"
#include "support/temp_folder.h"

namespace ewa::live {
namespace {

using test::RawSocket;
using namespace std::chrono_literals;

constexpr const char* kHost = "Host: 127.0.0.1\r\n";
const std::string kToken = "Authorization: Bearer secret\r\n";

/// The answer to a request of this first line, with these headers besides Host.
std::string ask(const Server& server, const std::string& what, const std::string& headers = "") {
    const RawSocket socket(server.port());
    socket.send(what + " HTTP/1.1\r\n" + kHost + headers + "\r\n");
    return socket.receive();
}

int status_code(const std::string& answer) {
    return answer.starts_with("HTTP/1.1 ") ? std::atoi(answer.c_str() + 9) : 0;
}

/// Splats that fill what the system holds of an answer that nobody reads.
Snapshot large(int step) {
    return {step, some_splats(300000, 0)};
}

TEST(LiveServer, ShowsWhatTheTrainerLeaves) {
    Server server("127.0.0.1", 0, "secret");
    Client client = client_of(server);
    EXPECT_FALSE(server.wants_splats(3)) << "nobody has asked";
    server.report(status_at(3));
    server.add_metrics(line_of(1));
    server.add_metrics(line_of(2));
    const Status status = client.status(1);
    EXPECT_EQ(status.step, 3);
    EXPECT_EQ(status.steps, 10);
    EXPECT_FALSE(status.commands) << "it has not shown the token";
    ASSERT_EQ(status.metrics.size(), 1u);
    EXPECT_EQ(status.metrics[0].step, 2);

    EXPECT_FALSE(client.splats(""));
    EXPECT_TRUE(server.wants_splats(3));
    server.offer({3, some_splats(4)}, 0.001);
    EXPECT_FALSE(server.wants_splats(3)) << "nobody has asked since";
    const auto splats = client.splats("");
    ASSERT_TRUE(splats);
    EXPECT_EQ(splats->step, 3);
    EXPECT_EQ(splats->gaussians.size(), 4u);
    EXPECT_FALSE(client.splats(splats->tag)) << "nothing later";
    EXPECT_FALSE(server.wants_splats(3)) << "the same step again";
    EXPECT_TRUE(soon([&] { return server.wants_splats(4); })) << "after a pause";
    server.offer({4, some_splats(4)}, 100);
    EXPECT_EQ(client.splats(splats->tag)->step, 4);
    EXPECT_FALSE(server.wants_splats(5)) << "taking them was slow";
}

TEST(LiveServer, SplatsComeBackExactly) {
    Server server("127.0.0.1", 0, "");
    Client client = client_of(server);
    for (const int degree : {0, 2, 3}) {
        // More rows than go out at once; an origin makes the positions double.
        Snapshot snapshot{degree, some_splats(5000, degree)};
        for (size_t i = 0; i < snapshot.gaussians.means.size(); ++i)
            snapshot.gaussians.means[i] = float(i % 64) / 8;
        if (degree == 2) snapshot.gaussians.origin = {5e6, -3, 0.25};
        const Gaussians sent = snapshot.gaussians;
        server.offer(std::move(snapshot), 0);
        const auto back = client.splats("");
        ASSERT_TRUE(back);
        EXPECT_EQ(back->step, degree);
        EXPECT_EQ(back->gaussians.sh_degree, degree);
        EXPECT_EQ(back->gaussians.sh, sent.sh);
        EXPECT_EQ(back->gaussians.quaternions, sent.quaternions);
        EXPECT_EQ(back->gaussians.log_scales, sent.log_scales);
        EXPECT_EQ(back->gaussians.opacity_logits, sent.opacity_logits);
        ASSERT_EQ(back->gaussians.size(), sent.size());
        for (size_t i = 0; i < sent.size(); ++i) ASSERT_EQ(back->gaussians.world_mean(i), sent.world_mean(i));
    }
    server.offer({7, Gaussians()}, 0);
    EXPECT_EQ(client.splats("")->gaussians.size(), 0u);
}

/// Which splats are frozen comes with them, so both are of one step.
TEST(LiveServer, FrozenSplatsComeWithTheOthers) {
    Server server("127.0.0.1", 0, "");
    Client client = client_of(server);
    std::vector<bool> frozen(5000);
    for (size_t i = 3; i < frozen.size(); i += 7) frozen[i] = true;
    const Gaussians sent = some_splats(5000);
    server.offer({3, sent, frozen}, 0);
    const auto back = client.splats("");
    ASSERT_TRUE(back);
    EXPECT_TRUE(back->frozen == frozen);
    EXPECT_TRUE(back->gaussians.means == sent.means && back->gaussians.sh == sent.sh &&
                back->gaussians.quaternions == sent.quaternions);
    const test::TempFolder folder;
    const std::string answer = ask(server, "GET /splats");
    const auto file = folder.write("splats.ply", answer.substr(answer.find("\r\n\r\n") + 4));
    EXPECT_TRUE(load_splats(file).sh == sent.sh) << "it is no PLY of splats";
    server.offer({4, sent}, 0);
    EXPECT_TRUE(client.splats("")->frozen.empty());
    EXPECT_EQ(ask(server, "GET /splats").find("frozen"), std::string::npos);
    server.offer({5, sent, std::vector<bool>(5000)}, 0);
    EXPECT_TRUE(client.splats("")->frozen.empty()) << "none is frozen";
}

/// What is saved to a file without ewa is what ewa writes.
TEST(LiveServer, GivesAPlyFileOfThePresentStep) {
    Server server("127.0.0.1", 0, "");
    server.report(status_at(3));
    server.offer({2, some_splats(3)}, 0);
    std::string answer;
    std::thread asks([&] { answer = ask(server, "GET /splats"); });
    EXPECT_TRUE(soon([&] { return server.wants_splats(3); }));
    const test::TempFolder folder;
    save_splats(folder.path() / "splats.ply", some_splats(6));
    server.offer({3, some_splats(6)}, 0);
    asks.join();
    EXPECT_EQ(status_code(answer), 200);
    EXPECT_NE(answer.find("Ewa-Step: 3\r\n"), std::string::npos);
    EXPECT_EQ(answer.substr(answer.find("\r\n\r\n") + 4), test::file_bytes(folder.path() / "splats.ply"));
    const std::string head = ask(server, "HEAD /splats");
    EXPECT_EQ(head, answer.substr(0, answer.find("\r\n\r\n") + 4)) << "HEAD is GET without the body";
}

TEST(LiveServer, GivesAPageWhoseViewsAreThoseOfTheRun) {
    Server server("127.0.0.1", 0, "secret");
    const std::string early = ask(server, "GET /");
    EXPECT_EQ(status_code(early), 503) << "there are no splats, so no views";
    EXPECT_NE(early.find("\r\nRefresh: 1\r\n"), std::string::npos) << "a browser does not ask again";

    Dataset cameras;
    cameras.frames.resize(1);
    cameras.frames[0].name = "first.jpg";
    cameras.frames[0].camera = {40, 30, 50, 60, 20, 15};
    SaveOptions options;
    options.page = {.title = "a <run>", .cameras = &cameras, .background = {1, 0, 0.5f}};
    server.describe(options);
    server.offer({3, test::storable_splats(1, 50, 1)}, 0);
    const std::string page = ask(server, "GET /");
    EXPECT_EQ(status_code(page), 200);
    for (const char* part :
         {"\r\nContent-Type: text/html", "\r\nContent-Security-Policy: frame-ancestors 'none'\r\n",
          "default-src 'none'", "connect-src 'self'", "\"live\":true", "<title>a &lt;run&gt;</title>",
          "\"name\":\"first.jpg\"", "\"fx\":50.0,\"fy\":60.0", "\"background\":[1.0,0.0,0.5]"})
        EXPECT_NE(page.find(part), std::string::npos) << part;

    for (const char* path : {"GET /", "GET /scene"}) {
        const RawSocket socket(server.port());
        socket.send(std::string(path) + " HTTP/1.1\r\nHost: evil.example\r\n\r\n");
        EXPECT_EQ(status_code(socket.receive()), 403) << path;
        EXPECT_EQ(status_code(ask(server, path, "Sec-Fetch-Site: cross-site\r\n")), 403) << path;
        EXPECT_EQ(status_code(ask(server, path, "Authorization: Bearer secreT\r\n")), 401) << path;
    }
}

/// The value of a header of an answer.
std::string header_of(const std::string& answer, const std::string& name) {
    const size_t at = answer.find("\r\n" + name + ": ");
    if (at == std::string::npos) return "";
    const size_t begin = at + name.size() + 4;
    return answer.substr(begin, answer.find("\r\n", begin) - begin);
}

TEST(LiveServer, GivesTheSceneAsASogFile) {
    Server server("127.0.0.1", 0, "");
    EXPECT_EQ(status_code(ask(server, "GET /scene", "If-None-Match: \"x\"\r\n")), 304) << "nothing newer";
    EXPECT_TRUE(server.wants_splats(0));
    Gaussians splats = test::storable_splats(1, 60, 2);
    const test::TempFolder folder;
    const SaveOptions antialiased{.antialiased = true};
    save_splats(folder.path() / "file.sog", splats, antialiased);
    server.describe(antialiased);
    server.offer({3, splats}, 0);
    const std::string first = ask(server, "GET /scene");
    EXPECT_EQ(status_code(first), 200);
    EXPECT_EQ(header_of(first, "Ewa-Step"), "3");
    EXPECT_EQ(first.substr(first.find("\r\n\r\n") + 4), test::file_bytes(folder.path() / "file.sog"));

    const std::string known = "If-None-Match: " + header_of(first, "ETag") + "\r\n";
    EXPECT_EQ(status_code(ask(server, "GET /scene", known)), 304);
    splats.means[3] = NAN;  // is left out
    server.offer({4, splats}, 0);
    std::string second;
    EXPECT_TRUE(soon([&] { return status_code(second = ask(server, "GET /scene", known)) == 200; }));
    EXPECT_EQ(header_of(second, "Ewa-Step"), "4");
    EXPECT_NE(header_of(second, "ETag"), header_of(first, "ETag"));
    const auto file = folder.write("second.sog", second.substr(second.find("\r\n\r\n") + 4));
    EXPECT_EQ(load_splats(file).size(), 59u);
}

TEST(LiveScenes, LeaveTimeToTheTraining) {
    Scenes scenes;
    const Gaussians splats = test::storable_splats(1, 20000, 0);  // slow enough for a rest that is seen
    EXPECT_FALSE(scenes.kept(true, true)) << "there is none";
    const auto first = scenes.of({1, 0}, splats, {}, true, true);
    EXPECT_EQ(scenes.kept(true, true), first);
    EXPECT_EQ(scenes.kept(false, true), first);
    EXPECT_EQ(scenes.of({2, 0}, splats, {}, true, true), first) << "asked for while it was made";
    EXPECT_FALSE(scenes.kept(true, false)) << "a paused training has time";
    EXPECT_EQ(scenes.of({1, 0}, splats, {}, true, false), first) << "it is of this step";
    EXPECT_TRUE(soon([&] { return !scenes.kept(true, true); })) << "the rest has no end";
}

TEST(LiveScenes, StrangersHoldOne) {
    Scenes scenes;
    const Gaussians splats = test::storable_splats(1, 10, 0);
    auto held = scenes.of({1, 0}, splats, {}, false, false);
    EXPECT_EQ(scenes.of({2, 0}, splats, {}, true, false)->step, 2);
    EXPECT_EQ(scenes.kept(false, false), held) << "a second scene is kept for strangers";
    EXPECT_FALSE(scenes.kept(true, false));
    held.reset();
    EXPECT_FALSE(scenes.kept(false, false));
    EXPECT_EQ(scenes.of({2, 0}, splats, {}, false, false)->step, 2);
}

TEST(LiveServer, TakesCommandsFromWhoHasTheToken) {
    Server server("127.0.0.1", 0, "secret");
    Client stranger = client_of(server);
    for (const char* command : {"pause", "resume", "save"})
        EXPECT_THROW(stranger.command(command), InputError);
    for (const char* token : {"secreT", "secret1", "secre", "Bearer secret"}) {
        EXPECT_THROW(client_of(server, token).command("pause"), InputError) << token;
        EXPECT_THROW(client_of(server, token).status(0), InputError) << token;
    }
    for (const char* header : {"", "Authorization: secret\r\n", "Authorization: Basic c2VjcmV0\r\n"}) {
        EXPECT_EQ(status_code(ask(server, "POST /pause", header)), 401) << header;
        EXPECT_EQ(status_code(ask(server, "POST /save?token=secret", header)), 401) << header;
    }
    EXPECT_EQ(status_code(ask(server, "GET /pause", kToken)), 404) << "a link would pause";
    EXPECT_FALSE(server.paused());
    EXPECT_FALSE(server.take_save());

    Client owner = client_of(server, "secret");
    EXPECT_TRUE(owner.status(0).commands);
    owner.command("pause");
    EXPECT_TRUE(server.paused());
    EXPECT_EQ(owner.status(0).state, State::paused);
    owner.command("resume");
    EXPECT_FALSE(server.paused());
    owner.command("save");
    EXPECT_TRUE(server.take_save());
    EXPECT_FALSE(server.take_save());
    Server open("127.0.0.1", 0, "");
    for (const char* token : {"x", "Bearer "})
        EXPECT_THROW(client_of(open, token).command("pause"), InputError) << "without a token: no commands";
    EXPECT_EQ(status_code(ask(open, "POST /pause", "Authorization: Bearer \r\n")), 401);
}

/// The answer to POST /edit with these headers and this body.
std::string ask_edit(const Server& server, const std::string& headers, const std::string& body = "") {
    const RawSocket socket(server.port());
    socket.send(std::string("POST /edit HTTP/1.1\r\n") + kHost + headers + "\r\n" + body);
    return socket.receive();
}

std::string length_of(const std::string& body) {
    return "Content-Length: " + std::to_string(body.size()) + "\r\n";
}

TEST(LiveServer, TakesEditsFromWhoHasTheToken) {
    Server server("127.0.0.1", 0, "secret");
    Editing editing(server);
    Client owner = client_of(server, "secret");
    const EditReply reply = owner.edit("{\"edits\": []}");
    EXPECT_EQ(editing.last, "{\"edits\": []}");
    EXPECT_EQ(reply.step, 7);
    EXPECT_EQ(reply.splats, 90u);
    EXPECT_EQ(reply.counts.removed, 10u);
    EXPECT_EQ(reply.counts.frozen, 3u);
    EXPECT_EQ(reply.counts.unfrozen, 1u);
    const std::string longest(kMostEdit, 'x');
    owner.edit(longest);
    EXPECT_TRUE(editing.last == longest);
    test::expect_error<InputError>([&] { owner.edit("bad"); }, {"the trainer refuses: --dance is no edit"});
    owner.command("pause");
    EXPECT_EQ(owner.edit("{}").step, 7) << "also during a pause";

    EXPECT_EQ(status_code(ask_edit(server, kToken + length_of("again"), "again")), 200);
    EXPECT_EQ(editing.last, "again");
    EXPECT_EQ(status_code(ask_edit(server, kToken + length_of("bad"), "bad")), 400);
    EXPECT_EQ(status_code(ask_edit(server, length_of("no"), "no")), 401);
    EXPECT_EQ(status_code(ask_edit(server, "Authorization: Bearer secreT\r\n" + length_of("no"), "no")), 401);
    EXPECT_EQ(
        status_code(ask_edit(server, kToken + "Origin: http://evil.example\r\n" + length_of("no"), "no")),
        403);
    EXPECT_EQ(status_code(ask(server, "GET /edit", kToken)), 404);
    server.report({.step = 10, .steps = 10, .state = State::done});
    EXPECT_EQ(status_code(ask_edit(server, kToken + length_of("no"), "no")), 409);
    EXPECT_NE(editing.last, "no");
}

TEST(LiveServer, EditsAreSmallAndWhole) {
    Server server("127.0.0.1", 0, "secret", kLease, 300ms);
    const Editing editing(server);
    for (const char* headers : {"", "Content-Length: 0\r\n", "Content-Length: x\r\n",
                                "Content-Length: -1\r\n", "Transfer-Encoding: chunked\r\n"})
        EXPECT_EQ(status_code(ask_edit(server, kToken + headers)), 411) << headers;
    for (const size_t bytes : {kMostEdit + 1, size_t(1) << 40}) {
        const std::string length = "Content-Length: " + std::to_string(bytes) + "\r\n";
        EXPECT_EQ(status_code(ask_edit(server, kToken + length)), 413) << bytes;
    }
    EXPECT_EQ(status_code(ask_edit(server, kToken + "Content-Length: 9\r\n", "half")), 408);
    EXPECT_EQ(editing.last, "");
    EXPECT_EQ(client_of(server, "secret").edit("x").step, 7) << "it still answers";
}

TEST(LiveServer, AnEditThatNobodyTakesIsWithdrawn) {
    auto server = std::make_unique<Server>("127.0.0.1", 0, "secret", kLease, kRequestPatience, 200ms);
    Client owner = client_of(*server, "secret");
    test::expect_error<InputError>([&] { owner.edit("late"); }, {"nothing was changed"});
    EXPECT_FALSE(server->perform_edits([](const std::string&) { return EditReply{}; }));

    server = std::make_unique<Server>("127.0.0.1", 0, "secret", kLease, kRequestPatience, 1h);
    Client other = client_of(*server, "secret");
    std::thread waits([&] { EXPECT_ANY_THROW(other.edit("never")); });
    std::this_thread::sleep_for(100ms);
    server.reset();  // the training ends
    waits.join();
}

/// Splats of the same step are others after an edit.
TEST(LiveServer, AnEditMakesNewSplats) {
    Server server("127.0.0.1", 0, "secret");
    Client owner = client_of(server, "secret");
    server.report(status_at(7));
    owner.splats("");
    server.offer({7, some_splats(4)}, 0);
    const auto before = owner.splats("");
    ASSERT_TRUE(before);
    EXPECT_FALSE(owner.splats(before->tag));
    {
        Editing editing(server);
        owner.edit("x");
        EXPECT_ANY_THROW(owner.edit("bad"));
    }
    EXPECT_FALSE(owner.splats(before->tag)) << "none are there yet";
    EXPECT_TRUE(soon([&] { return server.wants_splats(7); }));
    server.offer({7, some_splats(3)}, 0);
    const auto after = owner.splats(before->tag);
    ASSERT_TRUE(after);
    EXPECT_EQ(after->gaussians.size(), 3u);
    EXPECT_EQ(after->step, 7);
    EXPECT_FALSE(owner.splats(after->tag));
    EXPECT_FALSE(server.wants_splats(7));
}

TEST(LiveServer, APauseEndsSomeTimeAfterItsOwnerHasGone) {
    Server server("127.0.0.1", 0, "secret", 300ms);
    server.offer(large(1), 0);
    Client owner = client_of(server, "secret"), stranger = client_of(server);
    owner.command("pause");
    EXPECT_TRUE(server.paused());
    const auto start = std::chrono::steady_clock::now();
    while (std::chrono::steady_clock::now() - start < 1s) {
        owner.status(0);
        EXPECT_TRUE(server.paused()) << "the owner is there";
    }
    {
        const RawSocket reads(server.port(), true);  // slowly
        reads.send(std::string("GET /splats HTTP/1.1\r\n") + kHost + kToken + "\r\n");
        reads.receive(1);
        const auto from = std::chrono::steady_clock::now();
        while (std::chrono::steady_clock::now() - from < 1s) EXPECT_TRUE(server.paused()) << "it still reads";
    }
    EXPECT_TRUE(soon([&] {
        stranger.status(0);  // which does not keep the pause
        return !server.paused();
    }));
}

TEST(LiveServer, WebPagesAreRefused) {
    Server server("127.0.0.1", 0, "secret");
    const auto with_host = [&](const std::string& hosts) {
        const RawSocket socket(server.port());
        socket.send("GET /status HTTP/1.1\r\n" + hosts + "\r\n");
        return status_code(socket.receive());
    };
    for (const char* host : {"127.0.0.1", "127.0.0.1:7000", "localhost", "LocalHost:80", "[::1]",
                             "[::1]:7000", "192.168.1.7:7000", "[fe80::1]:1"})
        EXPECT_EQ(with_host("Host: " + std::string(host) + "\r\n"), 200) << host;
    for (const char* host :
         {"evil.example", "evil.example:7000", "127.0.0.1.evil.example", "localhost.evil.example",
          "localhost.", "", "[::1", "[evil.example]", "0x7f.1", "@127.0.0.1", "127.0.0.1 x",
          "[::1].evil.example", "[::1]:7000.evil.example", "127.0.0.1:7000.evil.example", "[::1]x"})
        EXPECT_EQ(with_host("Host: " + std::string(host) + "\r\n"), 403) << host;
    EXPECT_EQ(with_host(""), 403) << "no Host at all";
    EXPECT_EQ(with_host("Host: localhost\r\nHost: evil.example\r\n"), 403);

    for (const char* origin : {"http://evil.example", "http://127.0.0.1:8080", "null"}) {
        const std::string header = "Origin: " + std::string(origin) + "\r\n";
        EXPECT_EQ(status_code(ask(server, "GET /status", header)), 403) << origin;
        EXPECT_EQ(status_code(ask(server, "POST /pause", header + kToken)), 403) << origin;
    }
    for (const char* site : {"cross-site", "same-site"})  // a picture's address: no Origin comes with it
        EXPECT_EQ(status_code(ask(server, "GET /splats", "Sec-Fetch-Site: " + std::string(site) + "\r\n")),
                  403);
    EXPECT_EQ(status_code(ask(server, "GET /status", "Sec-Fetch-Site: none\r\n")), 200)
        << "typed by the user";
    EXPECT_FALSE(server.wants_splats(0)) << "a refused request made the trainer work";
    EXPECT_FALSE(server.paused());
    EXPECT_EQ(ask(server, "GET /status").find("Access-Control"), std::string::npos);
}

TEST(LiveServer, RequestsAreSmall) {
    Server server("127.0.0.1", 0, "secret");
    server.offer({1, some_splats(50)}, 0);
    const auto refused = [&](const std::string& bytes) {
        const RawSocket socket(server.port());
        socket.send(bytes);
        const int code = status_code(socket.receive(64));
        EXPECT_TRUE(code == 0 || code >= 400) << code << " for " << bytes.substr(0, 60);
    };
    const std::string start = std::string("GET /status HTTP/1.1\r\n") + kHost;
    refused(std::string(100000, 'x'));
    refused("GET /" + std::string(100000, 'x') + " HTTP/1.1\r\n\r\n");
    refused(start + "X: " + std::string(100000, 'x') + "\r\n\r\n");
    std::string many = start;
    for (int i = 0; i < 10000; ++i) many += "X" + std::to_string(i) + ": y\r\n";
    refused(many + "\r\n");
    std::string ranges = "Range: bytes=";
    for (int i = 0; i < 1000; ++i) ranges += "0-,";
    // The longest that fit: nothing is multiplied, nor a stack filled.
    EXPECT_LT(ask(server, "GET /splats", ranges + "0-\r\n").size(), 20000u);
    EXPECT_LT(ask(server, "GET /splats", "Range: bytes=" + std::string(3900, '1') + "-\r\n").size(), 20000u);

    for (const char* body :
         {"Content-Length: 5\r\n", "Content-Length: 99999999999\r\n", "Content-Length: x\r\n",
          "Content-Length: -1\r\n", "Transfer-Encoding: chunked\r\n"}) {
        EXPECT_EQ(status_code(ask(server, "POST /pause", kToken + body)), 413) << body;
        EXPECT_EQ(status_code(ask(server, "GET /status", body)), 413) << body;
    }
    EXPECT_FALSE(server.paused());
    EXPECT_EQ(status_code(ask(server, "POST /pause", kToken + "Content-Length: 0\r\n")), 200);
    EXPECT_EQ(status_code(ask(server, "POST /resume", kToken)), 200) << "without a length: without a body";
    for (const char* request : {"", "GET", "GET /nothing", "PUT /status", "DELETE /splats", "POST /status",
                                "GET /status?metrics=-1", "GET /status?metrics=x", "GET /../etc/passwd"})
        EXPECT_GE(status_code(ask(server, request)), 400) << request;
    EXPECT_EQ(client_of(server).status(0).step, 0) << "it still answers";
}

/// 100 that say nothing, and some that never end what they say, take no place from who asks.
TEST(LiveServer, IdleConnectionsGiveWay) {
    Server server("127.0.0.1", 0, "secret", kLease, 1h);
    std::vector<RawSocket> crowd;
    for (int i = 0; i < 100; ++i) {
        crowd.emplace_back(server.port());
        if (i % 2 == 0) crowd.back().send("GET /status HTTP/1.1\r\nHost: local");
    }
    Client owner = client_of(server, "secret"), stranger = client_of(server);
    EXPECT_TRUE(owner.status(0).commands);
    owner.command("pause");
    EXPECT_TRUE(server.paused());
    EXPECT_EQ(stranger.status(0).state, State::paused);
    EXPECT_NO_THROW(crowd.front().receive()) << "its connection does not end";
}

TEST(LiveServer, SlowRequestsAreCut) {
    Server server("127.0.0.1", 0, "secret");
    const RawSocket slow(server.port());
    constexpr int kBytes = 3000;  // each comes in time, all would take a minute
    int sent = 0;
    while (sent < kBytes && slow.send("x") && !slow.ended()) {
        ++sent;
        std::this_thread::sleep_for(20ms);
    }
    EXPECT_LT(sent, kBytes);
}

/// Readers without the token that stop reading: they take the strangers' places and one set of splats.
TEST(LiveServer, StrangersCannotShutOutTheOwner) {
    Server server("127.0.0.1", 0, "secret");
    server.report(status_at(1));
    server.offer(large(1), 0);
    std::vector<RawSocket> readers;
    const auto read_slowly = [&] {
        readers.emplace_back(server.port(), true);
        readers.back().send(std::string("GET /splats HTTP/1.1\r\n") + kHost + "\r\n");
        return readers.back().receive(400);
    };
    for (size_t i = 0; i + 1 < kMostStrangers; ++i) EXPECT_EQ(status_code(read_slowly()), 200);
    server.offer(large(2), 0);
    EXPECT_NE(read_slowly().find("Ewa-Step: 1\r\n"), std::string::npos)
        << "a second set is kept for strangers";
    try {
        client_of(server).status(0);
        ADD_FAILURE() << "a place too many";
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("too many"), std::string::npos) << error.what();
    }
    EXPECT_EQ(status_code(ask(server, "GET /status", "Authorization: Bearer secreT\r\n")), 401);
    Client owner = client_of(server, "secret");
    for (int i = 0; i < 3; ++i) {
        EXPECT_TRUE(owner.status(0).commands);
        owner.command(i % 2 ? "resume" : "pause");
        EXPECT_EQ(server.paused(), i % 2 == 0);
        EXPECT_EQ(owner.splats("")->step, 2);
    }
    for (const RawSocket& reader : readers) EXPECT_FALSE(reader.ended());
    readers.clear();
    EXPECT_TRUE(soon([&] { return status_code(ask(server, "GET /status")) == 200; })) << "places come back";
    EXPECT_TRUE(soon([&] { return client_of(server).splats("")->step == 2; }));
}

TEST(LiveServer, EndsWhileSomebodyReads) {
    auto server = std::make_unique<Server>("127.0.0.1", 0, "secret");
    server->offer(large(1), 0);
    Client client = client_of(*server);
    EXPECT_EQ(client.status(0).step, 0);
    const RawSocket idle(server->port()), reads(server->port(), true);
    reads.send(std::string("GET /splats HTTP/1.1\r\n") + kHost + "\r\n");
    reads.receive(1);
    const RawSocket waits(server->port());  // for splats of a step that does not come
    server->report(status_at(9));
    waits.send(std::string("GET /splats HTTP/1.1\r\n") + kHost + "\r\n");
    server.reset();
    EXPECT_TRUE(soon([&] { return idle.ended(); }));
    EXPECT_THROW(client.status(0), RunError);
}

TEST(LiveServer, LeavesSigpipeAndTakesAPortForItself) {
    std::signal(SIGPIPE, SIG_DFL);
    const Server server("127.0.0.1", 0, "");
    EXPECT_EQ(std::signal(SIGPIPE, SIG_DFL), SIG_DFL);
    test::expect_error<RunError>([&] { Server("127.0.0.1", server.port(), ""); },
                                 {"cannot listen on 127.0.0.1:", "in use"});
    test::expect_error<RunError>([] { Server("no.such.address.invalid", 0, ""); },
                                 {"no.such.address.invalid"});
}

std::string output_of(const std::string& command) {
    std::string text;
    FILE* pipe = popen(command.c_str(), "r");
    for (int c = 0; (c = std::fgetc(pipe)) != EOF;) text += char(c);
    return text + "status " + std::to_string(WEXITSTATUS(pclose(pipe)));
}

TEST(LiveServer, CurlWorks) {
    if (std::system("command -v curl > /dev/null 2>&1") != 0) GTEST_SKIP() << "there is no curl here";
    Server server("127.0.0.1", 0, "secret");
    server.report(status_at(3));
    server.offer({3, some_splats(6)}, 0);
    const std::string at = "http://127.0.0.1:" + std::to_string(server.port());
    const std::string curl = "curl --silent --show-error --noproxy '*' --max-time 60 ";
    const std::string status = output_of(curl + at + "/status");
    EXPECT_NE(status.find("\"step\":3"), std::string::npos) << status;
    const std::string token = "-H 'Authorization: Bearer secret' ";
    EXPECT_EQ(output_of(curl + token + "-X POST " + at + "/pause"), "done\nstatus 0");
    EXPECT_TRUE(server.paused());
    EXPECT_EQ(output_of(curl + token + "-d '' " + at + "/resume"), "done\nstatus 0");
    EXPECT_FALSE(server.paused());
    const test::TempFolder folder;
    const std::string file = (folder.path() / "now.ply").string();
    EXPECT_EQ(output_of(curl + "--compressed -o " + file + " " + at + "/splats"), "status 0");
    EXPECT_EQ(load_splats(file).size(), 6u);
    EXPECT_NE(output_of(curl + "-X POST " + at + "/pause").find("needs the token"), std::string::npos);
    EXPECT_EQ(output_of(curl + "--fail -X POST " + at + "/save 2> /dev/null"), "status 22");
}

}  // namespace
}  // namespace ewa::live
