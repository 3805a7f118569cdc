// SPDX-License-Identifier: Apache-2.0
// What a scene and a request need: which passes run, with which constants, and which buffers exist. plan_for
// is the only source of plans. Nobody changes a plan afterwards; another request gets another plan.
#pragma once
#include <cstdint>
#include <vector>

#include "ewa/appearance.h"
#include "ewa/gaussians.h"
#include "ewa/loss_weights.h"
#include "ewa/plan.h"
#include "ewa/render_options.h"
#include "pipeline/frame_buffers.h"
#include "scene/methods.h"

namespace ewa::pipeline {

enum class Purpose {
    image,     // image planes only
    gradient,  // loss of one view and its gradient
    training   // the gradient moves the splats
};

struct PlanRequest {
    Purpose purpose = Purpose::image;
    int scene_degree = 0;    // stored in the scene
    int present_degree = 0;  // highest SH degree of the scene with a coefficient other than zero
    RenderOptions render;

    // For an image.
    Drawing drawing = Drawing::color;
    bool debug = false;         // splat_scale applies, and the visible splats are counted
    double splat_scale = 1;     // factor of every splat's scales, above 0
    uint32_t marks = 0;         // Mark bits that some splat has
    bool plain_colors = false;  // as in DrawOptions

    // For a gradient or a training.
    LossWeights loss{};
    bool masks = false;                                  // training images in which some pixels count less
    bool alpha = false;                                  // training images whose alpha cuts pixels out
    bool depths = false;                                 // training images with depth maps
    AppearanceModel appearance = AppearanceModel::none;  // of the training images, which is learned
    bool motion = false;  // a gradient with respect to the camera's motion, which a training learns
    bool sky = false;     // in a training: a sky is learned

    // For a training.
    bool statistics = false;          // the strategy reads densification statistics
    bool absolute_gradients = false;  // the statistics sum absolute gradients of the pixels
    bool packed_moments = false;      // Adam's moments in 16 bits each
    bool regularised = false;         // opacity and scale regularisers in the loss
    bool pruned = false;              // splats of small weight are removed near the end
};

struct Plan {
    int stored_degree = 0;  // SH degree in the device's parameters; frames evaluate at most this degree
    Footprint kernel = Footprint::peak;
    const scene::Method* method = &scene::method_of(scene::MethodKind::splat);
    uint32_t nearest = 0;  // spheres at a pixel, if the method draws them
    Drawing drawing = Drawing::color;
    bool debug = false;
    float log_scale_shift = 0;    // with debug: added to every log scale
    uint32_t hidden_marks = 0;    // Mark bits of splats that are not drawn
    uint32_t tinted_marks = 0;    // Mark bits that change a splat's colour
    bool gradients = false;       // loss, backward passes and their buffers
    bool adam = false;            // both moments
    bool packed_moments = false;  // in 16 bits each
    bool statistics = false;      // densification statistics
    bool absolute = false;        // the statistics sum absolute gradients of the pixels
    bool regularised = false;     // opacity and scale regularisers in the loss
    bool pruned = false;          // splats of small weight are removed near the end
    LossWeights loss{};           // with gradients: a term of weight 0 has no passes; alpha is not automatic
    bool masks = false;
    AppearanceModel appearance = AppearanceModel::none;
    bool motion = false;  // the gradient with respect to the camera's motion
    bool sky = false;     // a sky that is learned

    bool operator==(const Plan&) const = default;
    /// The number of moment buffers, each of the parameters' size. Without Adam, a gradient needs one of them.
    int moment_buffers() const { return adam && !packed_moments ? 2 : gradients ? 1 : 0; }
    /// Whether the image has a fifth plane: depth, count or median depth.
    bool fifth_plane() const {
        return drawing == Drawing::depth || drawing == Drawing::count || drawing == Drawing::median_depth;
    }
    /// Whether the surfaces of splats are drawn in place of their colours.
    bool surface() const { return drawing == Drawing::median_depth || drawing == Drawing::normal; }
    /// Whether the splats' marks change the image.
    bool reads_marks() const { return (hidden_marks | tinted_marks) != 0; }
    /// Whether a frame has a buffer with each splat's geometry for rays.
    bool rays() const { return method->rays; }
    /// The SH degree that a frame evaluates.
    uint32_t evaluated_degree(int wanted) const;
};

/// A render stores the SH degrees that the scene has and request.render.sh_degree asks for. A gradient and a training store all:
/// every stored coefficient has a gradient. Inputs that do not apply to the purpose are ignored.
Plan plan_for(const PlanRequest& request);

/// The buffers of a frame of an image with width * height pixels. The caller sets the request's splats, instances and readouts.
FrameRequest frame_request(const Plan& plan, uint32_t width, uint32_t height);

/// The work that a plan skips, and the bytes saved for `splats` splats of a scene with SH degree `scene_degree`.
std::vector<PlanLine> describe(const Plan& plan, int scene_degree, uint64_t splats);

}  // namespace ewa::pipeline
