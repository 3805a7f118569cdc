// SPDX-License-Identifier: Apache-2.0
// ewa info: the content of a splat file, and the command itself.
#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <memory>

#include "cli/arguments.h"
#include "cli/command.h"
#include "cli/info_dataset.h"
#include "cli/splat_statistics.h"
#include "core/messages.h"
#include "core/text.h"
#include "ewa/dataset.h"
#include "ewa/error.h"
#include "ewa/renderer.h"
#include "ewa/splat_files.h"
#include "ewa/synthetic_dataset.h"
#include "ewa/trainer.h"
#include "report/summary.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;
using report::Json;

Json range_json(const Spread& spread) {
    return {
        {"min", spread.min}, {"median", spread.median}, {"max", spread.max}, {"histogram", spread.histogram}};
}

Json plan_json(const std::vector<PlanLine>& lines) {
    Json json = Json::array();
    for (const PlanLine& line : lines)
        json.push_back({{"what", line.what}, {"why", line.why}, {"bytes_saved", line.bytes_saved}});
    return json;
}

void print_plan(const char* title, const std::vector<PlanLine>& lines) {
    if (lines.empty()) return;
    fmt::print("skipped when {}\n", title);
    for (const PlanLine& line : lines)
        fmt::print("  {}: {}{}\n", line.what, line.why,
                   line.bytes_saved > 0 ? ", saves " + core::bytes_text(line.bytes_saved) : "");
}

void print_spread(const char* name, const Spread& spread) {
    fmt::print("{:<16}{:.4g} .. {:.4g}, median {:.4g}  [{}]\n", name, spread.min, spread.max, spread.median,
               histogram_text(spread));
}

void print_file(const fs::path& path, const SplatScene& scene) {
    fmt::print("{}\nformat          {}{}, {}\n", core::one_line(path.string()), name_of(scene.format),
               scene.variant.empty() ? "" : " (" + scene.variant + ")",
               core::bytes_text(fs::file_size(path)));
    if (scene.antialiased) fmt::print("anti-aliased    yes: render it with --antialias\n");
    for (const std::string& comment : scene.comments)
        fmt::print("comment         {}\n", core::one_line(comment));
    for (const std::string& remark : scene.remarks)
        fmt::print("note            {}\n", core::one_line(remark));
}

void info_splats(const fs::path& path, bool json) {
    const SplatScene scene = read_splats(path);
    const Gaussians& gaussians = scene.gaussians;
    const SplatStatistics statistics = splat_statistics(gaussians);
    TrainOptions options;
    options.strategy = strategy_for(options.steps);
    const auto rendering = plan_lines(gaussians, RenderOptions{});
    const auto training = plan_lines(gaussians, options);
    if (json) {
        const Json out = {{"kind", "splats"},
                          {"format", name_of(scene.format)},
                          {"variant", scene.variant},
                          {"bytes", fs::file_size(path)},
                          {"antialiased", scene.antialiased},
                          {"comments", scene.comments},
                          {"notes", scene.remarks},
                          {"splats", gaussians.size()},
                          {"sh_degree", gaussians.sh_degree},
                          {"file_sh_degree", scene.file_sh_degree},
                          {"sh_degree_present", sh_degree_present(gaussians)},
                          {"bounds", {{"min", statistics.low}, {"max", statistics.high}}},
                          {"opacity", range_json(statistics.opacity)},
                          {"scale", range_json(statistics.scale)},
                          {"nonfinite", statistics.nonfinite},
                          {"plan", {{"rendering", plan_json(rendering)}, {"training", plan_json(training)}}}};
        // Text from the file may not be UTF-8; invalid bytes become U+FFFD.
        fmt::print("{}\n", out.dump(2, ' ', false, Json::error_handler_t::replace));
        return;
    }
    print_file(path, scene);
    fmt::print("splats          {}\n", gaussians.size());
    fmt::print("SH degree       {} stored, {} present\n", gaussians.sh_degree, sh_degree_present(gaussians));
    fmt::print("bounds          ({:.6g}, {:.6g}, {:.6g}) .. ({:.6g}, {:.6g}, {:.6g})\n", statistics.low[0],
               statistics.low[1], statistics.low[2], statistics.high[0], statistics.high[1],
               statistics.high[2]);
    print_spread("opacity", statistics.opacity);
    print_spread("scale", statistics.scale);
    fmt::print("undrawable      {} (a value is not finite, or the quaternion is zero)\n",
               statistics.nonfinite);
    print_plan("rendering", rendering);
    print_plan("training", training);
}

int run(const fs::path& path, int test_every, bool json) {
    std::error_code error;
    if (!fs::exists(path, error)) throw InputError(path.string() + ": no such file or folder");
    if (fs::is_directory(path) || path.extension() == ".json")
        info_dataset(path, test_every, json);
    else if (is_mesh_scene(path))
        info_mesh(path, test_every, json);
    else
        info_splats(path, json);
    return 0;
}

}  // namespace

Action add_info(CLI::App& app) {
    struct Arguments {
        fs::path path;
        int test_every = 8;
        bool json = false;
    };
    const auto arguments = std::make_shared<Arguments>();
    app.add_option(
           "PATH", arguments->path,
           "Splat file (.ply .compressed.ply .splat .spz .glb .gltf), COLMAP folder, transforms.json, or "
           "glTF file of meshes")
        ->required();
    add_test_every_option(app, arguments->test_every);
    app.add_flag("--json", arguments->json, "Print JSON");
    return [arguments] { return run(arguments->path, arguments->test_every, arguments->json); };
}

}  // namespace ewa::cli
