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

/// The geographic position of a run's splats. Empty if the dataset has none, or with --level off.
std::optional<io::Place> place_of(const RunInput& input);

/// Writes a splat file with comments on the program, the run and the geographic position. Throws RunError.
void write_splats(const std::filesystem::path& file, const Gaussians& gaussians, int step,
                  const RenderOptions& render, const std::optional<io::Place>& place);

using folders::without_link;

/// Writes the files of a run into its folder. No other process can train in the folder while this object exists.
class RunWriter {
  public:
    /// Creates the folder. Throws RunError if it cannot be created or another process uses it.
    explicit RunWriter(const std::filesystem::path& path);

    /// Sets the geographic position that later saves of splats write.
    void set_place(const std::optional<io::Place>& place) { place_ = place; }

    const std::filesystem::path& path() const { return folder_.path(); }
    std::filesystem::path checkpoint() const { return folder_ / folders::kCheckpointFile; }
    std::filesystem::path times() const { return folder_ / folders::kTimesFile; }
    std::filesystem::path metrics() const { return folder_ / folders::kMetricsFile; }

    // All functions below throw RunError.
    /// Writes config.json, after the removal of symbolic links in the places of the run's files. If the run does not continue an
    /// earlier one, removes the earlier run's checkpoint and results, but not splats.ply. Otherwise, if this run failed, its
    /// metrics would be beside an earlier run's results.
    void begin(const nlohmann::ordered_json& config, bool continues) const;
    /// The last line of metrics.jsonl for this step, if there is one.
    std::optional<MetricsLine> logged(int step) const;
    void save_splats(const Gaussians& gaussians, int step, const RenderOptions& render) const;
    /// Saves the splats under the name of their step, for --keep. Keeps the last `count` such files and removes older ones.
    void keep_splats(const Gaussians& gaussians, int step, const RenderOptions& render, int count) const;
    /// Writes appearance.json. appearances: one for each training frame; if empty, nothing is written.
    void save_appearances(const Dataset& dataset, const std::vector<int>& frames,
                          const std::vector<Appearance>& appearances) const;
    /// Writes sky.json. sky: if null, nothing is written.
    void save_sky(const std::shared_ptr<const SkyMap>& sky) const;
    /// Writes cameras.json, and in cameras/ a COLMAP model of the dataset with a link `images`. dataset: its frames have the
    /// refined cameras. given: the cameras before refinement. aligned: the test cameras were aligned to their images.
    void save_cameras(const Dataset& dataset, const Split& split, const std::vector<Camera>& given,
                      const Similarity& world, double extent, bool aligned) const;
    /// Writes summary.json and report.html.
    void save_report(const report::ReportData& report) const;

  private:
    folders::RunFolder folder_;
    core::FolderLock lock_;
    std::optional<io::Place> place_;
};

/// The peak host memory of the process so far, in bytes. It excludes memory of a CPU device, which peak_device_bytes counts.
uint64_t peak_host_bytes(const gpu::Device& device);

}  // namespace ewa::train
