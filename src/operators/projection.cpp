// SPDX-License-Identifier: Apache-2.0
// The operators of projection: arguments are checked and uploaded, a pass runs, results are downloaded.
#include <algorithm>
#include <cmath>

#include "operators/context.h"
#include "passes/passes.h"
#include "pipeline/frame_inputs.h"
#include "scene/native_lens.h"

namespace ewa {
namespace {

using operators::check_size;
using operators::ProjectionBuffers;

constexpr size_t kViewsMax = 65535 / shared::VIEW_GRADIENT_FLOATS;  // layers of a dispatch
constexpr int kWide = 1 << 24;                                      // px: beyond all angles
constexpr uint32_t kReduceBlock = 4096;                             // items a subgroup adds

void check_arguments(const SplatArrays& splats, const ViewArrays& views, const ProjectionOptions& options) {
    const size_t n = splats.size(), c = views.size();
    check_size("means", splats.means.size(), 3 * n, "[N, 3]");
    if (!splats.covariances.empty()) {
        check_size("covariances", splats.covariances.size(), 6 * n, "[N, 6]");
        if (!splats.quaternions.empty() || !splats.scales.empty())
            throw InputError("covariances are given, and quaternions or scales too; a splat has one of them");
    } else {
        check_size("quaternions", splats.quaternions.size(), 4 * n, "[N, 4]");
        check_size("scales", splats.scales.size(), 3 * n, "[N, 3]");
    }
    if (!splats.opacities.empty()) check_size("opacities", splats.opacities.size(), n, "[N]");
    check_size("view_matrices", views.view_matrices.size(), 16 * c, "[C, 4, 4]");
    check_size("intrinsics", views.intrinsics.size(), 9 * c, "[C, 3, 3]");
    if (c > kViewsMax)
        throw InputError(std::to_string(c) + " views in one call; the most are " + std::to_string(kViewsMax));
    if (options.width == 0 || options.height == 0)
        throw InputError("an image without pixels: width and height are 0");
    if (!(options.low_pass >= 0)) throw InputError("low_pass must be 0 or more");
    for (size_t v = 0; v < c; ++v)
        for (const size_t entry : {0, 4})
            if (!(views.intrinsics[9 * v + entry] > 0) || !std::isfinite(views.intrinsics[9 * v + entry]))
                throw InputError("intrinsics: a focal length of view " + std::to_string(v) +
                                 " is not a number above 0");
    if (!views.lenses.empty()) check_size("lenses", views.lenses.size(), c, "[C]");
    for (const Distortion& lens : views.lenses)
        if (!scene::is_native(lens) || lens.lens == Lens::equirectangular)
            throw InputError("lenses: one is neither brown, nor a fisheye of k1 to k4, nor orthographic");
}

bool through_lenses(const ViewArrays& views) {
    return std::ranges::any_of(views.lenses, [](const Distortion& lens) { return !lens.none(); });
}

shared::ViewBlock view_block(const ViewArrays& views, size_t v, const ProjectionOptions& options) {
    const float *matrix = &views.view_matrices[16 * v], *intrinsics = &views.intrinsics[9 * v];
    const uint32_t size[2] = {options.width, options.height};
    shared::ViewBlock block{};
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column)
            block.rotation[3 * row + column] = matrix[4 * row + column];
        block.translation[row] = matrix[4 * row + 3];
    }
    for (int k = 0; k < 2; ++k) {
        const double focal = intrinsics[4 * k], center = intrinsics[3 * k + 2];
        const double margin = shared::JACOBIAN_MARGIN * size[k] / (2 * focal);
        block.focal_hi[k] = float(focal);
        block.center[k] = float(center);
        block.tan_min[k] = float(-(center / focal + margin));
        block.tan_max[k] = float((size[k] - center) / focal + margin);
    }
    // A fisheye of the operators shows all up to where it folds, as gsplat's does, and not only what is near the image.
    const bool fisheye = through_lenses(views) && views.lenses[v].lens == Lens::fisheye;
    if (through_lenses(views))
        pipeline::set_lens({.width = fisheye ? kWide : int(options.width),
                            .height = fisheye ? kWide : int(options.height),
                            .fx = intrinsics[0],
                            .fy = intrinsics[4],
                            .cx = intrinsics[2],
                            .cy = intrinsics[5],
                            .distortion = views.lenses[v]},
                           block);
    return block;
}

shared::ViewsPush push_of(const SplatArrays& splats, const ViewArrays& views,
                          const ProjectionOptions& options) {
    return {.splats = uint32_t(splats.size()),
            .views = uint32_t(views.size()),
            .size = {float(options.width), float(options.height)},
            .near = options.near,
            .far = options.far,
            .low_pass = options.low_pass,
            .radius_clip = options.radius_clip};
}

