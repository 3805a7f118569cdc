// SPDX-License-Identifier: Apache-2.0
#include "cli/train_files.h"

#include <sys/resource.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

#include "cli/interrupt.h"
#include "cli/output.h"
#include "core/atomic_file.h"

namespace ewa::cli {
namespace fs = std::filesystem;

std::vector<int> spread_out(const std::vector<int>& frames, size_t count) {
    if (frames.size() <= count) return frames;
    std::vector<int> some;
    for (size_t i = 0; i < count; ++i) some.push_back(frames[i * frames.size() / count]);
    return some;
}

std::string dataset_name(const fs::path& dataset) {
    std::error_code error;
    fs::path path = fs::weakly_canonical(dataset, error);
    if (error) path = dataset;
    if (path.has_extension() && !fs::is_directory(path, error)) path = path.parent_path();
    const std::string name = path.filename().string();
    return name.empty() || name == "." || name == ".." ? "dataset" : name;
}

std::vector<report::ReportPicture> draw_report_pictures(const PictureRequest& request,
                                                        const fs::path& folder) {
    const auto names = report::picture_names(request.dataset.frames);
    Renderer renderer(request.device, request.gaussians, request.options);
    std::vector<report::ReportPicture> pictures;
    for (const int index : request.frames) {
        stop_if_interrupted();
        const Frame& frame = request.dataset.frames[index];
        report::ReportPicture picture;
        picture.name = frame.name;
        TrainingImage photograph = load_training_image(frame, request.options.background);
        picture.photograph = std::move(photograph.picture);
        picture.rendering = renderer.render(frame.camera).color;
        picture.psnr = psnr(picture.rendering, picture.photograph, photograph.weights);
        if (std::isnan(picture.psnr)) continue;  // no pixel counts
        picture.ssim = ssim(picture.rendering, picture.photograph, photograph.weights);
        const fs::path file = folder / (names[index].string() + ".png");
        make_folder(file.parent_path());
        save_image(file, picture.rendering);
        pictures.push_back(std::move(picture));
    }
    return pictures;
}

report::Json exposures_json(const Dataset& dataset, const std::vector<int>& frames,
                            const std::vector<Exposure>& exposures) {
    report::Json json = report::Json::object();
    for (size_t i = 0; i < exposures.size(); ++i) {
        report::Json& rows = json[dataset.frames[size_t(frames[i])].name];
        for (size_t row = 0; row < 3; ++row) {
            const float* r = &exposures[i][4 * row];
            rows.push_back({r[0], r[1], r[2], r[3]});
        }
    }
    return json;
}

void write_report(const fs::path& path, const report::ReportData& data) {
    core::write_text_file(path, report::html_report(data));
}

uint64_t peak_host_bytes(const gpu::Device& device) {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const uint64_t resident = static_cast<uint64_t>(usage.ru_maxrss) * 1024;  // Linux counts in KiB
    const uint64_t on_device = device_info(device).type == "cpu" ? peak_device_bytes(device) : 0;
    return resident - std::min(resident, on_device);
}

}  // namespace ewa::cli
