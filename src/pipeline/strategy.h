// SPDX-License-Identifier: Apache-2.0
// Strategies that change the number of splats, on the device. A scene may be divided into portions, each with its own model. So a
// refinement has phases: count splats in each portion, decide by the counts of all, and write each portion. No device data pass
// from one phase to the next. A write replaces a model's arrays one by one, so at most one array exists twice.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>

#include "ewa/render_options.h"
#include "gpu/executor.h"
#include "pipeline/frame_buffers.h"
#include "pipeline/model.h"
#include "shared/constants.h"

namespace ewa::pipeline {

/// Numbers of splats.
struct Refinement {
    uint32_t before = 0, after = 0;
    uint32_t relocated = 0;  // by MCMC
};

/// The tools of a phase. frame: provides sizes, counts, and scratch buffers of one value per splat.
struct Phase {
    passes::PassCache& cache;
    gpu::Executor& executor;
    const FrameBuffers& frame;

    /// Runs what record(Recorder) records.
    template <class Record>
    void run(Record record) const {
        gpu::Recording recording(cache.device().limits());
        record(passes::Recorder{recording, cache});
        executor.run(recording);
    }
};

/// A box, relative to the model's origin: its low corner, then its high one. Only splats with means in the box are copied, cloned
/// or split.
using Region = std::array<float, 6>;
inline constexpr float kFarthest = std::numeric_limits<float>::max();
inline constexpr Region kEverywhere{-kFarthest, -kFarthest, -kFarthest, kFarthest, kFarthest, kFarthest};

/// A ball around all training cameras: its centre relative to the model's origin, then its radius, in world units.
using Ball = std::array<float, 4>;
inline constexpr Ball kUnlimited{0, 0, 0, kFarthest};

/// The rules of adaptive density control.
struct DensifyRules {
    float grow_gradient = 0;  // threshold of the mean gradient norm
    float split_scale = 0;    // world units
    float prune_logit = 0;
    float prune_scale = 0;                 // world units; 0: scale does not prune
    uint32_t split = shared::SPLIT_DRAWN;  // SPLIT_*: what a clone and a split leave
    uint64_t seed = 0;
    uint32_t step = 0;
    uint32_t max_splats = 0;  // hard cap: the threshold is raised until the next generation fits
    Region region = kEverywhere;
    Ball ball = kUnlimited;  // a splat larger than its distance to the ball is pruned
    bool frozen = false;     // some splats are frozen: the moments say which
};

/// The number of splats in a model's next generation, if splats with a mean gradient norm above `threshold` are cloned or split.
uint32_t count_densified(const Phase& phase, const Model& model, const DensifyRules& rules, float threshold);

/// The decision for all portions.
struct Densified {
    float threshold = 0;  // infinite: no splat is cloned or split
    uint64_t splats = 0;  // of the next generation; 0: the scene has to stay as it is
};
/// count: returns the number of splats of all portions in the next generation, for a threshold.
Densified decide_densify(const DensifyRules& rules, const std::function<uint64_t(float)>& count);

/// Writes the next generation. The model then has no statistics.
void write_densified(const Phase& phase, Model& model, const DensifyRules& rules, float threshold);

/// Records a pass that lowers every opacity to at most this logit and zeroes the opacity's moments. Frozen splats stay.
void record_reset_opacity(const passes::Recorder& on, const Model& model, float logit);

/// The rules of 3DGS as Markov chain Monte Carlo (Kheradmand et al. 2024). Dead splats move to living ones, the number
/// of splats grows by a share, and noise lets transparent splats explore.
struct McmcRules {
    double dead_opacity = 0.005;  // a splat at or below it is dead
    double growth = 1.05;         // number of splats after a refinement over that before, up to max_splats
    uint32_t max_splats = 0;      // hard cap
    double spread = 0;            // standard deviations of the source by which it and its copies move apart
    Footprint kernel = Footprint::peak;
    uint64_t seed = 0;
    uint32_t step = 0;
    Region region = kEverywhere;  // dead splats outside of it move into it
    bool frozen = false;          // as in DensifyRules
};

/// A portion's part of a refinement.
struct McmcPart {
    uint32_t weight = 0, dead = 0;  // integer opacity of its splats, and its dead splats
    // decide_mcmc sets the following:
    uint32_t all_weight = 0, weight_before = 0;  // weights of all portions, and of those before this one
    uint32_t draws = 0;                          // by all portions
    uint32_t first_draw = 0;                     // of the portion's dead splats
    uint32_t added = 0;                          // splats that this portion gets: the last one gets all
};
/// Every dead splat and every added splat becomes a copy of a source. Sources are drawn with probability in
/// proportion to opacity (integer weights in units of 1 / min(65535, 2^32 / splats)). A source and its copies
/// share its opacity and scales by eq. 9, or its optical depth with Footprint::density, and start with zero moments. With `spread`, each is placed by a draw
/// of the source's Gaussian, `spread` times as wide.
McmcPart weigh_mcmc(const Phase& phase, const Model& model, const McmcRules& rules);

/// parts: of all portions. If all splats are dead or nothing changes, there are no draws, and no phase follows.
Refinement decide_mcmc(std::span<McmcPart> parts, uint32_t splats, const McmcRules& rules);

/// The draws whose sources are splats of this model.
struct McmcSources {
    gpu::Buffer sources;  // for each draw of all portions: source in this model, or NOT_LISTED
    gpu::Buffer hits;     // for each splat: number of its copies
};
McmcSources draw_mcmc(const Phase& phase, const Model& model, const McmcRules& rules, const McmcPart& part);

/// Writes the next generation. from: the sources of this portion's dead splats, and then of those that it gets. Sources from other
/// portions are behind the model's own splats in model.params, and have hits too.
void write_mcmc(const Phase& phase, Model& model, const McmcRules& rules, const McmcPart& part,
                const McmcSources& from);

struct Noise {
    float amplitude = 0;   // 1 / world units
    float max_length = 0;  // world units, along each axis of a splat
    uint64_t seed = 0;
    uint32_t step = 0;
    bool frozen = false;  // as in DensifyRules
};

/// Writes what record_noise reads of the noise.
void record_noise_values(gpu::Recording& recording, const Model& model, const FrameBuffers& frame,
                         const Noise& noise);
/// Records a pass that adds to each mean amplitude * gate(opacity) * Sigma * a standard normal vector
/// (shaders/passes/perturb.comp). written: another recording has written the values.
void record_noise(const passes::Recorder& on, const Model& model, const FrameBuffers& frame,
                  const Noise& noise, bool written = false);

}  // namespace ewa::pipeline
