// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>

#include "bench/accuracy.h"
#include "bench/result.h"
#include "core/json.h"
#include "core/text.h"
#include "ewa/error.h"
#include "scene/scene_file.h"

namespace ewa::bench {
namespace {

std::string point_line(const report::WorkSeries& series, const report::WorkPoint& p) {
    return text_of("%-28s %-12s %10.2f  %9.2e %9.2e  %s\n", series.name.c_str(), p.name.c_str(), p.time,
                   p.error, p.worst, p.verdict.c_str());
}

std::string table_text(const report::WorkTable& table) {
    std::string text =
        text_of("\n%s. %s\n\n%-44s", table.title.c_str(), table.note.c_str(), table.columns.front().c_str());
    for (size_t i = 1; i < table.columns.size(); ++i) text += text_of(" %22s", table.columns[i].c_str());
    text += "\n";
    for (const auto& [name, values] : table.rows) {
        text += text_of("%-44s", name.c_str());
        for (const double value : values) text += text_of(" %22.2e", value);
        text += "\n";
    }
    return text;
}

std::string tables_text(const report::WorkPrecision& diagram) {
    std::string text =
        "\nTime: the median of a whole frame. RMS error, worst: over pixels and channels, against the exact "
        "image that the method's name ends with.\n"
        "  opacity: 3DGS's, the same from every side. density: a longer way through a splat absorbs more.\n"
        "on the front: nothing with the same exact image is faster and less wrong.\n\n";
    text +=
        text_of("%-28s %-12s %10s  %9s %9s  %s\n", "method", "effort", "ms", "RMS error", "worst", "verdict");
    for (const report::WorkSeries& series : diagram.series)
        for (const report::WorkPoint& p : series.points) text += point_line(series, p);
    for (const report::WorkTable& table : diagram.tables) text += table_text(table);
    return text;
}

report::WorkTable cause_table(const AccuracyReference& reference) {
    report::WorkTable table{
        "Error of splatting by cause, exact image: " + reference.name,
        {"cause", "alone", "splatting without it"},
        {},
        "RMS error in float64. alone: the exact image with this approximation and no other"};
    for (const Cause& cause : reference.causes)
        table.rows.emplace_back(cause.name, std::vector<double>{cause.alone, cause.without});
    table.rows.emplace_back("all: splatting", std::vector<double>{reference.splatting, reference.splatting});
    return table;
}

report::WorkPrecision diagram_of(const Accuracy& accuracy, const scene::SceneFile& scene,
                                 const std::string& device) {
    report::WorkPrecision diagram;
    diagram.title = "Rendering: error against run time";
    diagram.series = accuracy.series;
    diagram.notes.push_back(
        text_of("%zu splats, %dx%d, on %s. The error is measured at %d pixels against the "
                "emission-absorption integral "
                "of the splats as 3D Gaussians, computed in float64 along each ray (%.1f s).",
                scene.gaussians.size(), scene.camera.width, scene.camera.height, device.c_str(),
                accuracy.pixels, accuracy.exact_seconds));
    diagram.notes.push_back(text_of(
        "Times are of whole frames on the device, with recording and waiting. The march on the host is "
        "C++ in float64 on %u threads; its time at those pixels is scaled to the whole image.",
        accuracy.threads));
    diagram.notes.emplace_back(
        "opacity: exact with 3DGS's opacity, the same from every side. density: exact with a density fixed "
        "per splat, so that a longer way through it absorbs more.");
    for (const AccuracyReference& reference : accuracy.references)
        diagram.tables.push_back(cause_table(reference));
    return diagram;
}

}  // namespace

int run_accuracy(const Options& options) {
    if (options.scene.empty())
        throw InputError("--accuracy needs a scene FILE; ewa bench --accuracy DATASET makes one");
    const scene::SceneFile scene = scene::read_scene_file(options.scene);
    if (scene.gaussians.size() == 0 || scene.camera.width <= 0 || scene.camera.height <= 0)
        throw InputError(core::one_line(options.scene.string()) + ": lacks splats or a camera");
    const auto device = open_device({.selector = options.device});
    const report::WorkPrecision diagram = diagram_of(
        measure_accuracy(device, scene.gaussians, scene.camera, {}), scene, device_info(*device).name);
    print(tables_text(diagram));
    if (options.json.empty()) return 0;
    Json styles = Json::array();
    for (const report::WorkSeries& series : diagram.series)
        styles.push_back({{"dashed", series.dashed}, {"hue", series.hue}});
    core::write_json(options.json,
                     {{"rendering", report::work_precision_json(diagram)}, {"styles", std::move(styles)}});
    return 0;
}

}  // namespace ewa::bench
