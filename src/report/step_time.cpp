// SPDX-License-Identifier: Apache-2.0
#include "report/step_time.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <string_view>

#include "report/chart.h"

namespace ewa::report {
namespace {

struct Stage {
    const char *name, *what;
    std::vector<std::string_view> passes;
};

const std::vector<Stage>& stages() {
    static const std::vector<Stage> all = {
        {"project",
         "finds where each splat is in the image, its shape and its colour",
         {"project", "project_points", "project_rays", "band_tiles", "collect_visible", "receive_records"}},
        {"sort",
         "orders the splats by depth, and lists those of each tile of the image",
         {"fill counters", "depth order", "instance offsets", "emit_instances", "tile order", "tile_starts",
          "copy digit totals"}},
        {"blend",
         "renders the view, each tile from front to back",
         {"blend", "blend_points", "blend_rays", "blend_fast_rays"}},
        {"sky", "puts the sky behind the splats, and learns it", {"add_sky", "sky_gradient", "sky_update"}},
        {"appearance",
         "gives the render the look of its training image, and learns the look",
         {"ppisp", "ppisp_backward", "ppisp_update", "ppisp_camera_update", "grid_slice",
          "grid_slice_backward", "grid_gradient", "grid_update"}},
        {"loss",
         "compares the render with the training image, and finds how each pixel should change",
         {"unpack_target", "mask_images", "loss_columns", "loss_rows", "reduce", "loss_backward_columns",
          "loss_backward_rows", "alpha_loss", "depth_loss", "mask_gradient"}},
        {"blend backward",
         "finds how each splat should change for that",
         {"blend_backward", "blend_points_backward", "blend_rays_backward", "blend_fast_rays_backward"}},
        {"update",
         "changes the splats (Adam)",
         {"sum_slots", "update", "update_points", "update_rays", "update_views"}},
        {"camera", "moves and learns the cameras", {"move_camera", "motion_update"}},
        {"noise", "moves splats at random, to find better places (MCMC)", {"perturb"}}};
    return all;
}

// A shorter time, in ms, has no row of its own.
constexpr double kShown = 0.0005;

std::string row(const StageTime& stage, double step, double longest) {
    return fmt::format(
        "<tr><td><b>{}</b> <span class=\"soft\">{}</span></td><td class=\"number\">{:.3f}</td>"
        "<td class=\"number\">{:.1f} %</td><td class=\"bar\"><i style=\"width:{:.1f}%\"></i></td></tr>\n",
        escape_html(stage.name), escape_html(stage.what), stage.milliseconds,
        step > 0 ? 100 * stage.milliseconds / step : 0, longest > 0 ? 100 * stage.milliseconds / longest : 0);
}

std::string single_passes(const std::vector<NamedTime>& passes) {
    std::string html = "<details><summary>Single passes on the device, as measured</summary>\n<table>";
    for (const NamedTime& pass : passes)
        html += fmt::format("<tr><td>{}</td><td class=\"number\">{:.3f}</td></tr>\n", escape_html(pass.name),
                            pass.milliseconds);
    return html + "</table></details>\n";
}

}  // namespace

std::vector<StageTime> stages_of(const StepTime& time) {
    double measured = 0;
    for (const NamedTime& pass : time.passes) measured += pass.milliseconds;
    const double available = std::max(0.0, time.step - time.refinement);
    const double scale = measured > available ? available / measured : 1;

    std::vector<StageTime> result;
    double named = 0;
    for (const Stage& stage : stages()) {
        double sum = 0;
        for (const NamedTime& pass : time.passes)
            if (std::find(stage.passes.begin(), stage.passes.end(), pass.name) != stage.passes.end())
                sum += pass.milliseconds * scale;
        if (sum > 0) result.push_back({stage.name, stage.what, sum});
        named += sum;
    }
    if (const double others = measured * scale - named; others >= kShown)
        result.push_back({"other passes", "clear and copy buffers", others});
    if (time.refinement >= kShown)
        result.push_back({"refinement", "adds, moves and removes splats every few steps", time.refinement});
    double rest = time.step;
    for (const StageTime& stage : result) rest -= stage.milliseconds;
    result.push_back({"host and waiting", "prepares the step on the processor, and waits for the device",
                      std::max(0.0, rest)});
    return result;
}

std::string chunks_html(const std::optional<ChunkFigures>& chunks) {
    if (!chunks) return "";
    return fmt::format(
        "<h2>Larger than the device</h2>\n<p>The splats take {:.1f} MiB, and the device was to take at most "
        "{:.1f} "
        "MiB. They were in {} chunks. A step copied {:.1f} MiB to the device and back, in {:.1f} ms.</p>\n",
        double(chunks->state_bytes) / (1 << 20), double(chunks->limit) / (1 << 20), chunks->chunks,
        chunks->streamed_bytes / (1 << 20), chunks->streaming);
}

std::string ranks_html(const std::vector<RankFigures>& ranks) {
    if (ranks.empty()) return "";
    std::string html =
        "<h2>What the ranks exchanged</h2>\n<table class=\"times\"><tr><th>rank</th>"
        "<th class=\"number\">sent, KiB a view</th><th class=\"number\">moving data, ms a view</th>"
        "<th class=\"number\">waiting, ms a view</th><th class=\"number\">state of its splats, MiB</th>"
        "<th class=\"number\">peak device memory, MiB</th></tr>\n";
    for (const RankFigures& rank : ranks)
        html += fmt::format(
            "<tr><td>{}</td><td class=\"number\">{:.1f}</td><td class=\"number\">{:.3f}</td>"
            "<td class=\"number\">{:.3f}</td><td class=\"number\">{:.1f}</td><td class=\"number\">{:.1f}</td>"
            "</tr>\n",
            escape_html(rank.name), rank.sent_bytes / 1024, rank.exchange, rank.waiting,
            rank.own_bytes / (1 << 20), rank.peak_device_bytes / (1 << 20));
    return html +
           "</table>\n<p class=\"soft\">A rank waits until the others have come as far as it has.</p>\n";
}

std::string step_time_html(const StepTime& time, int earlier) {
    if (time.steps == 0 || !(time.step > 0)) return "";
    const std::vector<StageTime> all = stages_of(time);
    double longest = 0;
    for (const StageTime& stage : all) longest = std::max(longest, stage.milliseconds);
    std::string html =
        "<h2>Where the time of a step goes</h2>\n<table class=\"times\"><tr><th>part of a step</th>"
        "<th class=\"number\">ms</th><th class=\"number\">share</th><th class=\"bar\"></th></tr>\n";
    for (const StageTime& stage : all) html += row(stage, time.step, longest);
    html += fmt::format(
        "<tr><td><b>a step</b></td><td class=\"number\">{:.3f}</td><td></td><td class=\"bar\"></td></tr>\n"
        "</table>\n<p class=\"soft\">Means over {} steps{}. Where steps overlap on the device, its passes "
        "are "
        "timed "
        "in every 100th step.</p>\n",
        time.step, time.steps,
        earlier > 0 ? fmt::format(", after the run was resumed at step {}", earlier) : "");
    if (time.host > 0)
        html += fmt::format(
            "<p class=\"soft\">The processor records and submits the commands of a step in {:.3f} ms.</p>\n",
            time.host);
    return html + single_passes(time.passes);
}

}  // namespace ewa::report
