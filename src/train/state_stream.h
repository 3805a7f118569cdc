// SPDX-License-Identifier: Apache-2.0
// Writes and reads a training's state in pieces, so that no process needs memory for the whole state.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "ewa/step_report.h"

namespace ewa::train {

/// A TrainerState without its arrays.
struct StateHead {
    StepReport report;
    int sh_degree = 0;
};

/// Receives a state: first its head, then one array after another.
class StateWriter {
  public:
    virtual ~StateWriter() = default;
    virtual void begin(const StateHead& head, size_t arrays) = 0;
    /// checksum: zlib's CRC-32 of the array's bytes, which come next.
    virtual void begin_array(const std::string& name, uint64_t bytes, uint32_t checksum) = 0;
    virtual void write(std::span<const std::byte> piece) = 0;
};

/// Gives access to a stored state.
class StateReader {
  public:
    struct Array {
        std::string name;
        uint64_t bytes = 0;
    };
    virtual ~StateReader() = default;
    virtual const StateHead& head() const = 0;
    virtual const std::vector<Array>& arrays() const = 0;
    /// Fills `into` with the bytes of an array from `offset` on.
    virtual void read(size_t array, uint64_t offset, std::span<std::byte> into) = 0;
};

/// A writer that stores a state in memory.
struct StateInMemory : StateWriter {
    TrainerState state;
    void begin(const StateHead& head, size_t) override { state = {head.report, head.sh_degree, {}}; }
    void begin_array(const std::string& name, uint64_t bytes, uint32_t) override {
        state.arrays.push_back({name, {}});
        state.arrays.back().bytes.reserve(bytes);
    }
    void write(std::span<const std::byte> piece) override {
        std::vector<std::byte>& bytes = state.arrays.back().bytes;
        bytes.insert(bytes.end(), piece.begin(), piece.end());
    }
};

/// A reader of a state that is in memory.
class StateOfMemory : public StateReader {
  public:
    explicit StateOfMemory(const TrainerState& state) : state_(state), head_{state.report, state.sh_degree} {
        for (const TrainerArray& array : state.arrays) arrays_.push_back({array.name, array.bytes.size()});
    }
    const StateHead& head() const override { return head_; }
    const std::vector<Array>& arrays() const override { return arrays_; }
    void read(size_t array, uint64_t offset, std::span<std::byte> into) override {
        std::copy_n(state_.arrays[array].bytes.begin() + std::ptrdiff_t(offset), into.size(), into.begin());
    }

  private:
    const TrainerState& state_;
    StateHead head_;
    std::vector<Array> arrays_;
};

}  // namespace ewa::train