/// SPEC_KERNEL, SPEC_MODE and SPEC_LENSES. bits: VIEWS_* beyond VIEWS_COVARIANCES.
passes::Constants variant_of(const SplatArrays& splats, const ViewArrays& views,
                             const ProjectionOptions& options, bool compensations, uint32_t bits) {
    if (options.whiteners) bits |= shared::SHAPE_WHITENERS;
    if (!splats.covariances.empty()) bits |= shared::VIEWS_COVARIANCES;
    return {{shared::SPEC_KERNEL, compensations ? shared::KERNEL_ANTIALIAS : shared::KERNEL_PEAK},
            {shared::SPEC_MODE, bits},
            {shared::SPEC_LENSES, through_lenses(views) ? 1u : 0u}};
}

void upload_splats(gpu::Device& device, ProjectionBuffers& b, const SplatArrays& splats,
                   const ViewArrays& views, const ProjectionOptions& options) {
    std::vector<shared::ViewBlock> blocks;
    for (size_t v = 0; v < views.size(); ++v) blocks.push_back(view_block(views, v, options));
    b.views.upload(device, std::span<const shared::ViewBlock>(blocks));
    b.means.lend(device, splats.means);
    b.shapes.lend(device, splats.covariances.empty() ? splats.quaternions : splats.covariances);
    b.scales.lend(device, splats.scales);
    b.opacities.lend(device, splats.opacities);
}

/// Uploads `values`, or zeros in place of an empty array.
void upload_gradient(gpu::Device& device, gpu::Recording& recording, operators::Array& array,
                     const char* name, std::span<const float> values, size_t count, const char* shape) {
    if (values.empty()) {
        recording.fill(array.reserve(device, 4 * count), 0, 0, 4 * count);
    } else {
        check_size(name, values.size(), count, shape);
        array.lend(device, values);
    }
}

/// Adds the items of each row, in blocks and then blocks of blocks. Returns the buffer that holds the sums.
operators::Array& reduce_rows(const passes::Recorder& on, operators::Context& context, uint32_t items,
                              uint32_t rows) {
    ProjectionBuffers& b = context.projection;
    operators::Array *from = &b.view_sums, *to = &b.reduced;
    const uint32_t most = (items + kReduceBlock - 1) / kReduceBlock;
    b.reduced.reserve(*context.device, uint64_t(4) * rows * most);
    b.counts.reserve(*context.device, sizeof(shared::Counts));
    for (;;) {
        on.record(passes::Reduce{.source = from->buffer(), .sums = to->buffer(), .counts = b.counts.buffer()},
                  {.items = items,
                   .block = kReduceBlock,
                   .target = shared::REDUCE_TO_SUMS,
                   .rows = rows,
                   .scale = 1});
        items = (items + kReduceBlock - 1) / kReduceBlock;
        std::swap(from, to);
        if (items == 1) return *from;
    }
}

/// [C, 4, 4] of rows of VIEW_GRADIENT_FLOATS floats.
std::vector<float> matrices_of(const std::vector<float>& sums) {
    std::vector<float> matrices(sums.size() / shared::VIEW_GRADIENT_FLOATS * 16);
    for (size_t v = 0; v < matrices.size() / 16; ++v)
        for (size_t row = 0; row < 3; ++row) {
            const float* sum = &sums[shared::VIEW_GRADIENT_FLOATS * v];
            for (size_t column = 0; column < 3; ++column)
                matrices[16 * v + 4 * row + column] = sum[3 * row + column];
            matrices[16 * v + 4 * row + 3] = sum[9 + row];
        }
    return matrices;
}

}  // namespace

ProjectedSplats Operators::project(const SplatArrays& splats, const ViewArrays& views,
                                   const ProjectionOptions& options) {
    check_arguments(splats, views, options);
    const size_t n = splats.size(), pairs = n * views.size();
    if (pairs == 0) return {};
    const std::lock_guard lock(context_->mutex);
    gpu::Device& device = *context_->device;
    ProjectionBuffers& b = context_->projection;
    upload_splats(device, b, splats, views, options);
    b.radii.reserve(device, 8 * pairs);
    b.means2d.reserve(device, 8 * pairs);
    b.depths.reserve(device, 4 * pairs);
    b.conics.reserve(device, 12 * pairs);
    b.compensations.reserve(device, options.compensations ? 4 * pairs : 4);
    gpu::Recording recording(device.limits());
    const uint32_t bits = splats.opacities.empty() ? 0 : shared::VIEWS_OPACITIES;
    passes::Recorder{recording, context_->cache}.record(
        passes::ProjectViews{.views = b.views.buffer(),
                             .means = b.means.buffer(),
                             .shapes = b.shapes.buffer(),
                             .scales = b.scales.buffer(),
                             .opacities = b.opacities.buffer(),
                             .radii = b.radii.buffer(),
                             .means2d = b.means2d.buffer(),
                             .depths = b.depths.buffer(),
                             .conics = b.conics.buffer(),
                             .compensations = b.compensations.buffer()},
        push_of(splats, views, options), variant_of(splats, views, options, options.compensations, bits));
    context_->executor.run(recording);
    b.give_back();
    ProjectedSplats out;
    out.radii = b.radii.download<int32_t>(2 * pairs);
    out.means2d = b.means2d.download<float>(2 * pairs);
    out.depths = b.depths.download<float>(pairs);
    out.conics = b.conics.download<float>(3 * pairs);
    if (options.compensations) out.compensations = b.compensations.download<float>(pairs);
    return out;
}

