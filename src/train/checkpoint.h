// SPDX-License-Identifier: Apache-2.0
// checkpoint.ewa: the state of a training run, from which it can continue. All numbers are little endian.
//
//   header    8 bytes "EWACKPT\n", u32 version (1), u32 number of sections
//   section   16 bytes name (zero padded), u64 bytes, u32 CRC-32, u32 zero, then that many bytes
//
// The CRC-32 (zlib's) is over the section's name, its size and its bytes. The first three sections are
//
//   settings  JSON: options and fingerprint of the dataset (run/resume.h)
//   metrics   the lines of metrics.jsonl so far
//   state     i64 step; f64 seconds, wall seconds, loss; u64 dropped updates; u32 splats, skipped splats, SH
//             degree, shortened updates (at most 2^32 - 1); f64 PSNR, which earlier versions do not write
//
// The other sections are the arrays of TrainerState under their names, in the device's layout
// (shaders/shared/layouts.h).
//
// A run writes zeros for all times, so that equal runs have equal files. The times are in times.json (run/run_times.h). Earlier
// versions wrote the times here.
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/atomic_file.h"
#include "core/file_reader.h"
#include "ewa/step_report.h"
#include "train/state_stream.h"

namespace ewa::train {

struct Checkpoint {
    std::string settings, metrics;
    double wall_seconds = 0;
    TrainerState state;
};

/// Writes a checkpoint array by array. The file is replaced as a whole by commit(): after a kill the path holds this
/// checkpoint or the previous one. All functions throw RunError.
class CheckpointWriter : public StateWriter {
  public:
    /// Without wall_seconds, all times in the file are zero.
    CheckpointWriter(const std::filesystem::path& path, std::string settings, std::string metrics,
                     std::optional<double> wall_seconds = {});
    void begin(const StateHead& head, size_t arrays) override;
    void begin_array(const std::string& name, uint64_t bytes, uint32_t checksum) override;
    void write(std::span<const std::byte> piece) override;
    void commit() { file_.commit(); }  // call once, last

  private:
    core::AtomicFile file_;
    std::string settings_, metrics_;
    std::optional<double> wall_seconds_;
};

/// Reads a checkpoint. Its arrays stay in the file until read() reads them.
class CheckpointReader : public StateReader {
  public:
    /// Reads the whole file once, to check it. Throws InputError with the byte if the file is cut short, damaged, of another
    /// version or no checkpoint.
    explicit CheckpointReader(const std::filesystem::path& path);

    /// The checkpoint's settings, metrics and times, without the arrays of its state.
    const Checkpoint& checkpoint() const { return checkpoint_; }
    /// Replaces the training time of the state.
    void set_seconds(double seconds) { head_.report.seconds = seconds; }

    const StateHead& head() const override { return head_; }
    const std::vector<Array>& arrays() const override { return arrays_; }
    void read(size_t array, uint64_t offset, std::span<std::byte> into) override;

  private:
    core::FileReader file_;
    Checkpoint checkpoint_;
    StateHead head_;
    std::vector<Array> arrays_;
    std::vector<uint64_t> begins_;  // of each array's bytes in the file
};

/// Write and read a whole checkpoint. They throw what CheckpointWriter and CheckpointReader throw.
void write_checkpoint(const std::filesystem::path& path, const Checkpoint& checkpoint);
Checkpoint read_checkpoint(const std::filesystem::path& path);

/// Reads a checkpoint without the arrays of the state. A file that is cut short within the arrays is no error.
Checkpoint read_checkpoint_head(const std::filesystem::path& path);

}  // namespace ewa::train
