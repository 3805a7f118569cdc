// SPDX-License-Identifier: Apache-2.0
#include "edit/history.h"

#include <spdlog/fmt/fmt.h>
#include <zlib.h>

#include <algorithm>
#include <new>
#include <utility>

#include "edit/shapes.h"
#include "ewa/error.h"

namespace ewa::edit {
namespace {

/// The bits that differ, compressed. Splats behind the shorter one have changed from or to 0.
std::vector<uint8_t> packed_difference(const std::vector<uint8_t>& a, const std::vector<uint8_t>& b) {
    std::vector<uint8_t> bits(std::max(a.size(), b.size()));
    for (size_t i = 0; i < bits.size(); ++i)
        bits[i] = uint8_t((i < a.size() ? a[i] : 0) ^ (i < b.size() ? b[i] : 0));
    uLongf length = compressBound(uLong(bits.size()));
    std::vector<uint8_t> packed(length);
    if (compress2(packed.data(), &length, bits.data(), uLong(bits.size()), Z_BEST_SPEED) != Z_OK)
        throw std::bad_alloc();
    packed.resize(length);
    packed.shrink_to_fit();
    return packed;
}

std::vector<uint8_t> unpacked(const std::vector<uint8_t>& packed, size_t count) {
    std::vector<uint8_t> bits(count);
    uLongf length = uLongf(count);
    if (uncompress(bits.data(), &length, packed.data(), uLong(packed.size())) != Z_OK || length != count)
        throw std::bad_alloc();
    return bits;
}

std::string quoted(const std::string& word) {
    if (!word.empty() &&
        word.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
                               "_-+=.,:/%@") == std::string::npos)
        return word;
    std::string text(1, '\'');
    for (const char c : word) {
        if (c == '\'') text.append("'\\'");  // closes, an escaped quote, opens again
        text.push_back(c);
    }
    text.push_back('\'');
    return text;
}

/// Whether the edit selects without regard to the selection before.
bool replaces_selection(const Words& words) {
    constexpr const char* kFromBefore[] = {"add:", "remove:", "and:", "invert", "grow=", "shrink="};
    return words.name == "select" &&
           std::ranges::none_of(kFromBefore, [&](auto* begin) { return words.value.starts_with(begin); });
}

}  // namespace

std::vector<Words> edits_of(std::span<const Step> steps) {
    std::vector<Words> all;
    for (const Step& step : steps) all.insert(all.end(), step.edits.begin(), step.edits.end());
    return all;
}

std::vector<Words> lasting_edits(std::span<const Step> steps) {
    std::vector<Words> edits = edits_of(steps);
    while (!edits.empty() && edits.back().name == "select") edits.pop_back();
    return edits;
}

History::History(std::shared_ptr<const Gaussians> splats, Cameras cameras)
    : splats_(std::move(splats), std::move(cameras)) {}

bool History::perform(const Step& step) {
    std::vector<Edit> edits;
    for (const Words& words : step.edits) {
        edits.push_back(parse(words.name, words.value));
        if (!edits.back().act && !edits.back().place)
            throw InputError("--" + words.name + " is no edit of a selection");
    }
    const EditedSplats::Extent extent = splats_.extent();
    const std::vector<uint8_t> states = splats_.states();
    const auto values = splats_.splats();
    Step done = step;
    try {
        for (size_t k = 0; k < edits.size(); ++k) {
            Words& words = done.edits[k];
            if ((words.name == "select" || words.name == "remove") &&
                write_contradicted(words.value, splats_))
                edits[k] = parse(words.name, words.value);
            perform_on(splats_, edits[k]);
        }
    } catch (...) {
        splats_.rewind(extent);
        splats_.set_states(states);
        throw;
    }
    const bool changes = splats_.splats() != values || splats_.extent().groups != extent.groups;
    if (!changes && splats_.states() == states) return false;
    steps_.resize(done_);
    before_.resize(done_);
    steps_.push_back(std::move(done));
    before_.push_back({extent, packed_difference(states, splats_.states()), changes});
    ++done_;
    ++version_;
    values_version_ += changes;
    return true;
}

void History::flip(const Before& before, size_t splats) {
    std::vector<uint8_t> states = splats_.states();
    const std::vector<uint8_t> bits = unpacked(before.changed, splats);
    for (size_t i = 0; i < states.size(); ++i) states[i] ^= bits[i];
    splats_.set_states(std::move(states));
}

bool History::undo() {
    if (done_ == 0) return false;
    const Before& before = before_[--done_];
    const size_t splats = splats_.size();
    splats_.rewind(before.extent);
    flip(before, splats);
    ++version_;
    values_version_ += before.values;
    return true;
}

bool History::redo() {
    if (done_ == steps_.size()) return false;
    const Step& step = steps_[done_];
    const Before& before = before_[done_];
    // A shape takes long to evaluate, and what it has changed is known.
    if (!before.values)
        flip(before, splats_.size());
    else
        for (const Words& words : step.edits) perform_on(splats_, parse(words.name, words.value));
    ++done_;
    ++version_;
    values_version_ += before.values;
    return true;
}

uint64_t History::bytes() const {
    uint64_t bytes = splats_.bytes();
    for (const Before& before : before_) bytes += sizeof(Before) + before.changed.capacity();
    for (const Step& step : steps_)
        for (const Words& words : step.edits) bytes += sizeof(Words) + words.value.capacity();
    return bytes;
}

std::vector<Words> needed_edits(const std::vector<Words>& edits) {
    std::vector<Words> needed;
    for (const Words& words : edits) {
        if (replaces_selection(words))
            while (!needed.empty() && needed.back().name == "select") needed.pop_back();
        needed.push_back(words);
    }
    return needed;
}

std::string command_line(const std::vector<Words>& edits, const std::string& input,
                         const std::string& output) {
    std::string line = fmt::format("ewa convert {} {}", quoted(input), quoted(output));
    for (const Words& words : edits) {
        line += fmt::format(" --{}", words.name);
        if (!words.value.empty()) line += fmt::format(" {}", quoted(words.value));
    }
    return line;
}

}  // namespace ewa::edit
