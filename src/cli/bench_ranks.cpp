// SPDX-License-Identifier: Apache-2.0
#include "cli/bench_ranks.h"

#include <spdlog/fmt/fmt.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "cli/arguments.h"
#include "cli/output.h"
#include "cli/run_inputs.h"
#include "ewa/error.h"
#include "ewa/splat_files.h"
#include "ewa/trainer.h"
#include "ranks/open.h"
#include "ranks/scaling.h"
#include "reference/projection.h"
#include "train/share_machine.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;
using ranks::Network;
using ranks::StepCost;
using ranks::ViewCost;

constexpr std::chrono::seconds kPatience{300};
const std::vector<uint64_t> kTransferBytes = {4 << 10, 64 << 10, 1 << 20, 4 << 20, 16 << 20, 64 << 20};
constexpr int kPredicted[] = {1, 2, 4, 8, 16, 64};

/// The share of the splats whose footprint meets the image.
double visible_share(const Gaussians& gaussians, const Camera& camera) {
    const double cut = std::sqrt(2 * std::log(255.0));  // standard deviations, of an opaque splat
    size_t visible = 0;
    for (size_t i = 0; i < gaussians.size(); ++i) {
        const auto p = reference::project(gaussians, i, camera, {});
        const double x = cut * std::sqrt(p.a), y = cut * std::sqrt(p.c);
        visible += p.visible && p.mean2d.x + x > 0 && p.mean2d.x - x < camera.width && p.mean2d.y + y > 0 &&
                   p.mean2d.y - y < camera.height;
    }
    return double(visible) / double(gaussians.size());
}

/// The times of training steps in ms, on all devices at once: those of the slowest device.
std::vector<double> slowest_steps(Ranks& ranks, Trainer& trainer) {
    constexpr int kWarmUp = 3;
    constexpr size_t kSteps = 40;
    while (trainer.steps_done() < kWarmUp) trainer.step();
    trainer.report();  // waits for the device
    std::vector<uint64_t> own;
    while (own.size() < kSteps) {
        const auto begin = std::chrono::steady_clock::now();
        trainer.step();
        trainer.report();
        const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - begin;
        own.push_back(std::bit_cast<uint64_t>(time.count()));
    }
    const std::vector<uint64_t> all = ranks.gather(own);
    std::vector<double> slowest;
    const auto sum = [](const std::vector<double>& times) {
        return std::accumulate(times.begin(), times.end(), 0.0);
    };
    for (size_t first = 0; first < all.size(); first += kSteps) {
        std::vector<double> times;
        for (size_t i = 0; i < kSteps; ++i) times.push_back(std::bit_cast<double>(all[first + i]));
        if (sum(times) > sum(slowest)) slowest = std::move(times);
    }
    return slowest;
}

ViewCost measure_view(Ranks& ranks, const fs::path& dataset_path, const fs::path& splats,
                      const std::string& selector) {
    constexpr size_t kViews = 8;
    DeviceOptions device{.selector = selector};
    train::share_machine(ranks, device);
    Gaussians gaussians = load_splats(splat_input(splats).file);
    const Dataset dataset = load_cameras_as_trained(dataset_input(dataset_path), 1);
    std::vector<int> frames(dataset.frames.size());
    std::iota(frames.begin(), frames.end(), 0);
    TrainOptions options;
    options.strategy = Strategy::none;
    options.sh_degree = gaussians.sh_degree;
    options.max_splats = uint32_t(gaussians.size());
    ViewCost cost{.splats = double(gaussians.size())};
    const size_t views = std::min(kViews, frames.size());
    for (size_t i = 0; i < views; ++i)
        cost.visible +=
            visible_share(gaussians, dataset.frames[i * frames.size() / views].camera) / double(views);
    Trainer trainer(open_device(device), dataset, frames, std::move(gaussians), options);
    cost.views = slowest_steps(ranks, trainer);
    cost.milliseconds =
        std::accumulate(cost.views.begin(), cost.views.end(), 0.0) / double(cost.views.size());
    return cost;
}

void print_network(const Ranks& ranks, const Network& network) {
    fmt::print("{} ranks: {} to {}\ngather of a number from each rank: {:.3f} ms\n\n", ranks.size(),
               ranks.name(0), ranks.name(ranks.size() - 1), network.gather_ms);
    fmt::print("{:>14} {:>10} {:>10}\n", "bytes a rank", "ms", "MB/s");
    for (const ranks::Transfer& one : network.transfers)
        fmt::print("{:>14} {:>10.3f} {:>10.0f}\n", one.bytes, one.milliseconds,
                   double(one.bytes) / one.milliseconds / 1000);
}

