// SPDX-License-Identifier: Apache-2.0
// checkpoint.ewa: a training run laid down so that it can go on. All numbers little endian.
//
//   header    8 bytes "EWACKPT\n", u32 version (1), u32 number of sections
//   section   16 bytes name (zero padded), u64 bytes, u32 CRC-32, u32 zero, then that many bytes
//
// The checksum (zlib's crc32) is over the section's name, its size and its bytes. The first three sections
// are
//   settings  JSON: what the run was asked for and the dataset's fingerprint; the writer's to define
//   metrics   the lines of metrics.jsonl so far
//   state     i64 step; f64 seconds, wall seconds, loss; u64 dropped updates; u32 splats, skipped, SH degree,
//   steps shortened (at most 2^32 - 1)
// and what follows are TrainerState's arrays under their names, in the device's layout
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

/// Written beside and renamed: after a kill the path holds this checkpoint or the one before. Throws
/// RunError.
void write_checkpoint(const std::filesystem::path& path, const Checkpoint& checkpoint);

/// Throws InputError that says at which byte a file is cut short, damaged, of another version or no
/// checkpoint.
Checkpoint read_checkpoint(const std::filesystem::path& path);

/// 16 hexadecimal digits that tell datasets apart: every frame's name, split and camera, and of its
/// photograph the file's size and first 64 KiB. Frames without a file count with their names and cameras.
std::string dataset_fingerprint(const Dataset& dataset, const Split& split);

}  // namespace ewa::train
