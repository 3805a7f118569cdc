// SPDX-License-Identifier: Apache-2.0
#include "portions/holder.h"

#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

namespace ewa::portions {

using pipeline::Model;

const char* name_of(Array array) {
    constexpr std::array kNames{"params", "moments1", "moments2", "statistics"};
    return kNames[array];
}

uint64_t bytes_of(Array array, uint32_t splats, int sh_degree) {
    return array == statistics ? 8ull * splats : pipeline::parameter_bytes(splats, sh_degree);
}

Holder::Holder(const Setup& setup) : own_(size_t(setup.count)), kept_{params, Array::moments1} {
    if (setup.moments > 1) kept_.push_back(Array::moments2);
    if (setup.statistics) kept_.push_back(statistics);
}

gpu::Buffer& Holder::buffer(int portion, size_t array) {
    Portion& own = own_[size_t(portion)];
    const std::array<gpu::Buffer*, arrays> all{&own.model.params, &own.model.moments1, &own.model.moments2,
                                               &own.model.statistics, &own.list_indices};
    return *all[array];
}

uint32_t Holder::splats() const {
    const auto add = [](uint32_t sum, const Portion& portion) { return sum + portion.model.splats; };
    return std::accumulate(own_.begin(), own_.end(), 0u, add);
}

uint64_t Holder::state_bytes(uint32_t splats) const {
    uint64_t sum = 0;
    for (const Array array : kept_) sum += bytes_of(array, splats, own_.front().model.sh_degree);
    return sum;
}

std::vector<std::byte> Holder::download(Array array) {
    std::vector<std::byte> all = download(0, array);
    for (int i = 1; i < count(); ++i) {
        const std::vector<std::byte> bytes = download(i, array);
        all.insert(all.end(), bytes.begin(), bytes.end());
    }
    return all;
}

void Holder::clear(int portion, Model like) {
    for (size_t array = 0; array < arrays; ++array) remove(portion, Array(array));
    model(portion) = std::move(like);
}

namespace {

gpu::Texel texel_of(Array array) {
    return array == params       ? gpu::Texel::rgba32f
           : array == statistics ? gpu::Texel::none
                                 : gpu::Texel::rgba32ui;
}

/// One portion, on the device.
class Resident : public Holder {
  public:
    Resident(gpu::Device& device, const Setup& setup) : Holder(setup), device_(device) {}

    std::unique_ptr<Lists> make_lists() override { return lists_on_device(device_); }
    Model& use(int portion, Need) override { return model(portion); }
    void changed() override {}
    gpu::Buffer& indices() override { return buffer(0, Array::list_indices); }
    void visit(Need, const std::function<void(int, Model&)>& visit) override { visit(0, model(0)); }
    std::vector<std::byte> download(int portion, Array array) override {
        return buffer(portion, array).download<std::byte>(bytes(portion, array));
    }
    void give(int portion, Array array, std::vector<std::byte> bytes) override {
        gpu::Buffer given(device_, name_of(array), bytes.size(), texel_of(array));
        given.upload(std::span<const std::byte>(bytes));
        buffer(portion, array) = std::move(given);
    }

  private:
    gpu::Device& device_;
};

/// Several portions, in host memory.
class Streamed : public Holder {
  public:
    Streamed(gpu::Device& device, const Setup& setup)
        : Holder(setup), device_(device), on_host_(size_t(setup.count)) {
        device.limit_memory(setup.limit, [this] { return evict(); });
    }
    /// What remains on the device, such as an evaluation, keeps the limit.
    ~Streamed() override { device_.make_room_with({}); }

    std::unique_ptr<Lists> make_lists() override { return lists_in_host_memory(device_, streaming()); }
    Model& use(int portion, Need need) override;
    void changed() override {
        for (Kept& kept : on_host_[size_t(in_use_)]) kept.same_as = 0;
    }
    gpu::Buffer& indices() override {
        kept(in_use_, Array::list_indices) = {};
        return buffer(in_use_, Array::list_indices);
    }
    void visit(Need need, const std::function<void(int, Model&)>& visit) override;
    std::vector<std::byte> download(int portion, Array array) override;
    void give(int portion, Array array, std::vector<std::byte> bytes) override {
        kept(portion, array) = {name_of(array), texel_of(array), std::move(bytes), 0};
    }
    void remove(int portion, Array array) override {
        Holder::remove(portion, array);
        kept(portion, array) = {};
    }

