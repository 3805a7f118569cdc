// SPDX-License-Identifier: Apache-2.0
// Splats that photos contradict: without them, renders are closer to the photos.
//
// E is the sum over photos, pixels and channels of the squared difference of render and photo. For a splat of opacity a, the first-order
// change of a photo's E by its removal is -g, with g = a dE/da. A splat is suspected if the sum of g over the photos exceeds a limit,
// and half the sum of |g|. A pixel is linear in a, and E is quadratic. So the change of E by the removal of one splat is -a dE/da at a / 2.
// A suspected splat is contradicted if this exceeds the same two limits, with the opacities of all suspected splats halved.
// The limit is a multiple of E / splats, and falls from round to round. Each round leaves the contradicted splats out and computes g
// again. So what is behind a floater is not blamed for it.
#pragma once
#include <array>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "ewa/dataset.h"
#include "ewa/device.h"
#include "ewa/gaussians.h"
#include "ewa/render_options.h"

namespace ewa::pipeline {

/// The photos that splats are compared with, and how these are drawn. Masked pixels do not count.
struct ComparedPhotos {
    std::vector<Frame> frames;
    /// load_training_image. A program that compares no photos needs no codecs then.
    std::function<TrainingImage(const Frame&, const std::array<float, 3>& background)> load;
    RenderOptions options;
    /// Fits each channel of a render to its photo, by a factor and an offset that minimise E. For runs that learned colours per photo.
    bool fit_colors = false;
};

/// Called before each photo with its number from 1 on, the number of photos, and the round from 1 on. An exception from it ends the
/// comparison.
using BeforePhoto = std::function<void(size_t photo, size_t photos, size_t round)>;

/// Sums over the photos.
struct PhotoScores {
    double error = 0;                 // E
    double values = 0;                // weights of pixels times 3: E / values is the mean squared error
    std::vector<double> sums, sizes;  // of each splat: of g, and of |g|
};

/// Compares splats with the photos. Throws InputError (photos that cannot be read or have another size, options) and RunError.
PhotoScores photo_scores(const std::shared_ptr<gpu::Device>& device, const Gaussians& gaussians,
                         const ComparedPhotos& photos, size_t round = 1, const BeforePhoto& before = {});

struct Contradicted {
    std::vector<bool> flags;  // of each splat
    size_t count = 0;         // of these
    double before = 0,
           after = 0;  // mean squared error of a value, with all splats and without the contradicted ones
};

/// Finds the contradicted splats. left: indices of the splats that there are; the others are never contradicted. Throws as photo_scores
/// does.
Contradicted contradicted_splats(const std::shared_ptr<gpu::Device>& device, const Gaussians& gaussians,
                                 std::vector<uint32_t> left, const ComparedPhotos& photos,
                                 const BeforePhoto& before = {});

}  // namespace ewa::pipeline