SplatGradient Operators::project_backward(const SplatArrays& splats, const ViewArrays& views,
                                          const ProjectionOptions& options, std::span<const int32_t> radii,
                                          const ProjectedGradient& gradient, bool view_gradients) {
    check_arguments(splats, views, options);
    const size_t n = splats.size(), c = views.size(), pairs = n * c;
    check_size("radii", radii.size(), 2 * pairs, "[C, N, 2]");
    const bool covariances = !splats.covariances.empty(), compensations = !gradient.compensations.empty();
    SplatGradient out;
    if (view_gradients) out.view_matrices.resize(16 * c);
    if (pairs == 0) {
        out.means.resize(3 * n);
        (covariances ? out.covariances : out.quaternions).resize(n * (covariances ? 6 : 4));
        if (!covariances) out.scales.resize(3 * n);
        return out;
    }
    const std::lock_guard lock(context_->mutex);
    gpu::Device& device = *context_->device;
    ProjectionBuffers& b = context_->projection;
    gpu::Recording recording(device.limits());
    upload_splats(device, b, splats, views, options);
    b.radii.lend(device, radii);
    upload_gradient(device, recording, b.means2d, "the gradient of means2d", gradient.means2d, 2 * pairs,
                    "[C, N, 2]");
    upload_gradient(device, recording, b.depths, "the gradient of depths", gradient.depths, pairs, "[C, N]");
    upload_gradient(device, recording, b.conics, "the gradient of conics", gradient.conics, 3 * pairs,
                    "[C, N, 3]");
    upload_gradient(device, recording, b.compensations, "the gradient of compensations",
                    gradient.compensations, compensations ? pairs : 4, "[C, N]");
    b.means_gradient.reserve(device, 12 * n);
    b.shapes_gradient.reserve(device, n * (covariances ? 24 : 16));
    b.scales_gradient.reserve(device, covariances ? 12 : 12 * n);

    const shared::ViewsPush push = push_of(splats, views, options);
    const passes::KernelConfig& config = context_->cache.config();
    const passes::Groups groups = passes::ProjectViewsBackward::Work::groups(config, push);
    const uint32_t rows = shared::VIEW_GRADIENT_FLOATS * uint32_t(c),
                   subgroups = groups[0] * groups[1] * (config.element_group / config.subgroup);
    b.view_sums.reserve(device, view_gradients ? uint64_t(4) * rows * subgroups : 4);
    const passes::Recorder on{recording, context_->cache};
    on.record(
        passes::ProjectViewsBackward{.views = b.views.buffer(),
                                     .means = b.means.buffer(),
                                     .shapes = b.shapes.buffer(),
                                     .scales = b.scales.buffer(),
                                     .radii = b.radii.buffer(),
                                     .means2d_gradient = b.means2d.buffer(),
                                     .depths_gradient = b.depths.buffer(),
                                     .conics_gradient = b.conics.buffer(),
                                     .compensations_gradient = b.compensations.buffer(),
                                     .means_gradient = b.means_gradient.buffer(),
                                     .shapes_gradient = b.shapes_gradient.buffer(),
                                     .scales_gradient = b.scales_gradient.buffer(),
                                     .view_sums = b.view_sums.buffer()},
        push,
        variant_of(splats, views, options, compensations, view_gradients ? shared::VIEWS_GRADIENTS : 0));
    operators::Array* sums = view_gradients ? &reduce_rows(on, *context_, subgroups, rows) : nullptr;
    context_->executor.run(recording);
    b.give_back();
    out.means = b.means_gradient.download<float>(3 * n);
    (covariances ? out.covariances : out.quaternions) =
        b.shapes_gradient.download<float>(n * (covariances ? 6 : 4));
    if (!covariances) out.scales = b.scales_gradient.download<float>(3 * n);
    if (sums) out.view_matrices = matrices_of(sums->download<float>(rows));
    return out;
}

}  // namespace ewa
