// SPDX-License-Identifier: Apache-2.0
// The module that src/ranks/open.cpp loads: Ranks by MPI. All messages go from rank to rank, so that a rank that
// does not answer is known by its number.
#include <mpi.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>

#include "ewa/error.h"
#include "mpi/pause.h"
#include "platform/exported.h"
#include "ranks/plugin.h"

namespace {

using ewa::RunError;
using ewa::ranks::MpiOptions;

constexpr int kTag = 1;

/// Throws RunError unless the code is a success.
void check(int code, const std::string& action) {
    if (code == MPI_SUCCESS) return;
    char text[MPI_MAX_ERROR_STRING] = "";
    int length = 0;
    MPI_Error_string(code, text, &length);
    throw RunError("MPI cannot " + action + ": " + text);
}

/// Ends the process with an error if it lives longer than the timeout: MPI_Init waits without a limit for a process that
/// ended before it joined.
class StartLimit {
  public:
    explicit StartLimit(std::chrono::milliseconds timeout)
        : thread_([this, timeout](const std::stop_token& done) {
              std::unique_lock lock(mutex_);
              if (condition_.wait_for(lock, done, timeout, [&] { return done.stop_requested(); })) return;
              std::fprintf(
                  stderr,
                  "ewa: MPI has not started after %lld s (--rank-timeout): another process may have ended "
                  "before it joined\n",
                  static_cast<long long>(std::chrono::ceil<std::chrono::seconds>(timeout).count()));
              std::fflush(nullptr);
              std::_Exit(1);
          }) {}

  private:
    std::mutex mutex_;
    std::condition_variable_any condition_;
    std::jthread thread_;
};

/// What each rank tells of itself at the start.
struct Card {
    char node[MPI_MAX_PROCESSOR_NAME + 1] = "";
    char version[32] = "";
};

struct Message {
    int peer;
    size_t bytes;
    bool incoming;
    bool first = false;  // the first one from a rank: it has come to this gather or exchange
};

/// The messages of one gather or exchange. Bytes must stay where they are until all have arrived.
struct Messages {
    std::vector<MPI_Request> requests = {};
    std::vector<Message> each = {};  // of the requests
    size_t awaited = 0;              // ranks whose first message has not arrived
};

class MpiRanks final : public ewa::Ranks {
  public:
    explicit MpiRanks(const MpiOptions& options);
    ~MpiRanks() override;
    MpiRanks(const MpiRanks&) = delete;
    MpiRanks& operator=(const MpiRanks&) = delete;

    int rank() const override { return rank_; }
    int size() const override { return size_; }
    std::string name(int rank) const override {
        return "rank " + std::to_string(rank) + " (" + nodes_.at(size_t(rank)) + ")";
    }
    std::vector<uint64_t> gather(std::span<const uint64_t> own) override;
    void exchange(std::span<const std::span<const std::byte>> out,
                  std::span<const std::span<std::byte>> in) override;
    void end_all(int status) override;

  private:
    void enter(const MpiOptions& options);
    void introduce();
    void gather_bytes(std::span<const std::byte> own, std::span<std::byte> all);
    void receive(int peer, std::span<std::byte> piece, Messages& messages, bool first) const;
    void send(int peer, std::span<const std::byte> piece, Messages& messages) const;
    void wait(Messages& messages);
    size_t take_arrived(Messages& messages);
    [[noreturn]] void tell_missing(const Messages& messages) const;