  private:
    /// An array's bytes on the host, and which buffer has the same bytes.
    struct Kept {
        std::string name;
        gpu::Texel texel = gpu::Texel::none;
        std::vector<std::byte> bytes;
        uint64_t same_as = 0;  // Buffer::serial; 0: none
    };
    Kept& kept(int portion, size_t array) { return on_host_[size_t(portion)][array]; }
    void copy_to_host(int portion, size_t array);
    int visits_until(int portion, size_t array) const;
    bool evict();

    gpu::Device& device_;
    std::vector<std::array<Kept, arrays>> on_host_;
    int in_use_ = -1;
    bool forwards_ = true;
    Need need_ = Need::state;  // of the visit
    bool evicting_ = false;
};

void Streamed::copy_to_host(int portion, size_t array) {
    Kept& kept = this->kept(portion, array);
    const gpu::Buffer& buffer = this->buffer(portion, array);
    if (!buffer || kept.same_as == buffer.serial()) return;
    kept.name = buffer.name();
    kept.texel = buffer.texel();
    kept.bytes.resize(buffer.bytes());
    streaming().stream(kept.bytes.size(), [&] { buffer.download(std::span<std::byte>(kept.bytes)); });
    kept.same_as = buffer.serial();
}

/// How many portions are used before this array is needed again. The visit after this one goes the other way, and visits
/// that need parameters alone take turns with those that need the state.
int Streamed::visits_until(int portion, size_t array) const {
    const int last = count() - 1;
    const int at = in_use_ < 0 ? -1 : forwards_ ? in_use_ : last - in_use_;
    const int place = forwards_ ? portion : last - portion;
    const bool state = array != params;
    if (place > at && !(state && need_ != Need::state)) return place - at;
    const int next_visit = (last - at) + (last - place) + 1;
    return state && need_ == Need::state ? next_visit + count() : next_visit;
}

/// Frees the array of another portion that is not needed for longest. False if there is none.
bool Streamed::evict() {
    if (std::exchange(evicting_, true)) return false;  // the copy to the host asks for room itself
    int most = -1;
    std::pair<int, size_t> found;
    for (int p = 0; p < count(); ++p)
        for (size_t array = 0; p != in_use_ && array < arrays; ++array)
            if (buffer(p, array) && visits_until(p, array) > most) {
                most = visits_until(p, array);
                found = {p, array};
            }
    if (most >= 0) {
        copy_to_host(found.first, found.second);
        buffer(found.first, found.second) = gpu::Buffer();
    }
    evicting_ = false;
    return most >= 0;
}

Model& Streamed::use(int portion, Need need) {
    in_use_ = portion;
    for (size_t array = 0; array < arrays; ++array) {
        Kept& kept = this->kept(portion, array);
        gpu::Buffer& buffer = this->buffer(portion, array);
        const bool wanted =
            need == Need::state || array == params || (need == Need::statistics && array == statistics);
        if (!wanted || buffer || kept.bytes.empty()) continue;
        gpu::Buffer brought(device_, kept.name, kept.bytes.size(), kept.texel);
        streaming().stream(kept.bytes.size(),
                           [&] { brought.upload(std::span<const std::byte>(kept.bytes)); });
        buffer = std::move(brought);
        kept.same_as = buffer.serial();
    }
    return model(portion);
}

void Streamed::visit(Need need, const std::function<void(int, Model&)>& visit) {
    need_ = need;
    for (int i = 0; i < count(); ++i) {
        const int portion = forwards_ ? i : count() - 1 - i;
        visit(portion, use(portion, need));
    }
    in_use_ = -1;
    forwards_ = !forwards_;
}

std::vector<std::byte> Streamed::download(int portion, Array array) {
    const uint64_t size = bytes(portion, array);
    copy_to_host(portion, array);
    const std::vector<std::byte>& bytes = kept(portion, array).bytes;
    if (size > bytes.size()) throw std::logic_error("a portion lacks an array");
    return {bytes.begin(), bytes.begin() + std::ptrdiff_t(size)};
}

}  // namespace

std::unique_ptr<Holder> make_holder(gpu::Device& device, const Setup& setup) {
    if (setup.count == 1) return std::make_unique<Resident>(device, setup);
    return std::make_unique<Streamed>(device, setup);
}

}  // namespace ewa::portions
