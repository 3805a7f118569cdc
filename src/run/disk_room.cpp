// SPDX-License-Identifier: Apache-2.0
#include "run/disk_room.h"

#include <spdlog/fmt/fmt.h>

#include <system_error>

#include "core/messages.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "folders/run_folder.h"
#include "pipeline/model.h"

namespace ewa::train {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kStatisticsBytes = 16;             // of a splat, in a checkpoint
constexpr uint64_t kNormalBytes = 12;                 // of a splat, in splats.ply
constexpr uint64_t kReportBytes = uint64_t(8) << 20;  // with renders and logs; few reports are larger

struct RunBytes {
    uint64_t splats = 0, checkpoint = 0;
    uint64_t both() const { return splats + checkpoint; }
};

RunBytes bytes_of_run(uint64_t splats, const TrainOptions& options) {
    const uint64_t parameters = pipeline::parameter_bytes(uint32_t(splats), options.sh_degree);
    const uint64_t moments = 2 * parameters * uint64_t(options.moment_bits) / 32;
    return {parameters + splats * kNormalBytes, parameters + moments + splats * kStatisticsBytes};
}

uint64_t replaced_bytes(const fs::path& folder) {
    uint64_t bytes = 0;
    for (const char* file : folders::kRunFiles) {
        std::error_code absent;
        const uintmax_t size = fs::file_size(folder / file, absent);
        if (!absent) bytes += size;
    }
    return bytes;
}

}  // namespace

std::string check_disk_room(const fs::path& folder, uint64_t first, uint64_t most,
                            const TrainOptions& options) {
    std::error_code unknown;
    const fs::space_info disk = fs::space(folder, unknown);
    if (unknown) return {};
    const uint64_t room = disk.available + replaced_bytes(folder);
    const std::string where = core::one_line(folder.string());
    if (const uint64_t least = bytes_of_run(first, options).both(); room < least)
        throw RunError(fmt::format(
            "{}: its disk has {} free, and splats.ply and checkpoint.ewa of the first {} take {}; free some "
            "space, or take another disk with -o DIR",
            where, core::bytes_text(room), core::counted(first, "splat"), core::bytes_text(least)));
    const RunBytes end = bytes_of_run(most, options);
    // A new checkpoint is whole before it replaces the one before.
    const uint64_t needed = end.both() + end.checkpoint + kReportBytes;
    if (room >= needed) return {};
    return fmt::format(
        "the disk of {} has {} free, and {} may take {}; a smaller --max-splats takes less, -o DIR another "
        "disk",
        where, core::bytes_text(room), core::counted(most, "splat"), core::bytes_text(needed));
}

std::string after_full_disk(int step, int checkpoint, int splats) {
    const bool has_splats = splats >= 0 && splats != checkpoint;
    const std::string also = has_splats ? fmt::format(", splats.ply has step {}", splats) : "";
    if (checkpoint >= 0)
        return fmt::format("; checkpoint.ewa has step {} of the {} trained{}: free some space, then --resume",
                           checkpoint, step, also);
    return fmt::format(
        "; {} no checkpoint fitted: free some space before you train again",
        has_splats ? fmt::format("splats.ply has step {}, but", splats)
                   : fmt::format("the {} trained are lost, since", core::counted(uint64_t(step), "step")));
}

}  // namespace ewa::train
