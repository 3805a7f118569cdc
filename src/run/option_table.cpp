// SPDX-License-Identifier: Apache-2.0
#include "run/option_table.h"

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "core/typing.h"
#include "core/words.h"
#include "ewa/error.h"
#include "ewa/metrics.h"
#include "run/advanced_options.h"
#include "run/look_options.h"
#include "run/loss_option.h"
#include "run/option_rows.h"
#include "run/pose_options.h"
#include "run/region_option.h"
#include "scene/looks.h"

namespace ewa::train {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kMostSteps = 1000000000;
constexpr int kMostBatch = 256, kMostBands = 64;
const core::Words<Strategy> kStrategies = {{"auto", Strategy::automatic},
                                           {"adc", Strategy::adc},
                                           {"mcmc", Strategy::mcmc},
                                           {"none", Strategy::none}};
const core::Words<DenseStart> kDenseStarts = {
    {"auto", DenseStart::automatic}, {"on", DenseStart::on}, {"off", DenseStart::off}};

const core::Words<AppearanceModel> kAppearances = {{"none", AppearanceModel::none},
                                                   {"affine", AppearanceModel::affine},
                                                   {"ppisp", AppearanceModel::ppisp},
                                                   {"grid", AppearanceModel::grid},
                                                   {"auto", AppearanceModel::automatic}};

RunOption frames_option() {
    RunOption option =
        words("frames", "FRAMES",
              "Use only these images: names, or indices in name order such as 0,3 or 5-9. The "
              "same images are held out as with all. Of a video: the number of frames to take [300]",
              kDecides, [](RunOptions& o) -> std::string& { return o.frames; });
    option.before = "all";
    return option;
}

const core::Words<bool> kOnOff = {{"on", true}, {"off", false}};

/// The search for cameras follows it. The dataset decides the training's result.
RunOption level_option() {
    RunOption option = choice<bool>(
        "level",
        "Level the world of photos whose cameras are searched, with scale, north and place where their GPS "
        "says them. off: COLMAP's axes",
        [](RunOptions& o) -> bool& { return o.level; }, kOnOff);
    option.decides_result = kDoesNotDecide;
    return option;
}

RunOption dataset_option() {
    RunOption option{"dataset", "PATH",
                     "Images with cameras: a COLMAP folder or transforms.json. Or photos or a video, whose "
                     "cameras are found first, or a glTF file with meshes, which is first rendered: "
                     "into DIR/dataset",
                     kDoesNotDecide};
    option.get = [](const RunOptions& options) {
        return (options.scene.empty() ? options.dataset : options.scene).string();
    };
    option.set = [](RunOptions& options, const std::string& text) { options.dataset = text; };
    return option;
}

RunOption sh_degree_option() {
    const Member<int> member = [](RunOptions& o) -> int& { return o.train.sh_degree; };
    RunOption option = member_option(
        "sh-degree", "auto|0..3",
        "Highest SH degree of view-dependent colour. auto: 3, or 0 if the dataset says that no colour "
        "depends on the view",
        kDecides, member, [](const std::string& text) {
            return text == "auto" ? kAutomaticShDegree : parse_within(text, 0, kMaxShDegree);
        });
    option.get = [](const RunOptions& options) {
        const int degree = options.train.sh_degree;
        return degree == kAutomaticShDegree ? Json("auto") : Json(degree);
    };
    return option;
}

RunOption resolution_schedule_option() {
    const Member<int> member = [](RunOptions& o) -> int& { return o.train.halvings; };
    RunOption option =
        member_option("resolution-schedule", "auto|N",
                      "Start with the images' sides halved N times. Each tenth of the run doubles them. "
                      "auto: once, for the first "
                      "100 steps of adc's runs of at most 1,000 steps",
                      kDecides, member, [](const std::string& text) {
                          return text == "auto" ? kAutomaticHalvings : parse_within(text, 0, 6);
                      });
    option.before = "0";
    option.get = [](const RunOptions& options) {
        const int halvings = options.train.halvings;
        return halvings == kAutomaticHalvings ? Json("auto") : Json(halvings);
    };
    return option;
}

constexpr uint32_t kMost = 1000000000;  // splats

RunOption max_splats_option() {
    const Member<uint32_t> member = [](RunOptions& o) -> uint32_t& { return o.train.max_splats; };
    RunOption option = member_option(
        "max-splats", "auto|N",
        "Upper limit of the number of splats. auto: by the training images' pixels, the steps and the "
        "device's memory",
        kDecides, member, [](const std::string& text) {
            return text == "auto" ? kAutomaticMaxSplats : parse_within(text, 1u, kMost);
        });
    option.get = [](const RunOptions& options) {
        const uint32_t splats = options.train.max_splats;
        return splats == kAutomaticMaxSplats ? Json("auto") : Json(splats);
    };
    return option;
}

RunOption final_splats_option() {
    const Member<uint32_t> member = [](RunOptions& o) -> uint32_t& { return o.train.final_splats; };
    RunOption option = member_option(
        "final-splats", "auto|N",
        "Keep only so many splats for the last quarter of the run: those that show most at a pixel of a "
        "training image. 0: all. auto: two thirds of an automatic --max-splats in runs of mcmc of fewer "
        "than 30000 steps, else all",
        kDecides, member, [](const std::string& text) {
            return text == "auto" ? kAutomaticFinalSplats : parse_within(text, 0u, kMost);
        });
    option.get = [](const RunOptions& options) {
        const uint32_t splats = options.train.final_splats;
        return splats == kAutomaticFinalSplats ? Json("auto") : Json(splats);
    };
    option.before = "0";
    return option;
}

RunOption moments_option() {
    const Member<int> member = [](RunOptions& o) -> int& { return o.train.moment_bits; };
    RunOption option =
        member_option("moments", "16|32",
                      "Bits of each of Adam's moments, 16 or 32. With 32 a splat takes up to half as "
                      "much memory again",
                      kDecides, member, [](const std::string& text) {
                          const auto bits = core::parse_count<int>(text);
                          if (!bits || (*bits != 16 && *bits != 32))
                              throw InputError("'" + text + "' is neither 16 nor 32");
                          return *bits;
                      });
    option.before = "32";
    return option;
}

RunOption image_cache_option() {
    const Member<uint64_t> member = [](RunOptions& o) -> uint64_t& { return o.train.image_cache_bytes; };
    RunOption option = member_option(
        "image-cache", "MiB",
        "Device memory for decoded training images. Images beyond it are read again for each step",
        kDoesNotDecide, member,
        [](const std::string& text) { return parse_within(text, uint64_t(0), uint64_t(1) << 40) << 20; });
    option.get = [](const RunOptions& options) { return options.train.image_cache_bytes >> 20; };
    return option;
}

RunOption device_memory_option() {
    constexpr double kGib = double(uint64_t(1) << 30);
    const Member<uint64_t> member = [](RunOptions& o) -> uint64_t& { return o.train.device_memory_bytes; };
    RunOption option = member_option("device-memory", "GIB",
                                     "Take at most this much device memory: splats that do not fit stay in "
                                     "host memory. 0: as much as needed",
                                     kDoesNotDecide, member, [](std::string text) {
                                         const std::string problem = core::settle_number(text, 0.0, 65536.0);
                                         if (!problem.empty()) throw InputError(problem);
                                         const double bytes = core::parse_number(text).value() * kGib;
                                         if (bytes > 0 && bytes < double(uint64_t(1) << 20))
                                             throw InputError("not 0, or at least 0.001 GiB");
                                         return uint64_t(bytes);
                                     });
    option.get = [](const RunOptions& options) {
        const uint64_t bytes = options.train.device_memory_bytes;
        return bytes == 0 ? Json(0) : Json(double(bytes) / kGib);
    };
    return option;
}

RunOption batch_option() {
    RunOption option = number<int>(
        "batch", "B",
        "Views of an optimisation step. Learning rates grow with its square root. --steps and all other "
        "counts of steps "
        "still count views",
        kDecides, [](RunOptions& o) -> int& { return o.train.batch; }, 1, kMostBatch);
    option.before = "1";
    return option;
}

RunOption bands_option() {
    RunOption option = number<int>(
        "bands", "N",
        "Bands of rows that each view is cut into. Each of several ranks then draws a band, so that up to N "
        "times --batch of them work. The result is the same for any number of ranks",
        kDecides, [](RunOptions& o) -> int& { return o.train.bands; }, 1, kMostBands);
    option.before = "1";
    return option;
}

RunOption metrics_option() {
    return member_option(
        "metrics", "LIST", "Metrics of evaluations beside PSNR and SSIM, as ewa eval --metrics takes them",
        kDoesNotDecide, Member<std::string>([](RunOptions& o) -> std::string& { return o.metrics; }),
        [](const std::string& text) {
            if (!text.empty()) metrics_named(text);
            return text;
        });
}

RunOption tensorboard_option() {
    RunOption option = flag("tensorboard", "Also write the curves of metrics.jsonl in a file for TensorBoard",
                            [](RunOptions& o) -> bool& { return o.tensorboard; });
    option.decides_result = kDoesNotDecide;
    return option;
}

RunOption keep_option() {
    return number<int>(
        "keep", "N",
        "With --save-every: also keep the splats of the last N saves, as splats_007000.ply and so on",
        kDoesNotDecide, [](RunOptions& o) -> int& { return o.keep; }, 0, 1000000);
}

RunOption inria_option() {
    RunOption option =
        flag("inria",
             "Also write DIR/inria with cfg_args, cameras.json, input.ply and point_cloud/, as "
             "INRIA's trainer does: SIBR's viewers open it",
             [](RunOptions& o) -> bool& { return o.inria; });
    option.decides_result = false;
    return option;
}

RunOption loss_option() {
    RunOption option{
        "loss", "TERM=W,...",
        "Weights of the loss: of the absolute differences (l1), the squared ones (l2) and 1 - SSIM "
        "(ssim). Of these, a term that is not named has the weight 0. alpha: of the differences between the "
        "opacity and the alpha of cut-out images [0.2]. depth: of those between the logarithms of the mean "
        "depth and of depth maps [0]. sfm-depth: the same with the depths of the dataset's points [0]",
        kDecides};
    option.get = [](const RunOptions& options) { return loss_text(options.train.loss); };
    option.set = [](RunOptions& options, const std::string& text) { options.train.loss = parse_loss(text); };
    option.before = loss_text({});
    return option;
}

RunOption max_width_option() {
    RunOption option = number<int>(
        "max-width", "N",
        "Reduce images that are wider than this after --downscale, px. Others stay as they are. 0: no limit",
        kDecides, [](RunOptions& o) -> int& { return o.max_width; }, 0, 65535);
    option.before = "0";
    return option;
}

RunOption dense_start_option() {
    RunOption option = choice<DenseStart>(
        "dense-start",
        "Whether splats start between neighbouring points, too. auto: in runs of adc of at most 700 "
        "steps, or 1,000 if points are very few for the size of the images",
        [](RunOptions& o) -> DenseStart& { return o.dense_start; }, kDenseStarts);
    option.before = "auto";
    return option;
}

RunOption appearance_option() {
    RunOption option = choice<AppearanceModel>(
        "appearance",
        "What to learn of the colours of each training image, for captures in which the exposure varies. "
        "affine: a map of colours. ppisp: exposure and colours of each image, vignette and response of each "
        "camera. "
        "grid: maps that vary over the image. auto: ppisp if the images disagree on the colours of the "
        "points, or by their EXIF; else none",
        [](RunOptions& o) -> AppearanceModel& { return o.train.appearance; }, kAppearances);
    option.before = "none";
    return option;
}

struct Row {
    const char* subject;
    const char* python;  // empty: Python does not have it
    RunOption option;
    const char* brief = "";
};

std::vector<Row> rows() {
    return {
        {"Data", "", dataset_option(), "Dataset, photos, a video, a glTF scene, or a run"},
        {"Quality", "steps",
         number<int>(
             "steps", "N", "Training views: an optimisation step takes one of them, or --batch", kDecides,
             [](RunOptions& o) -> int& { return o.train.steps; }, 1, kMostSteps),
         "Training views; each step takes one"},
        {"Quality", "batch", batch_option()},
        {"Quality", "bands", bands_option()},
        {"Quality", "strategy",
         choice<Strategy>(
             "strategy",
             "adc adds and removes splats (3DGS). mcmc relocates dead splats and grows to --max-splats "
             "(3DGS-MCMC). none keeps the number of splats. auto is mcmc from 5000 steps on, else adc",
             [](RunOptions& o) -> Strategy& { return o.train.strategy; }, kStrategies),
         "adc adds splats as 3DGS does, mcmc as 3DGS-MCMC"},
        {"Quality", "max_splats", max_splats_option(), "Upper limit of the number of splats"},
        {"Quality", "final_splats", final_splats_option()},
        {"Quality", "sh_degree", sh_degree_option(), "Highest SH degree of view-dependent colour"},
        {"Quality", "absolute_gradients",
         flag("absgrad",
              "adc: add splats where the sum of the pixels' absolute gradients is large (AbsGS). Such "
              "gradients "
              "do not cancel",
              [](RunOptions& o) -> bool& { return o.train.absolute_gradients; })},
        {"Quality", "region", region_option()},
        {"Quality", "loss", loss_option()},
        {"Quality", "appearance", appearance_option(), "Learn the colours of images of varying exposure"},
        {"Quality", "refine_poses", refine_poses_option(), "Learn a small correction of each camera"},
        {"Quality", "refine_focal", refine_focal_option()},
        {"Quality", "", rolling_shutter_option()},
        {"Quality", "halvings", resolution_schedule_option()},
        {"Data", "",
         words("init", "sfm|stereo|random|FILE",
               "First splats. sfm: the dataset's points. Without, points of its depth maps, or stereo, or "
               "random. "
               "stereo: points on whose depth the images agree. random: where the cameras look. FILE: a "
               "splat file, "
               "a PLY of points, or the folder of a run",
               kDecides, [](RunOptions& o) -> std::string& { return o.init; }),
         "First splats. sfm: at the points of the dataset"},
        {"Data", "dense_start", dense_start_option()},
        {"Data", "init_opacity",
         real(
             "init-opacity", "X", "Opacity of the first splats. A splat file has its own",
             [](RunOptions& o) -> double& { return o.init_opacity; }, 0.001, 0.999)},
        {"Data", "init_scale",
         real(
             "init-scale", "F",
             "Scale of the first splats: this factor times the distance to their neighbours. A splat "
             "file has "
             "its own",
             [](RunOptions& o) -> double& { return o.init_scale; }, 0.001, 1000)},
        {"Data", "", frames_option(), "Use only these images, such as 0,3 or 5-9"},
        {"Data", "", level_option()},
        {"Data", "",
         number<int>(
             "downscale", "K", "Divide the images' width and height by this", kDecides,
             [](RunOptions& o) -> int& { return o.downscale; }, 1, 1024),
         "Divide the images' width and height by this"},
        {"Data", "", max_width_option(), "Reduce wider images to this width, px. 0: no limit"},
        {"Data", "",
         choice<MaskUse>(
             "masks",
             "What masks/ and alpha are for. ignore: masked pixels do not count. cut: masked pixels have the "
             "background's colour. none: neither is used. auto: ignore if there are mask files, else cut",
             [](RunOptions& o) -> MaskUse& { return o.masks; }, scene::kMaskWords),
         "What masks/ and alpha do"},
        {"Data", "",
         choice<LensUse>(
             "lens",
             "What becomes of images through other lenses than a pinhole. native: splats are rendered "
             "through the "
             "lens. undistort: the images are resampled. auto: native for 360 degrees and parallel rays, "
             "else "
             "undistort",
             [](RunOptions& o) -> LensUse& { return o.lens; }, scene::kLensWords),
         "Render through lenses, or undistort their images"},
        {"Data", "",
         number<int>(
             "test-every", "K", "Hold out every K-th image in name order. 0: none", kDecides,
             [](RunOptions& o) -> int& { return o.test_every; }, 0, 1000000000),
         "Hold out every K-th image for evaluation"},
        {"Data", "",
         later_flag("skip-blurred", "Do not train on images that are blurred far more than the others",
                    [](RunOptions& o) -> bool& { return o.skip_blurred; })},
        {"Data", "robust",
         later_flag("robust",
                    "Mask what single images show and the others do not, such as people who pass by. A short "
                    "training first finds it; DIR/passers_by has the masks",
                    [](RunOptions& o) -> bool& { return o.robust; }),
         "Mask what only single images show: passers-by"},
        {"Quality", "seed",
         number<uint64_t>(
             "seed", "S", "The same seed on the same device gives the same bytes", kDecides,
             [](RunOptions& o) -> uint64_t& { return o.train.seed; }, uint64_t(0), UINT64_MAX),
         "The same seed gives the same bytes"},
        {"Device", "moment_bits", moments_option()},
        {"Device", "image_cache_bytes", image_cache_option()},
        {"Device", "device_memory_bytes", device_memory_option()},
        {"Quality", "background", background_option(), "r,g,b in 0..1, a name such as white, random or sky"},
        {"Quality", "kernel",
         choice<Footprint>(
             "kernel",
             "Footprint of a splat: peak (3DGS), antialias (Mip-Splatting) or density (EWA: a longer way "
             "through a splat absorbs more)",
             [](RunOptions& o) -> Footprint& { return o.train.render.kernel; }, scene::kKernelWords)},
        {"Quality", "points", points_option()},
        {"Quality", "nearest", nearest_option()},
        {"Quality", "integrator", integrator_option()},
        {"Output", "",
         number<int>(
             "eval-every", "N", "Evaluate the held-out views every N steps. 0: only at the end",
             kDoesNotDecide, [](RunOptions& o) -> int& { return o.eval_every; }, 0, kMostSteps),
         "Evaluate the held-out views every N steps"},
        {"Output", "", metrics_option()},
        {"Output", "", tensorboard_option()},
        {"Output", "",
         number<int>(
             "save-every", "N",
             "Save splats.ply and checkpoint.ewa every N steps. 0: save the checkpoint every 30 seconds or "
             "more",
             kDoesNotDecide, [](RunOptions& o) -> int& { return o.save_every; }, 0, kMostSteps),
         "Save splats and a checkpoint every N steps"},
        {"Output", "", keep_option()},
        {"Output", "", inria_option()},
        {"Device", "",
         words("device", "NAME|N", "Number of a device, or part of its name (see ewa devices) [$EWA_DEVICE]",
               kDoesNotDecide, [](RunOptions& o) -> std::string& { return o.device.selector; }),
         "Device by its number or name (see ewa devices)"},
        {"Device", "",
         number<int>(
             "rank-timeout", "S",
             "Under mpirun or srun: end with an error if a process does not answer for so many seconds",
             kDoesNotDecide, [](RunOptions& o) -> int& { return o.rank_timeout; }, 1, 86400)},
    };
}

std::vector<RunOption> make_table() {
    std::vector<RunOption> table;
    for (Row& row : rows()) {
        row.option.subject = row.subject;
        row.option.python = row.python;
        row.option.brief = row.brief;
        table.push_back(std::move(row.option));
    }
    std::ranges::move(advanced_options(), std::back_inserter(table));
    return table;
}

}  // namespace

const std::vector<RunOption>& run_options() {
    static const std::vector<RunOption> table = make_table();
    return table;
}

const RunOption& run_option(std::string_view name) {
    const auto& all = run_options();
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const RunOption& o) { return o.name == name; });
    if (found == all.end()) throw std::logic_error("no option " + std::string(name));
    return *found;
}

std::string value_text(const RunOption& option, const RunOptions& options) {
    const Json value = option.get(options);
    return value.is_string() ? value.get<std::string>() : value.dump();
}

bool is_listed(const RunOption& option, const RunOptions& options) {
    return !option.subject.empty() || option.get(options) != option.get(RunOptions());
}

Json to_config(const RunOptions& options) {
    Json json;
    for (const RunOption& option : run_options())
        if (is_listed(option, options)) json[option.name] = option.get(options);
    return json;
}

std::string name_of(Strategy strategy) {
    return core::word_for(kStrategies, strategy);
}

}  // namespace ewa::train
