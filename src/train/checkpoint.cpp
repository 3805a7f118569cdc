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
#include <utility>

#include "ewa/error.h"
#include "ewa/gaussians.h"

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

/// zlib restarts the sum for a null pointer.
uint32_t added(uint32_t checksum, std::span<const std::byte> data) {
    if (data.empty()) return checksum;
    return uint32_t(crc32_z(checksum, reinterpret_cast<const Bytef*>(data.data()), data.size()));
}

/// The checksum of the name and the size.
uint32_t checksum_of(const SectionHeader& header) {
    return added(0, std::as_bytes(std::span(&header, 1)).first(offsetof(SectionHeader, checksum)));
}

void write_header(core::AtomicFile& file, std::string_view name, uint64_t bytes, uint32_t checksum) {
    SectionHeader header{};
    std::memcpy(header.name, name.data(), std::min(name.size(), kNameBytes - 1));
    header.bytes = bytes;
    header.checksum = uint32_t(crc32_combine(checksum_of(header), checksum, z_off_t(bytes)));
    file.write(&header, sizeof(header));
}

void write_section(core::AtomicFile& file, std::string_view name, std::span<const std::byte> data) {
    write_header(file, name, data.size(), added(0, data));
    file.write(data.data(), data.size());
}

/// Reads a section, piece by piece. take: gets its header first, with an empty piece.
template <class Take>
void read_section(core::FileReader& file, Take&& take) {
    SectionHeader header;
    std::memcpy(&header, file.take(sizeof(header), "a section's header"), sizeof(header));
    file.require_room(header.bytes, 1, "a section");
    StateReader::Array section{
        {std::begin(header.name), std::find(std::begin(header.name), std::end(header.name), char(0))},
        header.bytes};
    take(section, {});
    uint32_t checksum = checksum_of(header);
    for (uint64_t at = 0; at < header.bytes;) {
        const size_t size = size_t(std::min<uint64_t>(kPiece, header.bytes - at));
        const std::span<const std::byte> piece(file.take(size, "a section"), size);
        checksum = added(checksum, piece);
        take(section, piece);
        at += size;
    }
    if (checksum != header.checksum)
        file.fail("a section does not have its checksum: the checkpoint is damaged; --force starts anew");
}

TrainerArray read_section(core::FileReader& file) {
    TrainerArray section;
    read_section(file, [&](const StateReader::Array& array, std::span<const std::byte> piece) {
        section.name = array.name;
        section.bytes.reserve(array.bytes);
        section.bytes.insert(section.bytes.end(), piece.begin(), piece.end());
    });
    return section;
}

std::string text_of(const std::vector<std::byte>& bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

CheckpointWriter::CheckpointWriter(const std::filesystem::path& path, std::string settings,
                                   std::string metrics, std::optional<double> wall_seconds)
    : file_(path),
      settings_(std::move(settings)),
      metrics_(std::move(metrics)),
      wall_seconds_(wall_seconds) {}

void CheckpointWriter::begin(const StateHead& head, size_t arrays) {
    const StepReport& r = head.report;
    const StateBlock block{r.step,
                           wall_seconds_ ? r.seconds : 0,
                           wall_seconds_.value_or(0),
                           r.loss,
                           r.dropped_updates,
                           r.splats,
                           r.skipped_nonfinite,
                           uint32_t(head.sh_degree),
                           uint32_t(std::min<uint64_t>(r.limited_steps, 0xffffffffu)),
                           r.psnr};
    file_.write(kMagic);
    const uint32_t counts[] = {kVersion, uint32_t(std::size(kFixed) + arrays)};
    file_.write(counts, sizeof(counts));
    write_section(file_, kFixed[0], std::as_bytes(std::span(settings_)));
    write_section(file_, kFixed[1], std::as_bytes(std::span(metrics_)));
    write_section(file_, kFixed[2], std::as_bytes(std::span(&block, 1)));
}

void CheckpointWriter::begin_array(const std::string& name, uint64_t bytes, uint32_t checksum) {
    write_header(file_, name, bytes, checksum);
}

void CheckpointWriter::write(std::span<const std::byte> piece) {
    file_.write(piece.data(), piece.size());
}

void write_checkpoint(const std::filesystem::path& path, const Checkpoint& checkpoint) {
    const TrainerState& state = checkpoint.state;
    CheckpointWriter writer(path, checkpoint.settings, checkpoint.metrics, checkpoint.wall_seconds);
    writer.begin({state.report, state.sh_degree}, state.arrays.size());
    for (const TrainerArray& array : state.arrays) {
        writer.begin_array(array.name, array.bytes.size(), added(0, array.bytes));
        writer.write(array.bytes);
    }
    writer.commit();
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

CheckpointReader::CheckpointReader(const std::filesystem::path& path) : file_(path) {
    uint32_t arrays = 0;
    checkpoint_ = read_head(file_, arrays);
    head_ = {checkpoint_.state.report, checkpoint_.state.sh_degree};
    for (uint32_t i = 0; i < arrays; ++i)
        read_section(file_, [&](const Array& array, std::span<const std::byte> piece) {
            if (!piece.empty()) return;
            arrays_.push_back(array);
            begins_.push_back(file_.offset());
        });
    if (file_.remaining() > 0) file_.fail("there are bytes behind the last section");
}

void CheckpointReader::read(size_t array, uint64_t offset, std::span<std::byte> into) {
    file_.go_to(begins_[array] + offset, "a section");
    for (size_t at = 0; at < into.size();) {
        const size_t piece = std::min(kPiece, into.size() - at);
        std::memcpy(&into[at], file_.take(piece, "a section"), piece);
        at += piece;
    }
}

Checkpoint read_checkpoint(const std::filesystem::path& path) {
    CheckpointReader reader(path);
    Checkpoint checkpoint = reader.checkpoint();
    for (size_t i = 0; i < reader.arrays().size(); ++i) {
        const StateReader::Array& array = reader.arrays()[i];
        TrainerArray& read = checkpoint.state.arrays.emplace_back();
        read.name = array.name;
        read.bytes.resize(array.bytes);
        reader.read(i, 0, read.bytes);
    }
    return checkpoint;
}

}  // namespace ewa::train
