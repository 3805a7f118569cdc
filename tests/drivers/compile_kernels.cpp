// SPDX-License-Identifier: Apache-2.0
// Compiles every variant of every kernel that the device gets, and runs none. Kernels for other lists and slots are among them.
// scripts/check-drivers runs it on RADV's null device, whose statistics of each kernel follow the name that is printed here.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <set>
#include <string>
#include <string_view>

#include "ewa/device.h"
#include "gpu/device.h"
#include "passes/passes.h"
#include "passes/shader_code.h"

namespace {

using namespace ewa;
using Values = std::vector<uint32_t>;

using Choices = std::vector<std::pair<uint32_t, Values>>;

/// Every combination of one value of each constant.
std::vector<passes::Constants> combinations(const Choices& choices) {
    std::vector<passes::Constants> result{{}};
    for (const auto& [id, values] : choices) {
        std::vector<passes::Constants> longer;
        for (const passes::Constants& one : result)
            for (const uint32_t value : values) {
                longer.push_back(one);
                longer.back().push_back({id, value});
            }
        result = std::move(longer);
    }
    return result;
}

class Compiler {
  public:
    explicit Compiler(gpu::Device& device) : cache_(device) {}

    template <class Definition>
    void compile(const Choices& choices = {}) {
        for (const passes::Constants& variant : combinations(choices)) {
            const bool quads =
                std::ranges::find(variant, shared::SPEC_QUADS, &gpu::SpecConstant::id) != variant.end();
            std::fprintf(stderr, "kernel %s%s", Definition::shader, quads ? "-quads" : "");
            for (const gpu::SpecConstant& constant : variant) std::fprintf(stderr, " %u", constant.value);
            std::fputc('\n', stderr);
            (void)cache_.get<Definition>(variant).pipeline.handle();  // waits for the compiler
        }
        compiled_.insert(Definition::shader);
    }

    /// Whether no shader was forgotten. Names those that were.
    bool complete() const {
        bool complete = true;
        for (const std::string_view name : passes::shader_names()) {
            if (compiled_.contains(name)) continue;
            complete = false;
            std::fprintf(stderr, "compile_kernels: its source does not name the shader %s\n",
                         std::string(name).c_str());
        }
        return complete;
    }

