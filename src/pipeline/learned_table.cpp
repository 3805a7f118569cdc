// SPDX-License-Identifier: Apache-2.0
#include "pipeline/learned_table.h"

#include <utility>

#include "pipeline/model.h"

namespace ewa::pipeline {
namespace {

/// Calls visit(buffer, offset, bytes) for each part of what a view learns.
template <class Table, class Visit>
void visit_parts(Table& table, uint32_t row, uint32_t slot, const Visit& visit) {
    const uint64_t own = 4ull * table.layout.row_floats, shared = 4ull * table.layout.slot_floats;
    if (own > 0)
        for (auto* buffer : {&table.values, &table.moments1, &table.moments2}) visit(*buffer, own * row, own);
    if (shared > 0) visit(table.slots, shared * slot, shared);
}

}  // namespace

LearnedTable::LearnedTable(gpu::Device& device, Layout of, std::span<const float> start)
    : layout(std::move(of)),
      floats(start.size()),
      values(device, layout.name, bytes()),
      moments1(device, layout.moments + "1", bytes()),
      moments2(device, layout.moments + "2", bytes()) {
    values.upload(start);
    zero(moments1);
    zero(moments2);
    const uint64_t slot_bytes = 4ull * layout.slot_floats * layout.views;
    if (slot_bytes > 0) slots = gpu::Buffer(device, layout.name + " slots", slot_bytes);
}

std::vector<LearnedTable::Array> LearnedTable::arrays() {
    if (empty()) return {};
    return {{layout.name, &values, bytes()},
            {layout.moments + "1", &moments1, bytes()},
            {layout.moments + "2", &moments2, bytes()}};
}

std::vector<uint64_t> LearnedTable::words(uint32_t row, uint32_t slot) const {
    std::vector<uint64_t> words(words_of_view());
    const auto into = std::as_writable_bytes(std::span(words));
    size_t at = 0;
    visit_parts(*this, row, slot, [&](const gpu::Buffer& buffer, uint64_t offset, uint64_t size) {
        buffer.download(into.subspan(at, size), offset);
        at += size;
    });
    return words;
}

void LearnedTable::set(uint32_t row, uint32_t slot, std::span<const uint64_t> words) {
    const auto from = std::as_bytes(words);
    size_t at = 0;
    visit_parts(*this, row, slot, [&](gpu::Buffer& buffer, uint64_t offset, uint64_t size) {
        buffer.upload(from.subspan(at, size), offset);
        at += size;
    });
}

}  // namespace ewa::pipeline
