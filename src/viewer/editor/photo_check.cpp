// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/photo_check.h"

#include <algorithm>
#include <limits>

#include "ewa/error.h"
#include "ewa/run_options.h"
#include "folders/run.h"
#include "pipeline/contradicted.h"
#include "scene/names.h"

namespace ewa::viewer {
namespace {

/// The training images of the scene's run.
std::vector<Frame> training_photos(const OpenedScene& scene) {
    const auto run = scene.run.empty() ? std::nullopt : folders::find_run(scene.run);
    if (!run || !scene.dataset) return {};
    const Dataset& dataset = *scene.dataset;
    const int test_every =
        run->number("test-every", 0, std::numeric_limits<int>::max(), RunOptions().test_every);
    std::vector<int> train = split_frames(dataset, test_every).train;
    if (const std::string named = run->text("frames"); !named.empty() && named != "all") {
        const std::vector<int> used = scene::frames_named(dataset, named);
        std::erase_if(train, [&](int i) { return std::ranges::find(used, i) == used.end(); });
    }
    std::vector<Frame> photos;
    for (const int i : train)
        if (const Frame& frame = dataset.frames[size_t(i)]; frame.image_exists) photos.push_back(frame);
    return photos;
}

struct LastComparison {
    std::vector<uint32_t> left;
    std::vector<bool> flags;  // empty: there was none
};

struct ComparisonEnds {
    Comparing& comparing;
    ~ComparisonEnds() { comparing.photo = 0; }
};

}  // namespace

decltype(edit::Cameras::contradicted) contradicted_by_photos(const OpenedScene& scene, const OpenDevice& open,
                                                             const std::shared_ptr<Comparing>& comparing) {
    pipeline::ComparedPhotos photos;
    photos.load = load_training_image;
    try {
        photos.frames = training_photos(scene);
    } catch (const InputError&) {
        // The run names frames that its dataset lacks.
    }
    if (photos.frames.empty()) return {};
    photos.options = options_of(scene.look);
    photos.fit_colors = !scene.appearances.empty();
    return [photos = std::move(photos), open, comparing, last = std::make_shared<LastComparison>()](
               const Gaussians& splats, const std::vector<uint32_t>& left) {
        if (!last->flags.empty() && last->left == left) return last->flags;
        const ComparisonEnds ends{*comparing};
        pipeline::Contradicted found = pipeline::contradicted_splats(open(), splats, left, photos,
                                                                     [&](size_t photo, size_t count, size_t) {
                                                                         if (comparing->stopped())
                                                                             throw InputError("");
                                                                         comparing->photos = count;
                                                                         comparing->photo = photo;
                                                                     });
        *last = {left, std::move(found.flags)};
        return last->flags;
    };
}

}  // namespace ewa::viewer
