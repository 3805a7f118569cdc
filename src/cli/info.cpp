// SPDX-License-Identifier: Apache-2.0
// ewa info: what a splat file, a training run, a dataset, a mesh scene or an image holds.
#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <optional>
#include <string_view>

#include "capture/what_is.h"
#include "cli/arguments.h"
#include "cli/camera_groups.h"
#include "cli/command.h"
#include "cli/output.h"
#include "cli/run_inputs.h"
#include "cli/splat_statistics.h"
#include "core/folders.h"
#include "core/json_field.h"
#include "core/messages.h"
#include "core/text.h"
#include "ewa/capture.h"
#include "ewa/error.h"
#include "ewa/renderer.h"
#include "ewa/splat_files.h"
#include "ewa/synthetic_dataset.h"
#include "ewa/trainer.h"
#include "folders/run_folder.h"
#include "image/image_files.h"
#include "io/datasets/importers/importer.h"
#include "io/gltf/mesh.h"
#include "io/splats/format_table.h"
#include "io/splats/formats.h"
#include "io/splats/place.h"
#include "io/splats/zip_files.h"
#include "io/splats/zipped_splats.h"
#include "report/summary.h"
#include "run/first_checks.h"
#include "scene/splat_arrays.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;
using report::Json;

struct InfoArguments {
    fs::path path;
    int test_every = 8;
    bool json = false, verbose = false;
};

Json range_json(const Spread& spread) {
    return {{"min", spread.min}, {"median", spread.median}, {"max", spread.max}};
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
    fmt::print("{:<16}{:.4g} .. {:.4g}, median {:.4g}\n", name, spread.min, spread.max, spread.median);
}

void print_file(const fs::path& path, const SplatScene& scene) {
    fmt::print("{}\nformat          {}{}, {}\n", core::one_line(path.string()), name_of(scene.format),
               scene.variant.empty() ? "" : " (" + scene.variant + ")",
               core::bytes_text(fs::file_size(path)));
    fmt::print("opens in        {}\n", readers_of(scene.format));
    if (scene.antialiased) fmt::print("anti-aliased    yes: drawn as with --kernel antialias\n");
    if (scene.gaussians.density)
        fmt::print("kernel          density; opacities in the file are fitted to 3DGS's kernel\n");
    for (const std::string& comment : scene.comments)
        fmt::print("comment         {}\n", core::one_line(comment));
    for (const std::string& remark : scene.remarks)
        fmt::print("note            {}\n", core::one_line(remark));
}

/// The members of summary.json; empty if the run has not ended.
Json summary_of(const folders::Run& run) {
    try {
        Json summary = core::read_json_file<Json>(run.folder / folders::kSummaryFile, {.bytes = 1u << 20});
        if (summary.is_object()) return summary;
    } catch (const InputError&) {
        // It is written at the end.
    }
    return Json::object();
}

void add_run(Json& json, const folders::Run& run) {
    json["kind"] = "run";
    json["run"] = {{"folder", run.folder.string()},
                   {"dataset", run.named_dataset},
                   {"dataset_found", !run.dataset.empty()},
                   {"options", run.config},
                   {"summary", summary_of(run)}};
}

void print_run(const folders::Run& run) {
    fmt::print("{}\nkind            training run\n", core::one_line(run.folder.string()));
    if (!run.named_dataset.empty())
        fmt::print("dataset         {}{}\n", core::one_line(run.named_dataset),
                   run.dataset.empty() ? " (not found)" : "");
    const Json summary = summary_of(run);
    if (const auto steps = core::number_in(summary, "steps")) fmt::print("steps           {:.0f}\n", *steps);
    if (const auto psnr = core::number_in(summary, "test_psnr"))
        fmt::print("test PSNR       {:.3f} dB\n", *psnr);
}

