// SPDX-License-Identifier: Apache-2.0
#include "train/chunks.h"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>

#include "ewa/error.h"

namespace ewa::train {

gpu::Buffer& Chunks::Chunk::buffer(size_t array) {
    const std::array<gpu::Buffer*, arrays> all{&model.params, &model.moments1, &model.moments2,
                                               &model.statistics, &places};
    return *all[array];
}

Chunks::Chunks(gpu::Device& device, int count, uint64_t limit) : device_(device), chunks_(size_t(count)) {
    device.limit_memory(limit, [this] { return evict(); });
}

Chunks::~Chunks() {
    // What remains on the device, such as an evaluation, keeps the limit.
    device_.make_room_with({});
}

uint32_t Chunks::largest() const {
    uint32_t most = 0;
    for (const Chunk& chunk : chunks_) most = std::max(most, chunk.model.splats);
    return most;
}

Chunks::Present Chunks::present(int chunk) {
    Present result{};
    for (size_t array = 0; array < arrays; ++array)
        result[array] = bool(chunks_[size_t(chunk)].buffer(array));
    return result;
}

void Chunks::bring(int index, const Present& wanted) {
    in_use_ = index;
    Chunk& chunk = chunks_[size_t(index)];
    for (size_t array = 0; array < arrays; ++array) {
        Kept& kept = chunk.kept[array];
        gpu::Buffer& buffer = chunk.buffer(array);
        if (!wanted[array] || buffer || kept.bytes.empty()) continue;
        gpu::Buffer brought(device_, kept.name, kept.bytes.size(), kept.texel);
        stream(kept.bytes.size(), [&] { brought.upload(std::span<const std::byte>(kept.bytes)); });
        buffer = std::move(brought);
        kept.same_as = buffer.serial();
    }
}

void Chunks::copy_to_host(Chunk& chunk, size_t array) {
    Kept& kept = chunk.kept[array];
    const gpu::Buffer& buffer = chunk.buffer(array);
    if (!buffer || kept.same_as == buffer.serial()) return;
    kept.name = buffer.name();
    kept.texel = buffer.texel();
    kept.bytes.resize(buffer.bytes());
    stream(kept.bytes.size(), [&] { buffer.download(std::span<std::byte>(kept.bytes)); });
    kept.same_as = buffer.serial();
}

/// How many chunks are used before this array is needed again. The visit after this one goes the other way, and visits
/// that need parameters alone take turns with those that need the state.
int Chunks::visits_until(int chunk, size_t array) const {
    const int last = count() - 1;
    const int at = in_use_ < 0 ? -1 : forwards_ ? in_use_ : last - in_use_;
    const int place = forwards_ ? chunk : last - chunk;
    const bool state = array != params;
    if (place > at && !(state && need_ == Need::params)) return place - at;
    const int next_visit = (last - at) + (last - place) + 1;
    return state && need_ == Need::state ? next_visit + count() : next_visit;
}

/// Frees the array of another chunk that is not needed for longest. False if there is none.
bool Chunks::evict() {
    if (std::exchange(evicting_, true)) return false;  // the copy to the host asks for room itself
    int most = -1;
    std::pair<size_t, size_t> found;
    for (size_t c = 0; c < chunks_.size(); ++c)
        for (size_t array = 0; int(c) != in_use_ && array < arrays; ++array)
            if (chunks_[c].buffer(array) && visits_until(int(c), array) > most) {
                most = visits_until(int(c), array);
                found = {c, array};
            }
    if (most >= 0) {
        Chunk& chunk = chunks_[found.first];
        copy_to_host(chunk, found.second);
        chunk.buffer(found.second) = gpu::Buffer();
    }
    evicting_ = false;
    return most >= 0;
}

void Chunks::set(int index, pipeline::Model model) {
    in_use_ = index;
    Chunk& chunk = chunks_[size_t(index)];
    chunk = {};
    chunk.model = std::move(model);
}

void Chunks::give(int chunk, Array array, gpu::Texel texel, std::span<const std::byte> bytes) {
    constexpr std::array kNames{"params", "moments1", "moments2", "statistics"};
    chunks_[size_t(chunk)].kept[array] = {kNames[array], texel, {bytes.begin(), bytes.end()}, 0};
}

pipeline::Model& Chunks::use(int chunk, Need need) {
    const bool state = need == Need::state;
    bring(chunk, {true, state, state, state, state});
    return chunks_[size_t(chunk)].model;
}

void Chunks::changed() {
    for (Kept& kept : chunks_[size_t(in_use_)].kept) kept.same_as = 0;
}

gpu::Buffer Chunks::take_places() {
    Chunk& chunk = chunks_[size_t(in_use_)];
    chunk.kept[Array::places] = {};
    return std::move(chunk.places);
}

void Chunks::keep_places(gpu::Buffer listed) {
    Chunk& chunk = chunks_[size_t(in_use_)];
    chunk.places = std::move(listed);
    chunk.kept[Array::places] = {};
}

void Chunks::visit(Need need, const std::function<void(int, pipeline::Model&)>& visit) {
    need_ = need;
    for (int i = 0; i < count(); ++i) {
        const int chunk = forwards_ ? i : count() - 1 - i;
        visit(chunk, use(chunk, need));
    }
    in_use_ = -1;
    forwards_ = !forwards_;
}

/// Where the chunks of Chunks::together wait for each other. One thread has the turn.
struct Chunks::Meeting {
    explicit Meeting(Chunks& all)
        : chunks(all), words(size_t(all.count())), out(words.size()), in(words.size()) {}

