// SPDX-License-Identifier: Apache-2.0
#include "run/scout.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <climits>
#include <cstdint>
#include <cstring>
#include <memory>
#include <numeric>
#include <optional>
#include <span>
#include <utility>

#include "core/folders.h"
#include "core/hash.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "ewa/trainer.h"
#include "folders/run_folder.h"
#include "gpu/device.h"
#include "portions/collect.h"
#include "prepare/passers_by.h"
#include "report/pictures.h"
#include "run/run_files.h"

namespace ewa::train {
namespace fs = std::filesystem;

namespace {

// The scout sees each image so often: all else is then in place, and what one image shows alone is still faint.
constexpr int kVisits = 12, kLeastSteps = 300;
// px; images are halved until no side is longer than the first, unless one gets shorter than the second: SSIM's window has 11.
constexpr int kScoutSide = 320, kLeastScoutSide = 16;
constexpr size_t kReportedMasks = 12;

/// The training frames with small images.
Dataset small_dataset(const RunInput& input) {
    Dataset dataset = input.dataset;
    int longest = 0, shortest = INT_MAX;
    for (const int i : input.split.train) {
        const Camera& camera = dataset.frames[size_t(i)].camera;
        longest = std::max({longest, camera.width, camera.height});
        shortest = std::min({shortest, camera.width, camera.height});
    }
    int reduction = 1;
    while (longest / reduction > kScoutSide && shortest / (2 * reduction) >= kLeastScoutSide) reduction *= 2;
    for (const int i : input.split.train) {
        Frame& frame = dataset.frames[size_t(i)];
        frame.downscale *= reduction;
        frame.camera = downscale(frame.pinhole, frame.downscale);
    }
    return dataset;
}

TrainOptions scout_options(const RunInput& input) {
    TrainOptions options = input.options.train;
    options.steps = std::max(kLeastSteps, kVisits * int(input.split.train.size()));
    if (options.strategy != Strategy::none) options.strategy = strategy_for(options.steps);
    options.bands = 1;  // small images may have few rows
    options.halvings = 0;
    options.final_splats = 0;
    options.refine_poses = options.refine_focal = false;
    return options;
}

Residual frame_residual(const Frame& frame, Image render, const RenderOptions& look,
                        const Appearance* appearance) {
    Image image = load_frame_image(frame), weights;
    if (image.channels == 4) {
        weights = Image(image.width, image.height, 1);
        for (size_t i = 0; i < weights.pixels.size(); ++i) weights.pixels[i] = image.pixels[4 * i + 3];
    }
    if (appearance) render = with_appearance(std::move(render), *appearance);
    return residual_of(over_background(image, look.background), weights, render);
}

std::vector<Residual> residuals_of(const Trainer& trainer, const Dataset& dataset, const RunInput& input,
                                   RunObserver& observer) {
    const std::vector<int>& train = input.split.train;
    const std::vector<Appearance> appearances = trainer.appearances();
    const auto at_once = size_t(input.options.ranks->size());
    std::vector<Residual> residuals;
    std::vector<Image> drawn;
    for (size_t i = 0; i < train.size() && !observer.should_stop(); ++i) {
        if (i % at_once == 0) {
            std::vector<Camera> cameras;
            for (size_t k = i; k < std::min(i + at_once, train.size()); ++k)
                cameras.push_back(dataset.frames[size_t(train[k])].camera);
            drawn = trainer.render(cameras);
        }
        residuals.push_back(frame_residual(dataset.frames[size_t(train[i])], std::move(drawn[i % at_once]),
                                           input.options.train.render,
                                           appearances.empty() ? nullptr : &appearances[i]));
    }
    return residuals;
}

/// On rank 0. Empty if the observer stops it.
Masks found_masks(Trainer& trainer, const Dataset& dataset, const RunInput& input, int steps,
                  RunObserver& observer) {
    const Camera& camera = dataset.frames[size_t(input.split.train.front())].camera;
    observer.on_note(fmt::format("robust: {} at {}x{} find what images do not agree on",
                                 core::counted(uint64_t(steps), "step"), camera.width, camera.height));
    while (trainer.steps_done() < steps) {
        if (observer.should_stop()) return {};
        trainer.step();
    }
    const std::vector<Residual> residuals = residuals_of(trainer, dataset, input, observer);
    return residuals.size() == input.split.train.size() ? passers_by(residuals) : Masks();
}

/// Masks as bytes: of each its width, height and a byte for each cell.
std::vector<std::byte> packed(const Masks& masks) {
    std::vector<std::byte> bytes;
    for (const Image& mask : masks) {
        for (const int side : {mask.width, mask.height}) {
            const auto* first = reinterpret_cast<const std::byte*>(&side);
            bytes.insert(bytes.end(), first, first + sizeof(side));
        }
        for (const float value : mask.pixels) bytes.push_back(std::byte(value > 0.5f));
    }
    return bytes;
}

Masks unpacked(std::span<const std::byte> bytes) {
    Masks masks;
    while (!bytes.empty()) {
        int sides[2];
        std::memcpy(sides, bytes.data(), sizeof(sides));
        Image& mask = masks.emplace_back(sides[0], sides[1], 1);
        bytes = bytes.subspan(sizeof(sides));
        for (size_t i = 0; i < mask.pixels.size(); ++i) mask.pixels[i] = float(int(bytes[i]));
        bytes = bytes.subspan(mask.pixels.size());
    }
    return masks;
}

/// The share of the mask's pixels that are black.
double black_share(const Image& mask) {
    if (mask.pixels.empty()) return 0;
    return 1 - std::accumulate(mask.pixels.begin(), mask.pixels.end(), 0.0) / double(mask.pixels.size());
}

/// Only rank 0 gets them. Collective.
Masks scouted_masks(const std::shared_ptr<gpu::Device>& device, const RunInput& input,
                    RunObserver* observer) {
    const Dataset dataset = small_dataset(input);
    const TrainOptions options = scout_options(input);
    Masks masks;
    {
        Trainer trainer(device, dataset, input.split.train, input.start, options, input.options.ranks);
        if (observer)
            masks = found_masks(trainer, dataset, input, options.steps, *observer);
        else
            trainer.follow();
    }
    // The next trainer sets the limit again.
    if (options.device_memory_bytes > 0) device->limit_memory(0, {});
    return masks;
}

void leave_out(RunInput& input, const Masks& masks) {
    const TrainOptions& train = input.options.train;
    for (size_t i = 0; i < masks.size(); ++i) {
        if (masks[i].pixels.empty()) continue;
        Frame& frame = input.dataset.frames[size_t(input.split.train[i])];
        frame.left_out = std::make_shared<const Image>(masks[i]);
        if (!train.random_background && !train.sky) frame.behind = train.render.background;
    }
}

std::string left_out_note(const RunInput& input, const Masks& masks) {
    double share = 0;
    for (const Image& mask : masks) share += black_share(mask) / double(masks.size());
    const auto masked = std::ranges::count_if(masks, [](const Image& mask) { return mask.width > 0; });
    if (masked == 0) return "robust: the images agree, and nothing is masked";
    return fmt::format("robust: {:.1f} % of the training images' pixels are masked, in {} of {}; see {}",
                       100 * share, masked, core::counted(masks.size(), "image"),
                       (input.options.output / folders::kPassersByFolder).string());
}

}  // namespace

std::string leave_out_passers_by(const std::shared_ptr<gpu::Device>& device, RunInput& input,
                                 const std::optional<Masks>& known, RunObserver* observer) {
    Ranks& ranks = *input.options.ranks;
    const auto found = uint64_t(known.has_value());
    const bool scouts = ranks.gather(std::span(&found, 1)).front() == 0;
    // A run of fewer steps shows what single images have even more faintly than the scout.
    const int enough = scout_options(input).steps / 2, steps = input.options.train.steps;
    if (scouts && steps < enough)
        return fmt::format(
            "robust: nothing is masked, since {} are too few to find what only one image shows; {} are "
            "enough",
            core::counted(uint64_t(steps), "step"), enough);
    const Masks own = scouts ? scouted_masks(device, input, observer) : known.value_or(Masks());
    const Masks masks = unpacked(portions::from_rank_0(ranks, packed(own)));
    if (masks.empty()) return {};
    leave_out(input, masks);
    return left_out_note(input, masks);
}

std::string fingerprint_of(const Masks& masks) {
    const std::vector<std::byte> bytes = packed(masks);
    core::Hash hash;
    hash.add(bytes.data(), bytes.size());
    return core::digits_of(hash);
}

Masks masks_of(const RunInput& input) {
    Masks masks;
    for (const int i : input.split.train) {
        const auto& mask = input.dataset.frames[size_t(i)].left_out;
        masks.push_back(mask ? *mask : Image());
    }
    return masks;
}

std::vector<fs::path> mask_files(const RunInput& input) {
    const auto names = report::picture_names(input.dataset.frames);
    std::vector<fs::path> files;
    for (const int i : input.split.train)
        files.push_back(input.options.output / folders::kPassersByFolder /
                        (names[size_t(i)].string() + ".png"));
    return files;
}

void save_masks(const RunInput& input) {
    const std::vector<fs::path> files = mask_files(input);
    std::error_code absent;
    for (size_t i = 0; i < files.size(); ++i) {
        fs::remove(files[i], absent);
        const auto& mask = input.dataset.frames[size_t(input.split.train[i])].left_out;
        if (!mask) continue;
        core::make_folder(files[i].parent_path());
        save_image(files[i], *mask);
    }
}

Masks saved_masks(const RunInput& input) {
    Masks masks;
    for (const fs::path& file : mask_files(input)) {
        Image& mask = masks.emplace_back();
        if (!core::is_file(file)) continue;
        const Image stored = load_image(file);
        mask = Image(stored.width, stored.height, 1);
        for (size_t i = 0; i < mask.pixels.size(); ++i)
            mask.pixels[i] = stored.pixels[size_t(stored.channels) * i] > 0.5f ? 1.0f : 0.0f;
    }
    return masks;
}

std::vector<report::LeftOutView> left_out_views(const RunInput& input) {
    std::vector<std::pair<double, const Frame*>> shares;
    for (const int i : input.split.train)
        if (const Frame& frame = input.dataset.frames[size_t(i)]; frame.left_out)
            shares.emplace_back(black_share(*frame.left_out), &frame);
    std::ranges::stable_sort(shares, [](const auto& a, const auto& b) { return a.first > b.first; });
    std::vector<report::LeftOutView> views;
    for (const auto& [share, frame] : std::span(shares).first(std::min(shares.size(), kReportedMasks)))
        views.push_back(report::left_out_view(
            frame->name, load_training_image(*frame, input.options.train.render.background).image,
            *frame->left_out, share));
    return views;
}

}  // namespace ewa::train