  private:
    passes::PassCache cache_;
    std::set<std::string_view> compiled_;
};

const Values kDegrees = {0, 1, 2, 3};
const Values kFootprints = {shared::KERNEL_PEAK, shared::KERNEL_ANTIALIAS, shared::KERNEL_DENSITY};
const Values kBits = {1, 2, 3, 4, 5, 6, 7, 8};

void compile_splatting(Compiler& compiler) {
    using namespace shared;
    compiler.compile<passes::Project>({{SPEC_SH_DEGREE, kDegrees},
                                       {SPEC_KERNEL, kFootprints},
                                       {SPEC_MODE,
                                        {0, PROJECT_DEBUG, PROJECT_DEBUG | PROJECT_MARKS, PROJECT_NORMALS,
                                         PROJECT_SLOPES, PROJECT_SLOPES | PROJECT_MARKS}}});
    const uint32_t packed = UPDATE_PACKED_MOMENTS;
    // Without SPEC_LENSES, these three are compiled by their modules for pinholes.
    const Values other_lenses = {LENSES_ANY, LENSES_ROLLING};
    compiler.compile<passes::Project>(
        {{SPEC_SH_DEGREE, {3}}, {SPEC_KERNEL, kFootprints}, {SPEC_MODE, {0}}, {SPEC_LENSES, other_lenses}});
    compiler.compile<passes::Update>({{SPEC_SH_DEGREE, {3}},
                                      {SPEC_KERNEL, kFootprints},
                                      {SPEC_MODE, {packed | UPDATE_STATISTICS}},
                                      {SPEC_LENSES, other_lenses}});
    compiler.compile<passes::UpdateViews>({{SPEC_SH_DEGREE, {3}},
                                           {SPEC_KERNEL, kFootprints},
                                           {SPEC_MODE, {packed | UPDATE_STATISTICS}},
                                           {SPEC_LENSES, other_lenses}});
    compiler.compile<passes::Update>(
        {{SPEC_SH_DEGREE, kDegrees},
         {SPEC_KERNEL, kFootprints},
         {SPEC_MODE,
          {UPDATE_GRADIENT_ONLY, UPDATE_GRADIENT_ONLY | UPDATE_MOTION, packed | UPDATE_MOTION, 0,
           UPDATE_STATISTICS, packed, packed | UPDATE_STATISTICS, packed | UPDATE_REGULARISED,
           packed | UPDATE_STATISTICS | UPDATE_ABSOLUTE, packed | UPDATE_STATISTICS | UPDATE_DEPTH,
           packed | UPDATE_REGULARISED | UPDATE_DEPTH}}});
    compiler.compile<passes::BandTiles>();
    compiler.compile<passes::CollectVisible>();
    compiler.compile<passes::ReceiveRecords>();
    compiler.compile<passes::SumSlots>({{SPEC_MODE, {0, UPDATE_ABSOLUTE}}});
    compiler.compile<passes::UpdateViews>(
        {{SPEC_SH_DEGREE, kDegrees},
         {SPEC_KERNEL, kFootprints},
         {SPEC_MODE,
          {0, UPDATE_STATISTICS, packed, packed | UPDATE_STATISTICS, packed | UPDATE_REGULARISED,
           packed | UPDATE_STATISTICS | UPDATE_ABSOLUTE, packed | UPDATE_STATISTICS | UPDATE_BANDS,
           packed | UPDATE_REGULARISED | UPDATE_BANDS}}});
    compiler.compile<passes::ScanBlocks>({{SPEC_MODE, {0, SCAN_GATHERED, SCAN_FLAGS, SCAN_LIVE}}});
    compiler.compile<passes::ScanTotals>();
    const Values scatter_modes = {0,
                                  SORT_OWN_INDICES,
                                  SORT_DROP_KEYS,
                                  SORT_OWN_INDICES | SORT_DROP_KEYS,
                                  SORT_TRACKED,
                                  SORT_TRACKED | SORT_FIRST,
                                  SORT_TRACKED | SORT_LAST,
                                  SORT_TRACKED | SORT_FIRST | SORT_LAST};
    compiler.compile<passes::RadixCount>({{SPEC_RADIX_BITS, kBits}});
    compiler.compile<passes::RadixScatter>({{SPEC_RADIX_BITS, kBits}, {SPEC_MODE, scatter_modes}});
    Values ranked_modes = scatter_modes;
    for (const uint32_t mode : scatter_modes) ranked_modes.push_back(mode | SORT_FEW);
    compiler.compile<passes::RadixCountRanked>({{SPEC_RADIX_BITS, kBits}, {SPEC_MODE, {0, SORT_FEW}}});
    compiler.compile<passes::RadixScatterRanked>({{SPEC_RADIX_BITS, kBits}, {SPEC_MODE, ranked_modes}});
    compiler.compile<passes::EmitInstances>({{SPEC_MODE, {0, EMIT_FIRST_INSTANCES}}});
    compiler.compile<passes::TileStarts>();
    compiler.compile<passes::Blend>(
        {{SPEC_MODE, {BLEND_COLOR, BLEND_DEPTH, BLEND_COUNT, BLEND_ELLIPSOIDS, BLEND_MEDIAN}},
         {SPEC_KERNEL, {KERNEL_PEAK, KERNEL_ANTIALIAS, KERNEL_DENSITY}}});
    compiler.compile<passes::BlendBackward>(
        {{SPEC_MODE,
          {0, BLEND_BACKWARD_ABSOLUTE, BLEND_BACKWARD_ALPHA, BLEND_BACKWARD_ABSOLUTE | BLEND_BACKWARD_ALPHA,
           BLEND_BACKWARD_ALPHA | BLEND_BACKWARD_FOURTH}},
         {SPEC_KERNEL, {KERNEL_PEAK, KERNEL_ANTIALIAS, KERNEL_DENSITY}}});
    compiler.compile<passes::Pack>({{SPEC_MODE, {PACK_OPAQUE, PACK_BYTES, PACK_FLOATS, PACK_DEPTH}}});
}

/// A pass of tiles with emitted slots, and with lists of quads in batches of `batch` splats.
template <class Definition>
void compile_lists(Compiler& compiler, Choices choices, uint32_t batch) {
    choices.push_back({shared::SPEC_SLOTS, {shared::SLOTS_EMITTED}});
    compiler.compile<Definition>(choices);
    if (batch == 0) return;
    choices.back().second = {shared::SLOTS_SORTED, shared::SLOTS_EMITTED};
    choices.push_back({shared::SPEC_QUADS, {batch}});
    compiler.compile<passes::OfQuads<Definition>>(choices);
}

/// The kernels for the lists and slots that KernelConfig may choose, and config_for chooses for no device.
void compile_other_lists(Compiler& compiler, const gpu::Limits& limits) {
    using namespace shared;
    const uint32_t batch = std::min(128u, passes::most_quads(limits));
    const uint32_t packed = UPDATE_PACKED_MOMENTS;
    compile_lists<passes::Blend>(
        compiler,
        {{SPEC_MODE, {BLEND_COLOR, BLEND_DEPTH, BLEND_COUNT, BLEND_ELLIPSOIDS, BLEND_MEDIAN}},
         {SPEC_KERNEL, kFootprints}},
        batch);
    compile_lists<passes::BlendBackward>(
        compiler,
        {{SPEC_MODE,
          {0, BLEND_BACKWARD_ABSOLUTE, BLEND_BACKWARD_ALPHA, BLEND_BACKWARD_ABSOLUTE | BLEND_BACKWARD_ALPHA,
           BLEND_BACKWARD_ALPHA | BLEND_BACKWARD_FOURTH}},
         {SPEC_KERNEL, kFootprints}},
        batch);
    compile_lists<passes::Contribute>(compiler, {{SPEC_KERNEL, kFootprints}}, batch);
    compiler.compile<passes::SumSlots>({{SPEC_MODE, {0, UPDATE_ABSOLUTE}}, {SPEC_SLOTS, {SLOTS_EMITTED}}});
    compiler.compile<passes::Update>({{SPEC_SH_DEGREE, {3}},
                                      {SPEC_KERNEL, kFootprints},
                                      {SPEC_MODE, {packed | UPDATE_STATISTICS, packed | UPDATE_REGULARISED}},
                                      {SPEC_SLOTS, {SLOTS_EMITTED}}});
    compiler.compile<passes::ScanLists>();
    compiler.compile<passes::FillLists>();
    compiler.compile<passes::SortLists>({{SPEC_MODE, {LISTS_SPLATS, LISTS_TRACKED, LISTS_EMITTED}}});
    compiler.compile<passes::EmitInstances>({{SPEC_MODE, {EMIT_LISTS, EMIT_LISTS | EMIT_FIRST_INSTANCES}}});
    if (batch == 0) return;
    compiler.compile<passes::Project>(
        {{SPEC_SH_DEGREE, {3}}, {SPEC_KERNEL, kFootprints}, {SPEC_MODE, {0}}, {SPEC_QUADS, {batch}}});
    compiler.compile<passes::BandTiles>({{SPEC_QUADS, {batch}}});
    compiler.compile<passes::ReceiveRecords>({{SPEC_QUADS, {batch}}});
    compiler.compile<passes::EmitInstances>(
        {{SPEC_MODE, {0, EMIT_FIRST_INSTANCES, EMIT_LISTS, EMIT_LISTS | EMIT_FIRST_INSTANCES}},
         {SPEC_QUADS, {batch}}});
}

void compile_points(Compiler& compiler) {
    using namespace shared;
    const Values nearest = {1, 8};
    compiler.compile<passes::ProjectPoints>(
        {{SPEC_SH_DEGREE, kDegrees}, {SPEC_MODE, {0, PROJECT_DEBUG, PROJECT_DEBUG | PROJECT_MARKS}}});
    compiler.compile<passes::BlendPoints>(
        {{SPEC_NEAREST, nearest}, {SPEC_MODE, {BLEND_COLOR, BLEND_DEPTH, BLEND_COUNT}}});
    compiler.compile<passes::BlendPointsBackward>(
        {{SPEC_NEAREST, nearest}, {SPEC_MODE, {0, BLEND_BACKWARD_ABSOLUTE}}});
    const uint32_t packed = UPDATE_PACKED_MOMENTS, statistics = UPDATE_STATISTICS;
    compiler.compile<passes::UpdatePoints>({{SPEC_SH_DEGREE, kDegrees},
                                            {SPEC_MODE,
                                             {UPDATE_GRADIENT_ONLY, 0, statistics, packed,
                                              packed | statistics, packed | statistics | UPDATE_ABSOLUTE}}});
}

void compile_rays(Compiler& compiler) {
    using namespace shared;
    const Values kernels = {KERNEL_PEAK, KERNEL_DENSITY}, chunks = {1, 2, 4, 8}, lenses = {0, 1};
    const Values all_kernels = {KERNEL_PEAK, KERNEL_ANTIALIAS, KERNEL_DENSITY};
    compiler.compile<passes::ProjectRays>({{SPEC_SH_DEGREE, kDegrees},
                                           {SPEC_KERNEL, all_kernels},
                                           {SPEC_MODE, {0, PROJECT_RAYS_DEEP, PROJECT_RAYS_BY_MEAN}},
                                           {SPEC_LENSES, lenses}});
    compiler.compile<passes::BlendRays>(
        {{SPEC_KERNEL, kernels}, {SPEC_MODE, {BLEND_COLOR, BLEND_DEPTH}}, {SPEC_LENSES, lenses}});
    compiler.compile<passes::BlendFastRays>(
        {{SPEC_KERNEL, kernels}, {SPEC_MODE, {BLEND_COLOR, BLEND_DEPTH}}, {SPEC_LENSES, lenses}});
    compiler.compile<passes::BlendFastRaysBackward>({{SPEC_KERNEL, kernels}, {SPEC_LENSES, lenses}});
    compiler.compile<passes::MarchRays>({{SPEC_KERNEL, kernels}, {SPEC_MODE, chunks}, {SPEC_LENSES, lenses}});
    compiler.compile<passes::BlendRaysBackward>({{SPEC_KERNEL, kernels}, {SPEC_LENSES, lenses}});
    compiler.compile<passes::MarchRaysBackward>(
        {{SPEC_KERNEL, kernels}, {SPEC_MODE, chunks}, {SPEC_LENSES, lenses}});
    const uint32_t packed = UPDATE_PACKED_MOMENTS, statistics = UPDATE_STATISTICS;
    compiler.compile<passes::UpdateRays>({{SPEC_SH_DEGREE, kDegrees},
                                          {SPEC_KERNEL, all_kernels},
                                          {SPEC_MODE,
                                           {UPDATE_GRADIENT_ONLY, 0, statistics, UPDATE_REGULARISED, packed,
                                            packed | statistics, packed | UPDATE_REGULARISED}},
                                          {SPEC_LENSES, lenses}});
}

void compile_training(Compiler& compiler) {
    using namespace shared;
    compiler.compile<passes::Contribute>({{SPEC_KERNEL, kFootprints}});
    compiler.compile<passes::UnpackTarget>({{SPEC_COLOR_FLOATS, {0, 1}}});
    compiler.compile<passes::MaskImages>({{SPEC_COLOR_FLOATS, {0, 1}}});
    compiler.compile<passes::MaskGradient>({{SPEC_COLOR_FLOATS, {0, 1}}});
    compiler.compile<passes::LossColumns>();
    compiler.compile<passes::LossRows>();
    compiler.compile<passes::LossBackwardColumns>();
    compiler.compile<passes::LossBackwardRows>(
        {{SPEC_MODE, {0, LOSS_SSIM, LOSS_SQUARES, LOSS_SSIM | LOSS_SQUARES}}});
    compiler.compile<passes::AlphaLoss>({{SPEC_COLOR_FLOATS, {0, 1}}});
    compiler.compile<passes::DepthLoss>();
    compiler.compile<passes::Reduce>();
    compiler.compile<passes::Ppisp>();
    compiler.compile<passes::PpispBackward>();
    compiler.compile<passes::PpispUpdate>();
    compiler.compile<passes::PpispCameraUpdate>();
    compiler.compile<passes::GridSlice>({{SPEC_MODE, {0, GRID_ONE_CELL}}});
    compiler.compile<passes::GridSliceBackward>({{SPEC_MODE, {0, GRID_ONE_CELL}}});
    compiler.compile<passes::GridGradient>({{SPEC_MODE, {0, GRID_ONE_CELL}}});
    compiler.compile<passes::GridUpdate>();
    compiler.compile<passes::AddSky>({{SPEC_LENSES, {0, 1}}});
    compiler.compile<passes::SkyGradient>({{SPEC_LENSES, {0, 1}}});
    compiler.compile<passes::SkyUpdate>();
    compiler.compile<passes::MoveCamera>();
    compiler.compile<passes::MotionUpdate>();
    compiler.compile<passes::DensifyDecide>();
    compiler.compile<passes::DensifyWrite>(
        {{SPEC_SH_DEGREE, kDegrees}, {SPEC_MODE, {WRITE_PARAMS, WRITE_MOMENTS}}});
    compiler.compile<passes::ResetOpacity>();
    compiler.compile<passes::McmcWeigh>();
    compiler.compile<passes::McmcDraw>();
    compiler.compile<passes::McmcWrite>({{SPEC_SH_DEGREE, kDegrees},
                                         {SPEC_KERNEL, {KERNEL_PEAK, KERNEL_DENSITY}},
                                         {SPEC_MODE, {WRITE_PARAMS, WRITE_MOMENTS}}});
    compiler.compile<passes::Perturb>();
}

void compile_operators(Compiler& compiler) {
    using namespace shared;
    const Values kernels = {KERNEL_PEAK, KERNEL_ANTIALIAS};
    compiler.compile<passes::ProjectViews>(
        {{SPEC_KERNEL, kernels},
         {SPEC_MODE,
          {0, VIEWS_COVARIANCES, VIEWS_OPACITIES, VIEWS_COVARIANCES | VIEWS_OPACITIES, SHAPE_WHITENERS,
           VIEWS_OPACITIES | SHAPE_WHITENERS}},
         {SPEC_LENSES, {0, 1}}});
    compiler.compile<passes::ProjectViewsBackward>(
        {{SPEC_KERNEL, kernels},
         {SPEC_MODE,
          {0, VIEWS_COVARIANCES, VIEWS_GRADIENTS, VIEWS_COVARIANCES | VIEWS_GRADIENTS, SHAPE_WHITENERS,
           VIEWS_GRADIENTS | SHAPE_WHITENERS}},
         {SPEC_LENSES, {0, 1}}});
    const Values degrees = {0, 1, 2, 3, 4};
    compiler.compile<passes::Harmonics>(
        {{SPEC_SH_DEGREE, degrees}, {SPEC_MODE, {0, HARMONICS_MASKED, HARMONICS_RGB}}});
    compiler.compile<passes::HarmonicsBackward>(
        {{SPEC_SH_DEGREE, degrees},
         {SPEC_MODE,
          {0, HARMONICS_RGB, HARMONICS_DIRECTIONS, HARMONICS_RGB | HARMONICS_DIRECTIONS,
           HARMONICS_MASKED | HARMONICS_DIRECTIONS}}});
    const uint32_t listed = COLLECT_LISTED, whiteners = SHAPE_WHITENERS;
    compiler.compile<passes::CollectRecords>({{SPEC_MODE,
                                               {0, COLLECT_FEATURES, COLLECT_RADII, listed, whiteners,
                                                COLLECT_RADII | whiteners, listed | whiteners}}});
    compiler.compile<passes::BlendBackward>(
        {{SPEC_MODE,
          {BLEND_BACKWARD_ALPHA, BLEND_BACKWARD_ALPHA | BLEND_BACKWARD_ABSOLUTE,
           BLEND_BACKWARD_ALPHA | BLEND_BACKWARD_FOURTH,
           BLEND_BACKWARD_ALPHA | BLEND_BACKWARD_FOURTH | BLEND_BACKWARD_ABSOLUTE}},
         {SPEC_PARTS, {0, 1}}});
    compiler.compile<passes::Blend>({{SPEC_MODE, {BLEND_COLOR, BLEND_DEPTH}}, {SPEC_PARTS, {1}}});
    compiler.compile<passes::BlendAbsolute>({{SPEC_MODE, {6, 32}}, {SPEC_PARTS, {0, 1}}});
    compiler.compile<passes::GatherSlots>(
        {{SPEC_MODE,
          {0, GATHER_ADD, GATHER_ABSOLUTE, GATHER_FOURTH, GATHER_ADD | GATHER_FOURTH,
           GATHER_ADD | GATHER_ABSOLUTE, GATHER_ABSOLUTE | GATHER_FOURTH, whiteners,
           GATHER_ABSOLUTE | whiteners}}});
}

void compile_path_tracer(Compiler& compiler) {
    using namespace shared;
    const Choices choices = {{SPEC_ALPHA_TESTED, {0, 1}}, {SPEC_COLOR_FLOATS, {0, 1}}};
    compiler.compile<passes::TracePaths>(choices);
    compiler.compile<passes::TraceDepth>(choices);
}

}  // namespace

int main(int argc, char** argv) {
    std::shared_ptr<gpu::Device> device;
    int status = 1;
    try {
        device = open_device({.selector = argc > 1 ? argv[1] : ""});
        std::fprintf(stderr, "device %s, %u lanes\n", device->info().name.c_str(),
                     device->info().subgroup_size);
        Compiler compiler(*device);
        compile_splatting(compiler);
        compile_other_lists(compiler, device->limits());
        compile_points(compiler);
        compile_rays(compiler);
        compile_training(compiler);
        compile_operators(compiler);
        compile_path_tracer(compiler);
        if (compiler.complete()) {
            std::fprintf(stderr, "compiled\n");
            status = 0;
        }
    } catch (const std::exception& error) {
        std::fprintf(stderr, "compile_kernels: %s\n", error.what());
    }
    std::_Exit(status);  // RADV's null device crashes when it is closed
}
