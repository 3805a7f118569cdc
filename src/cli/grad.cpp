// SPDX-License-Identifier: Apache-2.0
// ewa grad: the training loss of one view, and its gradient with respect to every stored value.
#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include <memory>
#include <nlohmann/json.hpp>

#include "cli/arguments.h"
#include "cli/command.h"
#include "cli/output.h"
#include "cli/run_inputs.h"
#include "cli/splat_statistics.h"
#include "core/text.h"
#include "ewa/error.h"
#include "ewa/renderer.h"
#include "ewa/splat_files.h"
#include "scene/dataset_files.h"
#include "scene/readout.h"
#include "scene/splat_arrays.h"

namespace ewa::cli {
namespace {

struct GradArguments {
    ViewArguments views;
    std::filesystem::path output, json;
    std::string frame;
    RunOptions run;  // of which it has the loss
};

/// dL/d(each value of the camera's motion).
report::Json motion_json(const CameraMotion& m, bool rolling) {
    const auto list = [](const glm::dvec3& v) { return report::Json{v.x, v.y, v.z}; };
    if (rolling)
        return {{"rotation", list(m.rotation)},
                {"shift", list(m.shift)},
                {"readout_turn", list(m.readout_turn)},
                {"readout_shift", list(m.readout_shift)}};
    return {{"rotation", list(m.rotation)}, {"shift", list(m.shift)}, {"log_focal", m.log_focal}};
}

int run(const CLI::App& app, const GradArguments& arguments) {
    RenderOptions options = arguments.views.draw.options();
    if (format_of_name(arguments.output) != SplatFormat::ply)
        throw InputError("--output " + arguments.output.string() +
                         ": a gradient is written as .ply; the other formats cannot store it");
    if (arguments.output.extension() != ".ply")
        throw InputError("the gradient is written as a PLY: -o " + arguments.output.string() +
                         " does not end in .ply");
    check_typed_outputs(app);
    const Gaussians gaussians = arguments.views.draw.load(arguments.views.splats, options);
    const auto [dataset, refined, frames, folder] = load_views(arguments.views, arguments.frame, 0);
    if (frames.size() > 1) throw InputError("--frame: '" + arguments.frame + "' is more than one frame");
    check_typed_outputs(app, {}, scene::files_of(dataset, "DATASET"));
    const int index = frames.front();
    const Frame& frame = dataset.frames[size_t(index)];
    make_folder(arguments.output.parent_path());

    const LossWeights& weights = arguments.run.train.loss;
    const LossGradient result =
        loss_gradient(open_device(arguments.views.device), gaussians, frame.camera, load_frame_image(frame),
                      options, frame.masks == MaskUse::ignore, weights);
    save_splats(arguments.output, result.gradient,
                {"ewa " EWA_VERSION, fmt::format("gradient of the training loss of frame {}", index)});
    if (!arguments.json.empty()) {
        report::Json json{{"loss", result.loss}, {"l1", result.l1}};
        if (weights.l2 > 0) json["l2"] = result.l2;
        if (weights.ssim > 0) json["ssim"] = result.ssim;
        if (result.weights.alpha > 0) json["alpha"] = result.alpha;
        if (options.integrator == Integrator::splat && !options.points)
            json["camera"] = motion_json(result.camera, scene::moves(frame.camera));
        json["frame"] = index;
        json["name"] = frame.name;
        write_json(arguments.json, json);
    }
    fmt::print("{}  loss {:.7g}  L1 {:.7g}{}{}\n", core::one_line(frame.name), result.loss, result.l1,
               weights.l2 > 0 ? fmt::format("  L2 {:.7g}", result.l2) : "",
               weights.ssim > 0 ? fmt::format("  SSIM {:.7g}", result.ssim) : "");
    if (result.skipped_nonfinite > 0)
        fmt::print("{}\n", skipped_text(result.skipped_nonfinite, scene::undrawable_text(gaussians)));
    fmt::print("the gradient of {} is in {}\n", core::counted(result.gradient.size(), "splat"),
               core::one_line(arguments.output.string()));
    return 0;
}

}  // namespace

Action add_grad(CLI::App& app) {
    const auto arguments = std::make_shared<GradArguments>();
    add_view_positionals(app, arguments->views);
    options::add(app, "frame", arguments->frame)
        ->check(CLI::Validator(
            [](const std::string& text) {
                const bool below = core::parse_integer<int>(text).value_or(0) < 0;
                return below ? "'" + text + "' is no frame: frames are numbered from 0" : std::string();
            },
            ""));
    options::add(app, "output", arguments->output);
    options::add(app, "json", arguments->json);
    options::add(app, "loss", arguments->run);
    add_view_options(app, arguments->views);
    return [&app, arguments] {
        resolve_views(app, arguments->views);
        return run(app, *arguments);
    };
}

}  // namespace ewa::cli