/// run: the training run that the file is of; null: unknown.
void info_splats(const fs::path& path, const folders::Run* run, const InfoArguments& arguments) {
    const SplatScene scene = read_splats(path);
    const Gaussians& gaussians = scene.gaussians;
    const SplatStatistics statistics = splat_statistics(gaussians);
    TrainOptions options;
    options.strategy = strategy_for(options.steps);
    const auto rendering = plan_lines(gaussians, RenderOptions{});
    const auto training = plan_lines(gaussians, options);
    if (arguments.json) {
        Json out = {{"kind", "splats"},
                    {"format", name_of(scene.format)},
                    {"variant", scene.variant},
                    {"readers", readers_of(scene.format)},
                    {"bytes", fs::file_size(path)},
                    {"antialiased", scene.antialiased},
                    {"density", gaussians.density},
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
        if (run) add_run(out, *run);
        return print_json(out);
    }
    if (run) print_run(*run);
    print_file(path, scene);
    fmt::print("splats          {}\n", gaussians.size());
    fmt::print("SH degree       {} stored, {} present\n", gaussians.sh_degree, sh_degree_present(gaussians));
    fmt::print("bounds          ({:.6g}, {:.6g}, {:.6g}) .. ({:.6g}, {:.6g}, {:.6g})\n", statistics.low[0],
               statistics.low[1], statistics.low[2], statistics.high[0], statistics.high[1],
               statistics.high[2]);
    print_spread("opacity", statistics.opacity);
    print_spread("scale", statistics.scale);
    if (statistics.nonfinite > 0)
        fmt::print("undrawable      {} (a value is not finite, or the quaternion is zero: {})\n",
                   core::counted(statistics.nonfinite, "splat"), scene::undrawable_text(gaussians));
    if (!arguments.verbose) return;
    print_plan("rendering", rendering);
    print_plan("training", training);
}

void print_rolling(const Dataset& dataset) {
    if (const auto rolling = rolling_of(dataset))
        fmt::print("rolling shutter {}, {}; a camera turns by {:.3g} degrees and moves by {:.3g} (medians)\n",
                   core::counted(uint64_t(rolling->frames), "frame"), rolling->order, rolling->degrees,
                   rolling->distance);
}

/// What would be wrong with a training on it.
std::vector<std::string> warnings_of(const Dataset& dataset, const Split& split,
                                     const std::vector<int>& every) {
    std::vector<std::string> warnings;
    if (dataset.frame_rate > 0) return warnings;
    std::string nothing = train::nothing_to_train_on(dataset, split);
    if (!nothing.empty()) warnings.push_back(std::move(nothing));
    const auto& points = dataset.points.positions;
    for (const auto& findings :
         {train::check_images(dataset, split, false),
          train::check_start(dataset, every, {points.size(), [&](size_t i) { return points[i]; }})})
        for (const train::Finding& finding : findings) warnings.push_back(finding.text);
    return warnings;
}

Json dataset_json(const Dataset& dataset, const Split& split, double extent,
                  const std::vector<std::string>& warnings) {
    Json cameras = Json::array();
    for (const CameraGroup& group : camera_groups(dataset))
        cameras.push_back({{"frames", group.frames},
                           {"width", group.camera.width},
                           {"height", group.camera.height},
                           {"fx", group.camera.fx},
                           {"fy", group.camera.fy},
                           {"cx", group.camera.cx},
                           {"cy", group.camera.cy},
                           {"lens", lens_name(group.lens).word},
                           {"distorted", group.distorted}});
    Json used = Json::array();
    for (const UsedOf& kind : dataset.used)
        used.push_back({{"what", kind.what},
                        {"used", kind.used},
                        {"found", kind.found},
                        {"where", kind.where},
                        {"why", kind.why}});
    Json json{{"kind", dataset.format},
              {"program", dataset.program},
              {"notes", dataset.notes},
              {"used", used},
              {"warnings", warnings},
              {"frames", dataset.frames.size()},
              {"missing_images", dataset.missing_images},
              {"cameras", cameras},
              {"points", dataset.points.positions.size()},
              {"dropped_points", dataset.dropped_points},
              {"color_depends_on_view", dataset.color_depends_on_view},
              {"extent", extent},
              {"train", split.train.size()},
              {"test", split.test.size()}};
    if (const auto place = io::read_place(dataset.root))
        json["place"] = {
            {"latitude", place->latitude}, {"longitude", place->longitude}, {"height", place->height}};
    if (const auto rolling = rolling_of(dataset))
        json["rolling_shutter"] = {{"frames", rolling->frames},
                                   {"order", rolling->order},
                                   {"degrees", rolling->degrees},
                                   {"distance", rolling->distance}};
    return json;
}

void print_cameras(const Dataset& dataset) {
    constexpr size_t kShown = 4;
    const auto groups = camera_groups(dataset);
    for (size_t i = 0; i < std::min(kShown, groups.size()); ++i) {
        const Camera& c = groups[i].camera;
        fmt::print("{:<16}{}x{}, fx {:.6g}, fy {:.6g}, cx {:.6g}, cy {:.6g}{} ({})\n",
                   i == 0 ? "cameras" : "", c.width, c.height, c.fx, c.fy, c.cx, c.cy,
                   groups[i].lens.none()
                       ? std::string()
                       : fmt::format(", {} {}",
                                     groups[i].distorted ? "undistorted on loading from" : "rendered through",
                                     lens_name(groups[i].lens).text),
                   core::counted(uint64_t(groups[i].frames), "frame"));
    }
    if (groups.size() > kShown) fmt::print("{:<16}and {} more\n", "", groups.size() - kShown);
}

Json support_json(const Dataset& dataset, const std::vector<CameraSupport>& supports) {
    Json photos = Json::array();
    for (size_t i = 0; i < supports.size(); ++i) {
        Json neighbors = Json::array();
        for (const auto& [frame, points] : supports[i].neighbors)
            neighbors.push_back({{"name", dataset.frames[size_t(frame)].name}, {"points", points}});
        photos.push_back({{"name", dataset.frames[i].name},
                          {"points", supports[i].points},
                          {"error", supports[i].error},
                          {"neighbors", neighbors}});
    }
    return photos;
}

/// What holds the cameras: of all photos, else of those with the fewest points and the largest error.
void print_support(const Dataset& dataset, const std::vector<CameraSupport>& supports, bool all) {
    if (supports.empty()) return;
    const auto print = [&](const char* title, size_t i) {
        fmt::print("{:<16}{}: {}\n", title, core::one_line(dataset.frames[i].name),
                   support_text(dataset, supports[i]));
    };
    if (all) {
        for (size_t i = 0; i < supports.size(); ++i) print(i == 0 ? "photos" : "", i);
        return;
    }
    const auto fewest = std::ranges::min_element(supports, {}, &CameraSupport::points),
               worst = std::ranges::max_element(supports, {}, &CameraSupport::error);
    print("fewest points", size_t(fewest - supports.begin()));
    if (worst->error > 0) print("largest error", size_t(worst - supports.begin()));
}

/// named: what the user calls it.
void info_dataset(const fs::path& path, const fs::path& named, const InfoArguments& arguments) {
    const int test_every = arguments.test_every;
    const Dataset dataset = load_cameras_as_trained(path, {}, true);
    const Split split = split_frames(dataset, test_every);
    std::vector<int> every(dataset.frames.size());
    std::iota(every.begin(), every.end(), 0);
    const double extent = every.empty() ? 0 : scene_extent(dataset, every);
    const std::vector<std::string> warnings = warnings_of(dataset, split, every);
    const std::vector<CameraSupport> supports = camera_support(dataset);
    if (arguments.json) {
        Json json = dataset_json(dataset, split, extent, warnings);
        json["photos"] = support_json(dataset, supports);
        return print_json(json);
    }
    fmt::print("{}\nkind            {}\n", core::one_line(named.string()), dataset.format);
    if (!dataset.program.empty()) fmt::print("program         {}\n", core::one_line(dataset.program));
    for (const std::string& note : dataset.notes) fmt::print("note            {}\n", core::one_line(note));
    if (const auto place = io::read_place(dataset.root))
        fmt::print("place           latitude {}, longitude {}, height {:.1f} m, of the world's origin\n",
                   place->latitude, place->longitude, place->height);
    if (!dataset.used.empty()) fmt::print("used            {}\n", used_text(dataset));
    for (const std::string& warning : warnings) fmt::print("warning         {}\n", core::one_line(warning));
    if (dataset.frame_rate > 0)  // a path, which is drawn and not trained on
        fmt::print("frames          {}, {:.6g} per second\n", dataset.frames.size(), dataset.frame_rate);
    else
        fmt::print("frames          {} ({} train, {} test with --test-every {})\n", dataset.frames.size(),
                   split.train.size(), split.test.size(), test_every);
    if (dataset.missing_images > 0)
        fmt::print("images          {} missing; their frames are skipped unless all images are missing\n",
                   dataset.missing_images);
    print_cameras(dataset);
    print_rolling(dataset);
    fmt::print("points          {}{}\n", dataset.points.positions.size(),
               dataset.dropped_points == 0
                   ? std::string()
                   : fmt::format(" ({} dropped: a coordinate is not finite)", dataset.dropped_points));
    print_support(dataset, supports, arguments.verbose);
    if (!dataset.color_depends_on_view)
        fmt::print("colour          does not depend on the view: training skips SH degrees 1 to {}\n",
                   kMaxShDegree);
    fmt::print("extent          {:.6g} (1.1 times the largest distance of a camera from their mean)\n",
               extent);
}

void info_mesh(const fs::path& path, int test_every, bool json) {
    const scene::MeshScene scene = io::read_gltf_mesh(path);
    const Dataset views = scene_cameras(path, {});
    const Split split = split_frames(views, test_every);
    const scene::Box box = scene::bounds_of(scene);
    const auto bytes = fs::file_size(path);
    // The last material is the default of triangles that name none.
    const size_t materials = scene.materials.size() - 1;
    if (json) {
        const Json out = {
            {"kind", "mesh scene"},
            {"bytes", bytes},
            {"triangles", scene.triangles.size()},
            {"dropped_triangles", scene.dropped_triangles},
            {"materials", materials},
            {"textures", scene.textures.size()},
            {"images", scene.images.size()},
            {"lights", scene.lights.size()},
            {"cameras", scene.cameras.size()},
            {"bounds",
             {{"min", {box.low.x, box.low.y, box.low.z}}, {"max", {box.high.x, box.high.y, box.high.z}}}},
            {"views", views.frames.size()},
            {"train", split.train.size()},
            {"test", split.test.size()},
            {"color_depends_on_view", views.color_depends_on_view},
            {"notes", scene.remarks}};
        return print_json(out);
    }
    fmt::print("{}\nkind            mesh scene (glTF), {}\n", core::one_line(path.string()),
               core::bytes_text(bytes));
    for (const std::string& remark : scene.remarks)
        fmt::print("note            {}\n", core::one_line(remark));
    fmt::print("triangles       {}{}\n", scene.triangles.size(),
               scene.dropped_triangles == 0
                   ? std::string()
                   : fmt::format(" ({} more {} skipped: a corner is not finite)", scene.dropped_triangles,
                                 core::is_or_are(scene.dropped_triangles)));
    fmt::print("materials       {}, with {} of {}\n", materials,
               core::counted(scene.textures.size(), "texture"), core::counted(scene.images.size(), "image"));
    fmt::print("lights          {}, and the sky\n", scene.lights.size());
    fmt::print("bounds          ({:.6g}, {:.6g}, {:.6g}) .. ({:.6g}, {:.6g}, {:.6g})\n", box.low.x, box.low.y,
               box.low.z, box.high.x, box.high.y, box.high.z);
    fmt::print("views           {} of {} ({} train, {} test with --test-every {})\n", views.frames.size(),
               views.frames.size() == scene.cameras.size() ? "the file's cameras" : "a dome over it",
               split.train.size(), split.test.size(), test_every);
    fmt::print("colour          {}\n", views.color_depends_on_view
                                           ? "depends on the view"
                                           : "every material is diffuse: training skips SH degrees 1 to 3");
}

void info_image(const fs::path& path, std::string_view format, bool json) {
    const ImageSize size = read_image_size(path);
    const auto bytes = fs::file_size(path);
    if (json)
        return print_json({{"kind", "image"},
                           {"format", format},
                           {"bytes", bytes},
                           {"width", size.width},
                           {"height", size.height},
                           {"orientation", size.orientation},
                           {"eight_bit", size.eight_bit}});
    fmt::print("{}\nkind            image ({}), {}\nsize            {}x{}, {}\n",
               core::one_line(path.string()), format, core::bytes_text(bytes), size.width, size.height,
               size.eight_bit ? "8 bits a channel" : "more than 8 bits a channel");
    if (size.orientation != 1)
        fmt::print("orientation     {} in EXIF: to be turned or mirrored when shown\n", size.orientation);
}

/// Photos or videos that have no cameras yet.
void info_capture(const fs::path& path, bool json) {
    const CaptureContents contents = capture_contents(path);
    const ImageSize size = smallest_image(path);
    if (json)
        return print_json({{"kind", "capture"},
                           {"contents", contents.text},
                           {"masks", contents.masks},
                           {"width", size.width},
                           {"height", size.height}});
    fmt::print("{}\nkind            {} without cameras; ewa train finds them first, ewa cameras alone\n",
               core::one_line(path.string()), contents.text);
    if (!contents.masks.empty()) fmt::print("masks           {}\n", contents.masks);
    if (size.width > 0) fmt::print("smallest image  {}x{}\n", size.width, size.height);
}

void info_archive(const fs::path& path, const InfoArguments& arguments) {
    if (!archive_has_cameras(path) && io::has_splats(io::ZipFiles(path)))
        return info_splats(path, nullptr, arguments);
    read_archive(path, [&](const fs::path& folder) { info_dataset(folder, path, arguments); });
}

int run(const InfoArguments& arguments) {
    const fs::path& path = arguments.path;
    switch (what_is(path)) {
        case What::run: {
            const SplatInput input = splat_input(path);
            info_splats(input.file, &*input.run, arguments);
            break;
        }
        case What::photos:
        case What::video:
            info_capture(path, arguments.json);
            break;
        case What::archive:
            info_archive(path, arguments);
            break;
        case What::image:
            info_image(path, image_format(path), arguments.json);
            break;
        case What::mesh:
            info_mesh(path, arguments.test_every, arguments.json);
            break;
        case What::nothing:
            if (!core::is_folder(path)) throw InputError(path.string() + ": no such file or folder");
            [[fallthrough]];  // the reader of datasets says what is missing
        case What::dataset:
            info_dataset(path, path, arguments);
            break;
        case What::splats:
            if (const std::string advice = io::export_advice(path); !advice.empty())
                throw InputError(core::one_line(path.string()) + ": not a dataset: " + advice);
            info_splats(path, nullptr, arguments);
    }
    return 0;
}

}  // namespace

Action add_info(CLI::App& app) {
    const auto arguments = std::make_shared<InfoArguments>();
    options::add(app, "PATH", arguments->path);
    options::add(app, "test-every", arguments->test_every);
    options::add(app, "json", arguments->json);
    options::add(app, "verbose", arguments->verbose);
    return [arguments] { return run(*arguments); };
}

}  // namespace ewa::cli
