// SPDX-License-Identifier: Apache-2.0
#include "run/run_input.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/exclusion.h"
#include "core/folders.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "ewa/training_needs.h"
#include "prepare/appearance_choice.h"
#include "prepare/blurred_images.h"
#include "run/first_checks.h"
#include "run/photo_background.h"
#include "run/pose_options.h"
#include "run/region_option.h"
#include "scene/lens.h"
#include "scene/looks.h"
#include "scene/methods.h"
#include "scene/names.h"
#include "train/schedule.h"

namespace ewa::train {
namespace {

/// The split without frames that --frames does not name. Throws InputError if none is left to train on.
Split chosen_frames(const Dataset& dataset, Split split, const std::string& list) {
    if (list == "all" || list == "train") return split;
    if (list == "test") throw InputError("--frames test: these images are held out; name others");
    const std::vector<int> chosen = scene::frames_named(dataset, list);
    for (std::vector<int>* frames : {&split.train, &split.test})
        std::erase_if(*frames, [&](int i) { return std::ranges::find(chosen, i) == chosen.end(); });
    if (split.train.empty())
        throw InputError(
            fmt::format("--frames {}: {} {} held out; name more, or hold fewer out with --test-every", list,
                        core::counted(chosen.size(), "image"), core::is_or_are(chosen.size())));
    return split;
}

/// Whether the strategy changes the number of splats at least once.
bool refines(const TrainOptions& options) {
    const Schedule schedule = schedule_for(options);
    return options.strategy == Strategy::mcmc
               ? schedule.relocates(schedule.refine_start + schedule.relocate_every)
               : schedule.densifies(schedule.refine_start + schedule.refine_every);
}

/// What to tell of a run whose strategy never gets to work.
std::optional<std::string> too_short_remark(const TrainOptions& options) {
    if (options.strategy == Strategy::none || refines(options)) return std::nullopt;
    constexpr int kMostTried = 30000;
    TrainOptions longer = options;
    while (longer.steps < kMostTried && !refines(longer)) ++longer.steps;
    const char* name = options.strategy == Strategy::mcmc ? "mcmc" : "adc";
    return fmt::format("{} {} too few for {} to add or remove splats; it needs --steps {} or more",
                       core::counted(uint64_t(options.steps), "step"),
                       core::is_or_are(uint64_t(options.steps)), name, longer.steps);
}

/// What lets all ranks draw, if some do not.
std::optional<std::string> idle_ranks_remark(const TrainOptions& options, int ranks) {
    const int view_parts = std::min(options.batch, options.steps) * options.bands;
    if (ranks <= view_parts) return std::nullopt;
    return fmt::format(
        "{} of {} ranks draw nothing: a step has {} in {}; --batch {} or --bands {} lets all draw",
        ranks - view_parts, ranks, core::counted(uint64_t(options.batch), "view"),
        core::counted(uint64_t(options.bands), "band"), (ranks + options.bands - 1) / options.bands,
        (ranks + options.batch - 1) / options.batch);
}

/// What of the dataset the run uses. Depth maps that the loss does not compare are dropped.
void settle_used(RunInput& input, const StartSource& source) {
    Dataset& dataset = input.dataset;
    const auto drop = [&](std::string_view what, const std::string& why) {
        for (UsedOf& kind : dataset.used)
            if (kind.what == what && kind.used > 0) {
                kind.used = 0;
                kind.why = why;
            }
    };
    if (input.options.train.loss.depth == 0) {
        for (Frame& frame : dataset.frames) frame.depth_path.clear();
        if (source.from != StartsFrom::depth_maps) drop("depth map", "--loss depth=2 compares them");
    }
    if (input.options.init != "sfm") drop("point", "--init " + input.options.init);
    input.notes.insert(input.notes.begin(), used_text(dataset));
}

/// What the user should know of the cameras in INRIA's layout.
std::optional<std::string> inria_remark(const Dataset& dataset) {
    for (const Frame& frame : dataset.frames)
        if (!frame.camera.distortion.none())
            return std::string("--inria: cameras.json has pinholes alone, so ") +
                   (scene::has_pinhole(frame.camera.distortion.lens)
                        ? "these have the focal lengths of their lenses; --lens undistort trains on such "
                          "images"
                        : "these are views of 90 degrees from the same places");
    return std::nullopt;
}

/// What training starts from where the dataset has no points.
std::string start_without_points(const StartSource& source) {
    switch (source.from) {
        case StartsFrom::depth_maps:
            return "its depth maps";
        case StartsFrom::stereo:
            return fmt::format("{} on whose depth {} agree", core::counted(source.points, "point"),
                               core::counted(source.images, "image"));
        default:
            return "random splats";
    }
}

void add_remarks(RunInput& input, const StartSource& source) {
    const Dataset& dataset = input.dataset;
    input.notes.insert(input.notes.begin(), dataset.notes.begin(), dataset.notes.end());
    settle_used(input, source);
    if (const auto remark = idle_ranks_remark(input.options.train, input.options.ranks->size()))
        input.remarks.push_back(*remark);
    if (input.without_view_dependence())
        input.notes.emplace_back("the dataset says that no colour depends on the view: SH degree 0");
    if (input.options.init == "sfm" && dataset.points.positions.empty())
        input.remarks.push_back("the dataset has no points: training starts from " +
                                start_without_points(source));
    if (!source.skipped.empty()) input.remarks.push_back(source.skipped);
    if (!source.thinned.empty()) input.notes.push_back(source.thinned);
    if (input.options.init == "stereo")
        input.notes.push_back("training starts from " + start_without_points(source));
    if (const size_t points = dataset.points.positions.size();
        input.options.init == "sfm" && points > 0 && input.start.size() > points)
        input.notes.push_back(
            fmt::format("{} start between neighbouring points; --dense-start off prevents that",
                        core::counted(input.start.size() - points, "splat")));
    if (const std::filesystem::path dense = dataset.root / "fused.ply";
        input.options.init == "sfm" && core::is_file(dense) &&
        std::ranges::find(dataset.files, dense) == dataset.files.end())
        input.notes.push_back("a dense cloud is there, too: --init " + dense.string() + " starts from it");
    const uint64_t unreadable = dataset.unreadable.size(),
                   missing = uint64_t(dataset.missing_images) - unreadable;
    if (missing > 0)
        input.remarks.push_back(fmt::format("{} {} missing and skipped", core::counted(missing, "image"),
                                            core::is_or_are(missing)));
    for (const std::string& image : dataset.unreadable)
        input.remarks.push_back("skipped, since it cannot be read: " + image);
    if (input.options.train.render.kernel == Footprint::density)
        input.notes.emplace_back(
            "opacities in splats.ply are fitted to 3DGS's kernel, so that other viewers show about the same");
    if (const auto remark = input.options.inria ? inria_remark(dataset) : std::nullopt)
        input.remarks.push_back(*remark);
    if (const auto remark = too_short_remark(input.options.train)) input.remarks.push_back(*remark);
}

}  // namespace

namespace {

constexpr int kSsimSide = 16;  // px; SSIM's window has 11

}  // namespace

void check_max_width(int most, int width, int height, const std::string& image) {
    const double shape = double(height) / width;
    const auto high = [&](int wide) { return int(std::lround(wide * shape)); };
    if (std::min(most, high(most)) >= kSsimSide) return;
    // The height may have been rounded.
    const int enough = int(std::ceil(kSsimSide / std::min(1.0, (height - 0.5) / width)));
    throw InputError(fmt::format(
        "--max-width {} leaves {}x{} pixels of {}; a side needs {} or more, as with --max-width {}", most,
        most, std::max(1, high(most)), image, kSsimSide, enough));
}

void check_downscale(int factor, int left, int width, int height, const std::string& image) {
    const int across = std::max(1, width / left), down = std::max(1, height / left);
    if (factor == 1 || std::min(across, down) >= kSsimSide) return;
    throw InputError(fmt::format(
        "--downscale {} leaves {}x{} pixels of {}; a side needs {} or more, as with --downscale {}", factor,
        across, down, image, kSsimSide, std::max(1, std::min(width, height) / kSsimSide)));
}

namespace {

void add_findings(const std::vector<Finding>& findings, RunInput& input) {
    for (const Finding& finding : findings) {
        if (finding.fatal) throw InputError(finding.text);
        input.remarks.push_back(finding.text);
    }
}

FirstPlaces first_places(const RunInput& input) {
    return {input.start.size(), [&input](size_t i) { return input.start.world_mean(i); },
            input.options.init == "sfm" ? std::string() : input.options.init};
}

}  // namespace

RunInput load_run(const RunOptions& options, const std::function<void(const RunInput&)>& on_dataset) {
    RunInput input;
    input.options = options;
    input.name = run_name(options);
    input.options.lens = lens_use(options);
    input.dataset = load_dataset(options.dataset, {.downscale = options.downscale,
                                                   .masks = options.masks,
                                                   .lens = input.options.lens,
                                                   .max_width = options.max_width});
    add_unknown_readouts(options, input.dataset);
    input.split = split_frames(input.dataset, options.test_every);
    if (const std::string fault = nothing_to_train_on(input.dataset, input.split); !fault.empty())
        throw InputError(core::one_line(options.dataset.string()) + ": " + fault);
    input.split = chosen_frames(input.dataset, std::move(input.split), options.frames);
    for (const int i : input.split.train) {
        const Frame& frame = input.dataset.frames[size_t(i)];
        check_downscale(options.downscale, frame.downscale, frame.pinhole.width, frame.pinhole.height,
                        "the image " + frame.name);
        if (frame.reduced)
            check_max_width(options.max_width, frame.source.width, frame.source.height,
                            "the image " + frame.name);
    }
    if (on_dataset) on_dataset(input);
    add_findings(check_images(input.dataset, input.split, true), input);
    if (options.skip_blurred) {
        const std::string remark = skip_blurred(input.dataset, input.split);
        if (!remark.empty()) input.remarks.push_back(remark);
    }
    TrainOptions& train = input.options.train;
    if (train.appearance == AppearanceModel::automatic) {
        input.images = scene::read_images(input.dataset, compared_frames(input.split.train));
        const AppearanceChoice choice = choose_appearance(train, input.dataset, input.split.train);
        train.appearance = choice.model;
        const bool learned = choice.model != AppearanceModel::none;
        input.notes.push_back(
            fmt::format("appearance {}: {}{}", learned ? "ppisp" : "none", choice.reason,
                        learned ? "; --metrics cc_psnr compares held-out images without it" : ""));
    }
    choose_background(input.options, input.dataset, input.split.train);
    // The rule is for splats that start from the dataset's points.
    if (train.halvings == kAutomaticHalvings && options.init != "sfm") train.halvings = 0;
    train = resolve(train, input.dataset, input.split.train);
    train.render.sh_degree = train.sh_degree;
    input.options.output = output_folder(options);
    StartSource source;
    input.start = initial_splats(input.options, input.dataset, input.split.train, &source);
    input.from_points = source.from == StartsFrom::points || source.cloud;
    if (source.from == StartsFrom::points || source.from == StartsFrom::file)
        add_findings(check_start(input.dataset, input.split.train, first_places(input)), input);
    if (input.options.train.region) check_region(input.options.train, input.start);
    add_remarks(input, source);
    return input;
}

namespace {

using core::Relation;
using RunExclusion = core::Exclusion<RunOptions>;

bool adds_by_gradient(const RunOptions& options) {
    return options.train.strategy == Strategy::adc || options.train.strategy == Strategy::automatic;
}

using RunDemand = scene::Demand<RunOptions>;

/// What the method of drawing must be able to do for an option.
constexpr std::array kRunDemands{
    RunDemand{"--init-opacity",
              [](const RunOptions& o) { return o.init_opacity != RunOptions().init_opacity; },
              &scene::Method::no_opacity, true},
    RunDemand{"--robust", [](const RunOptions& o) { return o.robust; }, &scene::Method::no_faintness, true}};

constexpr std::array kRunExclusions{
    RunExclusion{"--resume", [](const RunOptions& o) { return o.resume; }, Relation::excludes, "--force",
                 [](const RunOptions& o) { return o.force; }},
    RunExclusion{"--keep", [](const RunOptions& o) { return o.keep > 0; }, Relation::needs, "--save-every",
                 [](const RunOptions& o) { return o.save_every > 0; }},
    RunExclusion{"--absgrad", [](const RunOptions& o) { return o.train.absolute_gradients; }, Relation::needs,
                 "--strategy adc", adds_by_gradient},
    RunExclusion{"--region", [](const RunOptions& o) { return o.train.region.has_value(); },
                 Relation::excludes, "--strategy none",
                 [](const RunOptions& o) { return o.train.strategy == Strategy::none; }, "it adds no splats"},
    RunExclusion{"--refine-focal", [](const RunOptions& o) { return o.train.refine_focal; }, Relation::needs,
                 "--refine-poses", [](const RunOptions& o) { return o.train.refine_poses; }},
    RunExclusion{"--rolling-shutter", [](const RunOptions& o) { return o.rolling_shutter.has_value(); },
                 Relation::needs, "--refine-poses",
                 [](const RunOptions& o) { return o.train.refine_poses; }}};

}  // namespace

}  // namespace ewa::train

namespace ewa {
namespace fs = std::filesystem;

std::string run_name(const RunOptions& options) {
    if (!options.scene.empty()) return options.scene.stem().string();
    return scene::dataset_name(options.dataset);
}

fs::path output_folder(const RunOptions& options) {
    return options.output.empty() ? fs::path("out") / run_name(options) : options.output;
}

void check_options(const RunOptions& options) {
    core::check_exclusions(train::kRunExclusions, options);
    const RenderOptions& render = options.train.render;
    scene::check_demands(train::kRunDemands, options, scene::method_of(render));
    scene::check_look({.render = render, .nearest = render.nearest != RenderOptions().nearest});
    train::check_training(options.train, options.ranks->size());
}

}  // namespace ewa
