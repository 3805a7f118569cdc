// SPDX-License-Identifier: Apache-2.0
// One rank of the tests in test_mpi.cpp, which start it by mpirun: worker WHAT [MESSAGE_BYTES [TIMEOUT_MS]].
#include <signal.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <thread>

#include "ewa/error.h"
#include "ranks/open.h"
#include "ranks/plugin.h"

namespace {

using namespace ewa;

[[noreturn]] void fail(const std::string& reason) {
    throw std::logic_error(reason);
}

void expect(bool holds, const char* text) {
    if (!holds) fail(text);
}
#define EXPECT(condition) expect(condition, #condition)

void meet(Ranks& ranks) {
    const uint64_t one[] = {1};
    ranks.gather(one);
}

void gather(Ranks& ranks) {
    const uint64_t me = uint64_t(ranks.rank()), size = uint64_t(ranks.size());
    EXPECT(ranks.gather({}).empty());
    for (uint64_t round = 0; round < 100; ++round) {
        const uint64_t own[] = {me, me * me + round, UINT64_MAX - me};
        const auto all = ranks.gather(own);
        EXPECT(all.size() == 3 * size);
        for (uint64_t r = 0; r < size; ++r)
            EXPECT(all[3 * r] == r && all[3 * r + 1] == r * r + round && all[3 * r + 2] == UINT64_MAX - r);
    }
}

/// Bytes from one rank to another: some parts are empty, others of odd sizes.
std::vector<std::byte> part(int from, int to, int round) {
    const int length = (from + 2 * to + round) % 4 == 0 ? 0 : 1 + 997 * from + 101 * to + 7 * round;
    std::vector<std::byte> bytes;
    for (int i = 0; i < length; ++i) bytes.push_back(std::byte(i * 31 + from * 7 + to * 3 + round));
    return bytes;
}

void exchange(Ranks& ranks) {
    const int me = ranks.rank(), size = ranks.size();
    for (int round = 0; round < 20; ++round) {
        std::vector<std::vector<std::byte>> sent, received;
        for (int r = 0; r < size; ++r) {
            sent.push_back(part(me, r, round));
            received.emplace_back(part(r, me, round).size());
        }
        const std::vector<std::span<const std::byte>> out(sent.begin(), sent.end());
        const std::vector<std::span<std::byte>> in(received.begin(), received.end());
        ranks.exchange(out, in);
        for (int r = 0; r < size; ++r) EXPECT(received[size_t(r)] == part(r, me, round));
    }
    // Nothing at all, and to the next rank alone.
    const std::vector<std::span<const std::byte>> no_out{size_t(size)};
    const std::vector<std::span<std::byte>> no_in{size_t(size)};
    ranks.exchange(no_out, no_in);
    const std::byte mine{std::byte(me)};
    std::byte theirs{255};
    auto out = no_out;
    auto in = no_in;
    out[size_t((me + 1) % size)] = std::span(&mine, 1);
    in[size_t((me + size - 1) % size)] = std::span(&theirs, 1);
    ranks.exchange(out, in);
    EXPECT(theirs == std::byte((me + size - 1) % size));
}

void uneven(Ranks& ranks) {
    const std::vector<std::byte> sent(8);
    std::vector<std::byte> received(ranks.rank() == 0 ? 16 : 8);
    std::vector<std::span<const std::byte>> out(2, sent);
    std::vector<std::span<std::byte>> in(2, received);
    out[size_t(ranks.rank())] = {}, in[size_t(ranks.rank())] = {};
    ranks.exchange(out, in);
    meet(ranks);
}

/// All but rank 1 wait for it.
void fall_silent(Ranks& ranks, int signal) {
    meet(ranks);
    if (ranks.rank() == 1) raise(signal);
    meet(ranks);
}

void run(const std::string& what, Ranks& ranks) {
    if (what == "talk") return gather(ranks), exchange(ranks);
    if (what == "uneven") return uneven(ranks);
    if (what == "kill") return fall_silent(ranks, SIGKILL);
    if (what == "stop") return fall_silent(ranks, SIGSTOP);
    if (what == "throw") {
        if (ranks.rank() == 1) throw InputError("rank 1 has other images");
        meet(ranks);
    }
    if (what == "end") {
        if (ranks.rank() == 1) {
            std::fputs("told before the end", stderr);
            ranks.end_all(3);
        }
        meet(ranks);
    }
    if (what == "name") std::printf("%s of %d\n", ranks.name(ranks.rank()).c_str(), ranks.size());
}

}  // namespace

int main(int argc, char** argv) {
    const std::string what = argc > 1 ? argv[1] : "";
    try {
        ranks::MpiOptions options{.timeout =
                                      std::chrono::milliseconds(argc > 3 ? std::atoi(argv[3]) : 60000)};
        if (argc > 2) options.message_bytes = size_t(std::atol(argv[2]));
        const auto ranks = argc > 2 ? ranks::open_mpi(options) : open_ranks(options.timeout);
        run(what, *ranks);
        return 0;
    } catch (const RunError& error) {
        std::fprintf(stderr, "RunError: %s\n", error.what());
        return 1;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 2;
    }
}