    Chunks& chunks;
    std::mutex mutex;
    std::condition_variable changed;
    int turn = -1;  // the chunk that works
    int arrived = 0;
    bool failed = false;
    std::exception_ptr error;
    std::vector<std::vector<uint64_t>> words;
    std::vector<uint64_t> gathered;
    std::vector<std::span<const std::span<const std::byte>>> out;
    std::vector<std::span<const std::span<std::byte>>> in;

    int first() const { return chunks.forwards_ ? 0 : chunks.count() - 1; }
    void begin() {
        const std::lock_guard lock(mutex);
        turn = first();
        changed.notify_all();
    }
    void wait_for_turn(int chunk) {
        std::unique_lock lock(mutex);
        changed.wait(lock, [&] { return turn == chunk || failed; });
        if (failed) throw std::runtime_error("another chunk failed");
    }
    /// The chunk has come to where all meet, or to its end. meet: done by the last one.
    template <class Meet>
    void arrive(int chunk, Meet meet) {
        const std::lock_guard lock(mutex);
        if (++arrived == chunks.count()) {
            arrived = 0;
            meet();
            chunks.forwards_ = !chunks.forwards_;
            turn = first();
        } else {
            turn = chunk + (chunks.forwards_ ? 1 : -1);
        }
        changed.notify_all();
    }
    void fail(std::exception_ptr what) {
        const std::lock_guard lock(mutex);
        if (!failed) error = std::move(what);
        failed = true;
        changed.notify_all();
    }
};

/// A chunk as a rank among others. What it has on the device is there again when its turn comes back.
class Chunks::Member : public Ranks {
  public:
    Member(Meeting& meeting, int chunk) : meeting_(meeting), chunk_(chunk) {}
    int rank() const override { return chunk_; }
    int size() const override { return meeting_.chunks.count(); }
    std::string name(int rank) const override { return "chunk " + std::to_string(rank); }

    std::vector<uint64_t> gather(std::span<const uint64_t> own) override {
        meeting_.words[size_t(chunk_)].assign(own.begin(), own.end());
        meet([this] {
            meeting_.gathered.clear();
            for (const auto& words : meeting_.words)
                meeting_.gathered.insert(meeting_.gathered.end(), words.begin(), words.end());
        });
        return meeting_.gathered;
    }
    void exchange(std::span<const std::span<const std::byte>> out,
                  std::span<const std::span<std::byte>> in) override {
        meeting_.out[size_t(chunk_)] = out;
        meeting_.in[size_t(chunk_)] = in;
        meet([this] {
            for (size_t to = 0; to < meeting_.in.size(); ++to)
                for (size_t from = 0; from < meeting_.out.size(); ++from)
                    std::ranges::copy(meeting_.out[from][to], meeting_.in[to][from].begin());
        });
    }
    [[noreturn]] void end_all(int) override { throw std::logic_error("chunks do not end one by one"); }

  private:
    template <class Meet>
    void meet(Meet what) {
        const Present had = meeting_.chunks.present(chunk_);
        meeting_.arrive(chunk_, what);
        meeting_.wait_for_turn(chunk_);
        meeting_.chunks.bring(chunk_, had);
    }
    Meeting& meeting_;
    int chunk_;
};

void Chunks::together(const std::function<void(pipeline::Model&)>& work) {
    need_ = Need::state;
    Meeting meeting(*this);
    const auto take_part = [&](int chunk) {
        try {
            meeting.wait_for_turn(chunk);
            pipeline::Model& model = use(chunk, Need::state);
            model.share.ranks = std::make_shared<Member>(meeting, chunk);
            work(model);
            meeting.arrive(chunk, [] {});
        } catch (...) {
            meeting.fail(std::current_exception());
        }
        chunks_[size_t(chunk)].model.share.ranks = alone();
    };
    std::vector<std::thread> threads;
    try {
        for (int chunk = 0; chunk < count(); ++chunk) threads.emplace_back(take_part, chunk);
        meeting.begin();
    } catch (const std::system_error& error) {
        meeting.fail(
            std::make_exception_ptr(RunError(std::string("no thread for a chunk: ") + error.what())));
    }
    for (std::thread& thread : threads) thread.join();
    in_use_ = -1;
    if (meeting.error) std::rethrow_exception(meeting.error);
}

std::vector<std::byte> Chunks::joined(Array array, const std::function<uint64_t(uint32_t)>& bytes_of) {
    std::vector<std::byte> all;
    for (Chunk& chunk : chunks_) {
        copy_to_host(chunk, array);
        const std::vector<std::byte>& bytes = chunk.kept[array].bytes;
        const uint64_t size = bytes_of(chunk.model.splats);
        if (size > bytes.size()) throw std::logic_error("a chunk lacks an array");
        all.insert(all.end(), bytes.begin(), bytes.begin() + std::ptrdiff_t(size));
    }
    return all;
}

}  // namespace ewa::train
