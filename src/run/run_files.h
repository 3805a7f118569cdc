// SPDX-License-Identifier: Apache-2.0
// The files in a run's folder.
#pragma once
#include <filesystem>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/folders.h"
#include "ewa/appearance.h"
#include "ewa/run_options.h"
#include "ewa/sky_map.h"
#include "ewa/summary.h"
#include "folders/run_folder.h"
#include "io/splats/place.h"
#include "report/html.h"
#include "run/refined_cameras.h"

namespace ewa::train {

struct RunInput;

/// The position of a run's splats on the globe. Empty if the dataset has none, or with --level off.
std::optional<io::Place> place_of(const RunInput& input);

/// Writes splats with comments on the program, the run and the position on the globe. Throws RunError.
void write_splats(const std::filesystem::path& file, const Gaussians& gaussians, int step,
                  const RenderOptions& render, const std::optional<io::Place>& place);

using folders::without_link;

/// Writes the files of a run into its folder. No other process can train in it while this lives.
class RunWriter {
  public:
    /// Creates the folder. Throws RunError if it cannot be created or another process uses it.
    explicit RunWriter(const std::filesystem::path& path);

    /// The place of the splats that are saved from here on.
    void set_place(const std::optional<io::Place>& place) { place_ = place; }

    const std::filesystem::path& path() const { return folder_.path(); }
    std::filesystem::path checkpoint() const { return folder_ / folders::kCheckpointFile; }
    std::filesystem::path times() const { return folder_ / folders::kTimesFile; }
    std::filesystem::path metrics() const { return folder_ / folders::kMetricsFile; }

    // All of these throw RunError.
    /// Writes config.json, after the removal of symbolic links in the places of the run's files. If the run does not continue an earlier one, removes that run's checkpoint and results,
    /// but splats.ply: they must not stay beside this run's metrics if it fails.
    void begin(const nlohmann::ordered_json& config, bool continues) const;
    /// The last line of metrics.jsonl for this step, if there is one.
    std::optional<MetricsLine> logged(int step) const;
    void save_splats(const Gaussians& gaussians, int step, const RenderOptions& render) const;
    /// The same as one of the last `count` kept splats. Removes those before.
    void keep_splats(const Gaussians& gaussians, int step, const RenderOptions& render, int count) const;
    /// appearance.json. appearances: one for each of the training frames; none: nothing.
    void save_appearances(const Dataset& dataset, const std::vector<int>& frames,
                          const std::vector<Appearance>& appearances) const;
    /// sky.json. sky: null: nothing.
    void save_sky(const std::shared_ptr<const SkyMap>& sky) const;
    /// cameras.json, and a COLMAP model of the dataset with these cameras in cameras/, where images is a link. The frames have
    /// the refined cameras. given: those of the dataset. aligned: the test cameras were aligned to their images.
    void save_cameras(const Dataset& dataset, const Split& split, const std::vector<Camera>& given,
                      const Similarity& world, double extent, bool aligned) const;
    /// summary.json and report.html.
    void save_report(const report::ReportData& report) const;

  private:
    folders::RunFolder folder_;
    core::FolderLock lock_;
    std::optional<io::Place> place_;
};

/// The largest memory of the process so far, in bytes. Without the memory of a CPU device, which
/// peak_device_bytes counts.
uint64_t peak_host_bytes(const gpu::Device& device);

}  // namespace ewa::train
