// SPDX-License-Identifier: Apache-2.0
// The figures of a training run: those of summary.json, and one line of metrics.jsonl.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "ewa/metrics.h"

namespace ewa {

/// How far training moved the cameras of the training images, and of the test images.
struct CameraMoves {
    double median_degrees = 0, largest_degrees = 0;  // between rotations
    double median_share = 0, largest_share = 0;      // of the scene extent, between centres
    double least_focal = 1, largest_focal = 1;       // factors of the focal lengths
    /// Whether the test cameras were aligned to their images before test_psnr and test_ssim were measured.
    bool test_aligned = false;
};

/// Data and memory of one of several ranks. Data and times are means of a training view.
struct RankFigures {
    std::string name;       // e.g. "rank 1 (node7)"
    double sent_bytes = 0;  // to other ranks
    double exchange = 0;    // ms of moving data
    double waiting = 0;     // ms of waiting for the other ranks
    double own_bytes = 0;   // largest state so far: parameters, moments and statistics of its splats
    double peak_device_bytes = 0;
};

/// Figures of a training whose splats are not all on the device (TrainOptions::device_memory_bytes).
struct ChunkFigures {
    int chunks = 0;             // into which the splats are divided
    double streamed_bytes = 0;  // that were copied to the device and back: mean of an optimisation step
    double streaming = 0;       // ms that this took: mean of an optimisation step
    uint64_t state_bytes = 0;   // parameters, moments and statistics of all splats
    uint64_t limit = 0;         // device_memory_bytes
};

/// summary.json. A figure that does not exist (no test set, not evaluated) is null there. So is one that is not
/// finite, such as the PSNR of equal images.
struct Summary {
    int steps = 0;
    double seconds = 0;       // training alone
    double wall_seconds = 0;  // with start-up, evaluation and saving
    uint32_t splats = 0, max_splats = 0;
    std::optional<double> test_psnr, test_ssim, train_psnr;  // dB
    std::vector<Figure> test_figures;                        // of RunOptions::metrics; empty if not evaluated
    std::string device;
    uint64_t peak_device_bytes = 0, peak_host_bytes = 0;
    uint64_t seed = 0;
    uint32_t skipped_nonfinite = 0;  // these three as in StepReport
    uint64_t dropped_updates = 0;
    uint64_t limited_steps = 0;
    std::string version, command, strategy;
    bool interrupted = false;            // the run was stopped before its end
    std::optional<CameraMoves> cameras;  // with TrainOptions::refine_poses
    std::vector<RankFigures> ranks;      // of several ranks
    std::optional<ChunkFigures> chunks;  // of a training in chunks
};

/// How many splats an edit of a training has changed.
struct EditCounts {
    uint32_t removed = 0, frozen = 0, unfrozen = 0;
};

/// A line of metrics.jsonl.
struct MetricsLine {
    int step = 0;
    double seconds = 0, wall_seconds = 0;  // as in Summary, so far
    double loss = 0;                       // of this step
    uint32_t splats = 0;
    std::optional<double> test_psnr, test_ssim;  // if the test views were evaluated after this step
    std::optional<double> train_psnr;            // dB, of this step's training view, as StepReport::psnr
    std::vector<Figure> test_figures = {};       // of RunOptions::metrics, with test_psnr
    std::optional<EditCounts> edit = {};         // if the line is that of an edit after this step
};

}  // namespace ewa
