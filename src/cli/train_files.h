// SPDX-License-Identifier: Apache-2.0
// What a training run leaves besides the splats, and what it needs to know for it.
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "ewa/dataset.h"
#include "ewa/exposure.h"
#include "ewa/renderer.h"
#include "report/html.h"
#include "report/pictures.h"
#include "report/summary.h"

namespace ewa::cli {

/// Pictures that a report shows at most.
inline constexpr size_t kReportPictures = 4;

/// At most `count` of the frames, spread evenly, the first among them.
std::vector<int> spread_out(const std::vector<int>& frames, size_t count);

/// What the dataset is called: its folder's name.
std::string dataset_name(const std::filesystem::path& dataset);

struct PictureRequest {
    std::shared_ptr<gpu::Device> device;
    const Gaussians& gaussians;
    const Dataset& dataset;
    const std::vector<int>& frames;
    const RenderOptions& options;
};

/// Draws the frames, saves each as folder/<name>.png, and returns them with their photographs. Throws
/// RunError, InputError.
std::vector<report::ReportPicture> draw_report_pictures(const PictureRequest& request,
                                                        const std::filesystem::path& folder);

/// {name of the photograph: its exposure as three rows of four numbers}; exposures: one for each of the
/// frames.
report::Json exposures_json(const Dataset& dataset, const std::vector<int>& frames,
                            const std::vector<Exposure>& exposures);

void write_report(const std::filesystem::path& path, const report::ReportData& data);

/// Most memory the process has held so far, without what peak_device_bytes counts already: a CPU device's
/// memory is the process's own.
uint64_t peak_host_bytes(const gpu::Device& device);

}  // namespace ewa::cli