void print_costs(const ViewCost& view, const std::vector<StepCost>& costs) {
    fmt::print(
        "\n{:.0f} splats, of which a view sees {:.0f} %; {:.1f} ms a view\n"
        "predicted, with as many views a step as ranks:\n\n{:>6} {:>12} {:>12} {:>12} {:>10} {:>10} {:>11}\n",
        view.splats, view.visible * 100, view.milliseconds, "ranks", "MB a rank", "slowest ms", "exchange ms",
        "step ms", "views/s", "efficiency");
    for (const StepCost& cost : costs)
        fmt::print("{:>6} {:>12.2f} {:>12.1f} {:>12.2f} {:>10.1f} {:>10.2f} {:>9.0f} %\n", cost.ranks,
                   cost.sent_bytes / 1e6, cost.slowest_ms, cost.exchange_ms, cost.step_ms,
                   cost.views_per_second, cost.efficiency * 100);
}

report::Json json_of(const Network& network, const ViewCost& view, const std::vector<StepCost>& costs) {
    report::Json json{{"ranks", network.ranks}, {"gather_ms", network.gather_ms}};
    for (const ranks::Transfer& one : network.transfers)
        json["transfers"].push_back({{"bytes", one.bytes}, {"ms", one.milliseconds}});
    json["view"] = {{"splats", view.splats}, {"visible", view.visible}, {"ms", view.milliseconds}};
    for (const StepCost& cost : costs)
        json["predicted"].push_back({{"ranks", cost.ranks},
                                     {"sent_bytes", cost.sent_bytes},
                                     {"slowest_ms", cost.slowest_ms},
                                     {"exchange_ms", cost.exchange_ms},
                                     {"step_ms", cost.step_ms},
                                     {"views_per_second", cost.views_per_second},
                                     {"efficiency", cost.efficiency}});
    return json;
}

}  // namespace

void add_rank_options(CLI::App& app, RankBench& bench) {
    app.add_flag(
        "--ranks", bench.asked,
        "Under mpirun or srun: measure the network between the processes, and predict how a training "
        "scales. With FILE and --splats the time of a view is measured, else these options state it");
    app.add_option("--scene-splats", bench.splats, "With --ranks: splats of the scene")
        ->transform(in_range(uint64_t(1), uint64_t(1000000000000)))
        ->type_name("N")
        ->capture_default_str();
    app.add_option("--visible", bench.visible_percent, "With --ranks: how many of them a view sees")
        ->transform(in_range(0.0, 100.0))
        ->type_name("PERCENT")
        ->capture_default_str();
    app.add_option("--view-time", bench.view_ms, "With --ranks: time of a training step on one device")
        ->transform(in_range(0.001, 1e9))
        ->type_name("MS")
        ->capture_default_str();
    app.add_flag("--absgrad", bench.absolute_gradients, "With --ranks: as in ewa train");
}

int run_rank_bench(const RankBench& bench, const fs::path& dataset, const fs::path& splats,
                   const std::string& device, const fs::path& json) {
    check_command_outputs({{"--json", json}}, {{"FILE", dataset}, {"--splats", splats}});
    if (dataset.empty() != splats.empty())
        throw InputError(
            "--ranks measures the time of a view with both a DATASET and --splats FILE, or with neither");
    const std::shared_ptr<Ranks> group = open_ranks(kPatience);
    if (group->size() == 1)
        throw InputError(
            "--ranks measures the network between several processes; start them together: mpirun -n 2 ewa "
            "bench --ranks");
    ViewCost view{double(bench.splats), bench.visible_percent / 100, bench.view_ms, false, {}};
    if (!dataset.empty()) view = measure_view(*group, dataset, splats, device);
    view.absolute_gradients = bench.absolute_gradients;
    const Network network = ranks::measure_network(*group, kTransferBytes);
    if (group->rank() > 0) return 0;
    std::vector<StepCost> costs;
    for (const int count : kPredicted) costs.push_back(predict_step(view, network, count));
    print_network(*group, network);
    print_costs(view, costs);
    if (!json.empty()) write_json(json, json_of(network, view, costs));
    return 0;
}

}  // namespace ewa::cli