    MPI_Comm world_ = MPI_COMM_NULL;
    bool entered_ = false;  // by this class, which then also leaves
    bool failed_ = false;   // messages may be on their way
    bool crowded_ = true;   // more ranks than cores on this machine
    int rank_ = 0, size_ = 1;
    std::chrono::milliseconds timeout_;
    size_t message_bytes_;
    std::vector<std::string> nodes_;
    // The last messages' arrivals. Their memory is used again.
    std::vector<int> arrived_;
    std::vector<MPI_Status> statuses_;
};

MpiRanks::MpiRanks(const MpiOptions& options)
    : timeout_(options.timeout), message_bytes_(options.message_bytes) {
    enter(options);
    introduce();
}

void MpiRanks::enter(const MpiOptions& options) {
    int has_begun = 0, has_ended = 0, level = 0;
    check(MPI_Initialized(&has_begun), "start");
    check(MPI_Finalized(&has_ended), "start");
    if (has_ended) throw RunError("this process has left MPI; it cannot train with other processes again");
    if (!has_begun) {
        // Open MPI's other way of sending over TCP uses one direction of the network at a time. The user's choice goes before.
        setenv("OMPI_MCA_btl_tcp_flags", "1", 0);
        std::optional<StartLimit> limit;
        if (options.start.count() > 0) limit.emplace(options.start);
        check(MPI_Init_thread(nullptr, nullptr, MPI_THREAD_SERIALIZED, &level), "start");
        entered_ = true;
    }
    check(MPI_Comm_dup(MPI_COMM_WORLD, &world_), "start");
    MPI_Comm_set_errhandler(world_, MPI_ERRORS_RETURN);
    check(MPI_Comm_rank(world_, &rank_), "number the processes");
    check(MPI_Comm_size(world_, &size_), "count the processes");
    if (options.size > 0 && options.size != size_) {
        char library[MPI_MAX_LIBRARY_VERSION_STRING] = "";
        int length = 0;
        MPI_Get_library_version(library, &length);
        std::string known = library;
        known.resize(std::min(known.size(), known.find(',')));
        throw RunError("the launcher started " + std::to_string(options.size) + " processes, and MPI knows " +
                       std::to_string(size_) + " of them: ewa's module is built with " + known +
                       "; start ewa by its mpirun, or by srun --mpi=pmix");
    }
}

/// Learns the names of the nodes. Versions of ewa could understand each other's bytes wrongly.
void MpiRanks::introduce() {
    Card own;
    int length = 0;
    check(MPI_Get_processor_name(own.node, &length), "name this node");
    std::strncpy(own.version, EWA_VERSION, sizeof own.version - 1);
    nodes_.assign(size_t(size_), "?");
    std::vector<Card> all{size_t(size_)};
    gather_bytes(std::as_bytes(std::span(&own, 1)), std::as_writable_bytes(std::span(all)));
    for (size_t i = 0; i < all.size(); ++i) nodes_[i] = all[i].node;
    crowded_ = std::ranges::count(nodes_, nodes_[size_t(rank_)]) > sysconf(_SC_NPROCESSORS_ONLN);
    for (size_t i = 0; i < all.size(); ++i)
        if (std::strcmp(all[i].version, EWA_VERSION) != 0)
            throw RunError(name(int(i)) + " runs ewa " + all[i].version + ", and " + name(rank_) +
                           " ewa " EWA_VERSION);
}

MpiRanks::~MpiRanks() {
    if (entered_ && !failed_ && std::uncaught_exceptions() == 0) MPI_Finalize();
}

void MpiRanks::receive(int peer, std::span<std::byte> piece, Messages& messages, bool first) const {
    MPI_Request request = MPI_REQUEST_NULL;
    check(MPI_Irecv(piece.data(), int(piece.size()), MPI_BYTE, peer, kTag, world_, &request),
          "receive from " + name(peer));
    messages.requests.push_back(request);
    messages.each.push_back({peer, piece.size(), true, first});
    messages.awaited += first;
}

void MpiRanks::send(int peer, std::span<const std::byte> piece, Messages& messages) const {
    MPI_Request request = MPI_REQUEST_NULL;
    check(MPI_Isend(piece.data(), int(piece.size()), MPI_BYTE, peer, kTag, world_, &request),
          "send to " + name(peer));
    messages.requests.push_back(request);
    messages.each.push_back({peer, piece.size(), false});
}

/// The number of messages that have come or gone since the last call. SIZE_MAX: none was left.
size_t MpiRanks::take_arrived(Messages& messages) {
    const int count = int(messages.requests.size());
    arrived_.resize(size_t(count));
    statuses_.resize(size_t(count));
    int done = 0;
    const int code = MPI_Testsome(count, messages.requests.data(), &done, arrived_.data(), statuses_.data());
    if (code != MPI_SUCCESS && code != MPI_ERR_IN_STATUS) check(code, "exchange data");
    if (done == MPI_UNDEFINED) return SIZE_MAX;
    for (size_t i = 0; i < size_t(done); ++i) {
        const Message& one = messages.each[size_t(arrived_[i])];
        if (code == MPI_ERR_IN_STATUS)
            check(statuses_[i].MPI_ERROR, (one.incoming ? "receive from " : "send to ") + name(one.peer));
        if (!one.incoming) continue;
        int bytes = 0;
        MPI_Get_count(&statuses_[i], MPI_BYTE, &bytes);
        if (size_t(bytes) != one.bytes)
            throw RunError(name(one.peer) + " sent " + std::to_string(bytes) + " bytes in place of " +
                           std::to_string(one.bytes));
        messages.awaited -= one.first;
    }
    return size_t(done);
}

void MpiRanks::wait(Messages& messages) {
    // All ranks may wait for the same one. The first of them tells of it, and ends the others meanwhile.
    const auto patience = timeout_ + std::chrono::milliseconds(100) * std::min(rank_, 20);
    for (ewa::mpi::Pause pause(crowded_); true;) {
        const size_t arrived = take_arrived(messages);
        if (arrived == SIZE_MAX) return;
        if (arrived > 0)
            pause = ewa::mpi::Pause(crowded_);
        else if (pause.waited() > patience)
            tell_missing(messages);
        else
            pause.wait(messages.awaited == 0);
    }
}

void MpiRanks::tell_missing(const Messages& messages) const {
    std::vector<int> missing;
    for (size_t i = 0; i < messages.requests.size(); ++i)
        if (messages.requests[i] != MPI_REQUEST_NULL) missing.push_back(messages.each[i].peer);
    std::ranges::sort(missing);
    missing.erase(std::unique(missing.begin(), missing.end()), missing.end());
    constexpr size_t kNamed = 4;
    std::string text;
    for (size_t i = 0; i < std::min(missing.size(), kNamed); ++i)
        text += (i > 0 ? ", " : "") + name(missing[i]);
    if (missing.size() > kNamed) text += " and " + std::to_string(missing.size() - kNamed) + " more";
    const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(timeout_).count();
    throw RunError(text + (missing.size() == 1 ? " has" : " have") + " not answered for " +
                   std::to_string(seconds) + " s");
}

void MpiRanks::gather_bytes(std::span<const std::byte> own, std::span<std::byte> all) {
    failed_ = true;  // until it has succeeded
    Messages messages;
    for (int peer = 0; peer < size_; ++peer)
        if (peer != rank_) receive(peer, all.subspan(size_t(peer) * own.size(), own.size()), messages, true);
    std::ranges::copy(own, all.subspan(size_t(rank_) * own.size()).begin());
    // Each begins with its neighbour: not all ranks send to the same one at once.
    for (int step = 1; step < size_; ++step) send((rank_ + step) % size_, own, messages);
    wait(messages);
    failed_ = false;
}

std::vector<uint64_t> MpiRanks::gather(std::span<const uint64_t> own) {
    std::vector<uint64_t> all(own.size() * size_t(size_));
    gather_bytes(std::as_bytes(own), std::as_writable_bytes(std::span(all)));
    return all;
}

void MpiRanks::exchange(std::span<const std::span<const std::byte>> out,
                        std::span<const std::span<std::byte>> in) {
    failed_ = true;  // until it has succeeded
    Messages messages;
    // Ranks that have something for each other greet each other first, by an empty message.
    for (int step = 1; step < size_; ++step) {
        const size_t peer = size_t((rank_ + size_ - step) % size_);
        if (in[peer].empty() && out[peer].empty()) continue;
        receive(int(peer), {}, messages, true);
        for (size_t at = 0; at < in[peer].size(); at += message_bytes_)
            receive(int(peer), in[peer].subspan(at, std::min(message_bytes_, in[peer].size() - at)), messages,
                    false);
    }
    for (int step = 1; step < size_; ++step) {
        const size_t peer = size_t((rank_ + step) % size_);
        if (in[peer].empty() && out[peer].empty()) continue;
        send(int(peer), {}, messages);
        for (size_t at = 0; at < out[peer].size(); at += message_bytes_)
            send(int(peer), out[peer].subspan(at, std::min(message_bytes_, out[peer].size() - at)), messages);
    }
    const auto own = out[size_t(rank_)];
    if (!own.empty()) std::memmove(in[size_t(rank_)].data(), own.data(), own.size());
    wait(messages);
    failed_ = false;
}

void MpiRanks::end_all(int status) {
    std::fflush(nullptr);
    MPI_Abort(world_, status);
    std::_Exit(status);
}

std::shared_ptr<ewa::Ranks> open(const MpiOptions& options) {
    return std::make_shared<MpiRanks>(options);
}

}  // namespace

extern "C" EWA_EXPORTED const ewa::ranks::Mpi ewa_mpi_layout_2;
const ewa::ranks::Mpi ewa_mpi_layout_2 = {EWA_VERSION, open};
