// SPDX-License-Identifier: Apache-2.0
// checkpoint.ewa: the state of a training run, from which it can continue. All numbers are little endian.
//
//   header    8 bytes "EWACKPT\n", u32 version (1), u32 number of sections
//   section   16 bytes name (zero padded), u64 bytes, u32 CRC-32, u32 zero, then that many bytes
//
// The CRC-32 (zlib's) is over the section's name, its size and its bytes. The first three sections are
//
//   settings  JSON: options and fingerprint of the dataset (train/resume.h)
//   metrics   the lines of metrics.jsonl so far
//   state     i64 step; f64 seconds, wall seconds, loss; u64 dropped updates; u32 splats, skipped splats, SH
//             degree, shortened updates (at most 2^32 - 1); f64 PSNR, which earlier versions do not write
//
// The other sections are the arrays of TrainerState under their names, in the device's layout
// (shaders/shared/layouts.h).
#pragma once
#include <filesystem>
#include <string>

#include "ewa/trainer.h"

namespace ewa::train {

struct Checkpoint {
    std::string settings, metrics;
    double wall_seconds = 0;
    TrainerState state;
};

/// Replaces the file as a whole: after a kill the path holds this checkpoint or the previous one. Throws RunError.
void write_checkpoint(const std::filesystem::path& path, const Checkpoint& checkpoint);

/// Throws InputError, with the byte, if the file is cut short, damaged, of another version or no checkpoint.
Checkpoint read_checkpoint(const std::filesystem::path& path);

/// The same without the arrays of the state, which are not read. A file cut short in them is no error.
Checkpoint read_checkpoint_head(const std::filesystem::path& path);

}  // namespace ewa::train
