// SPDX-License-Identifier: Apache-2.0
#include "train/checkpoint.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <span>
#include <type_traits>

#include "core/atomic_file.h"
#include "core/file_reader.h"
#include "ewa/error.h"

namespace ewa::train {
namespace {

constexpr std::string_view kMagic = "EWACKPT\n";
constexpr uint32_t kVersion = 1;
constexpr size_t kNameBytes = 16, kPiece = 1u << 20;
constexpr uint32_t kMaxSections = 64;
constexpr std::string_view kFixed[] = {"settings", "metrics", "state"};

struct StateBlock {
    int64_t step;
    double seconds, wall_seconds, loss;
    uint64_t dropped_updates;
    uint32_t splats, skipped_nonfinite, sh_degree, limited_steps;
    double psnr;  // absent from the checkpoints of earlier versions
};
constexpr size_t kEarlierStateBytes = offsetof(StateBlock, psnr);
static_assert(sizeof(StateBlock) == 64 && kEarlierStateBytes == 56 &&
              std::is_trivially_copyable_v<StateBlock>);

struct SectionHeader {
    char name[kNameBytes];
    uint64_t bytes;
    uint32_t checksum, zero;
};
static_assert(sizeof(SectionHeader) == 32);

uint32_t checksum_of(const SectionHeader& header, std::span<const std::byte> data) {
    const auto* head = reinterpret_cast<const Bytef*>(&header);
    const uLong sum = crc32_z(0, head, offsetof(SectionHeader, checksum));
    if (data.empty()) return uint32_t(sum);  // zlib restarts the sum for a null pointer
    return uint32_t(crc32_z(sum, reinterpret_cast<const Bytef*>(data.data()), data.size()));
}

void write_section(core::AtomicFile& file, std::string_view name, std::span<const std::byte> data) {
    SectionHeader header{};
    std::memcpy(header.name, name.data(), std::min(name.size(), kNameBytes - 1));
    header.bytes = data.size();
    header.checksum = checksum_of(header, data);
    file.write(&header, sizeof(header));
    file.write(data.data(), data.size());
}

TrainerArray read_section(core::FileReader& file) {
    SectionHeader header;
    std::memcpy(&header, file.take(sizeof(header), "a section's header"), sizeof(header));
    TrainerArray section;
    section.name.assign(std::begin(header.name),
                        std::find(std::begin(header.name), std::end(header.name), char(0)));
    file.require_room(header.bytes, 1, "a section");
    section.bytes.resize(header.bytes);
    for (uint64_t at = 0; at < header.bytes;) {
        const size_t piece = size_t(std::min<uint64_t>(kPiece, header.bytes - at));
        std::memcpy(&section.bytes[at], file.take(piece, "a section"), piece);
        at += piece;
    }
    if (checksum_of(header, section.bytes) != header.checksum)
        file.fail("a section does not have its checksum: the checkpoint is damaged; --force starts anew");
    return section;
}

std::string text_of(const std::vector<std::byte>& bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

void write_checkpoint(const std::filesystem::path& path, const Checkpoint& checkpoint) {
    const TrainerState& state = checkpoint.state;
    const StepReport& r = state.report;
    const StateBlock block{r.step,
                           r.seconds,
                           checkpoint.wall_seconds,
                           r.loss,
                           r.dropped_updates,
                           r.splats,
                           r.skipped_nonfinite,
                           uint32_t(state.sh_degree),
                           uint32_t(std::min<uint64_t>(r.limited_steps, 0xffffffffu)),
                           r.psnr};
    core::AtomicFile file(path);
    file.write(kMagic);
    const uint32_t counts[] = {kVersion, uint32_t(std::size(kFixed) + state.arrays.size())};
    file.write(counts, sizeof(counts));
    write_section(file, kFixed[0], std::as_bytes(std::span(checkpoint.settings)));
    write_section(file, kFixed[1], std::as_bytes(std::span(checkpoint.metrics)));
    write_section(file, kFixed[2], std::as_bytes(std::span(&block, 1)));
    for (const TrainerArray& array : state.arrays) write_section(file, array.name, array.bytes);
    file.commit();
}

namespace {

/// Reads the header and the fixed sections. arrays: their number.
Checkpoint read_head(core::FileReader& file, uint32_t& arrays) {
    if (file.remaining() < kMagic.size() ||
        std::memcmp(file.take(kMagic.size(), "the header"), kMagic.data(), kMagic.size()) != 0)
        file.fail("not a checkpoint of ewa");
    const auto version = file.read<uint32_t>("the version");
    if (version != kVersion)
        file.fail("a checkpoint of layout " + std::to_string(version) +
                  "; this version of ewa reads layout " + std::to_string(kVersion));
    const auto sections = file.read<uint32_t>("the number of sections");
    if (sections < std::size(kFixed) || sections > kMaxSections)
        file.fail("a checkpoint of " + std::to_string(sections) + " sections");

    arrays = sections - uint32_t(std::size(kFixed));
    std::array<TrainerArray, std::size(kFixed)> fixed;
    for (size_t i = 0; i < fixed.size(); ++i) {
        fixed[i] = read_section(file);
        if (fixed[i].name != kFixed[i]) file.fail("no section \"" + std::string(kFixed[i]) + "\" here");
    }
    StateBlock block{};
    block.psnr = std::nan("");
    if (fixed[2].bytes.size() != sizeof(block) && fixed[2].bytes.size() != kEarlierStateBytes)
        file.fail("the section \"state\" is not of its size");
    std::memcpy(&block, fixed[2].bytes.data(), fixed[2].bytes.size());

    Checkpoint checkpoint{text_of(fixed[0].bytes), text_of(fixed[1].bytes), block.wall_seconds, {}};
    TrainerState& state = checkpoint.state;
    if (block.step < 0 || block.step > INT32_MAX || block.sh_degree > uint32_t(kMaxShDegree))
        file.fail("the section \"state\" has a step or an SH degree out of range");
    state.sh_degree = int(block.sh_degree);
    state.report = {int(block.step),       block.seconds,           block.loss,          block.splats,
                    block.dropped_updates, block.skipped_nonfinite, block.limited_steps, block.psnr};
    return checkpoint;
}

}  // namespace

Checkpoint read_checkpoint_head(const std::filesystem::path& path) {
    core::FileReader file(path);
    uint32_t arrays = 0;
    return read_head(file, arrays);
}

Checkpoint read_checkpoint(const std::filesystem::path& path) {
    core::FileReader file(path);
    uint32_t arrays = 0;
    Checkpoint checkpoint = read_head(file, arrays);
    for (uint32_t i = 0; i < arrays; ++i) checkpoint.state.arrays.push_back(read_section(file));
    if (file.remaining() > 0) file.fail("there are bytes behind the last section");
    return checkpoint;
}

}  // namespace ewa::train
