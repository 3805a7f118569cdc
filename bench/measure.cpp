#include "bench/measure.h"

#include <algorithm>

#include "bench/ceiling/ceiling.h"
#include "bench/check.h"
#include "bench/frame_run.h"
#include "bench/sort_run.h"

namespace ewa::bench {
namespace {

/// Times of a case's runs, by pass.
class Stopwatch {
  public:
    void start() {
        wall_start_ = wall_milliseconds();
        cpu_start_ = process_cpu_milliseconds();
    }
    void stop(const std::vector<gpu::Timing>& timings) {
        wall_.push_back(wall_milliseconds() - wall_start_);
        cpu_.push_back(process_cpu_milliseconds() - cpu_start_);
        double sum = 0;
        for (const gpu::Timing& timing : timings) {
            times_of(timing.name).push_back(timing.milliseconds);
            sum += timing.milliseconds;
        }
        device_.push_back(sum);
    }
    void write(CaseResult& result) const {
        result.wall = spread_of(wall_);
        result.cpu = spread_of(cpu_);
        result.device = spread_of(device_);
        for (const auto& [name, times] : passes_) result.passes.push_back({name, spread_of(times), 0, 0});
    }

  private:
    std::vector<double>& times_of(const std::string& name) {
        for (auto& [known, times] : passes_)
            if (known == name) return times;
        return passes_.emplace_back(name, std::vector<double>()).second;
    }

    double wall_start_ = 0, cpu_start_ = 0;
    std::vector<double> wall_, cpu_, device_;
    std::vector<std::pair<std::string, std::vector<double>>> passes_;  // in order of appearance
};

PassResult* find_pass(CaseResult& result, const std::string& name) {
    for (PassResult& pass : result.passes)
        if (pass.name == name) return &pass;
    return nullptr;
}

void set_bytes(CaseResult& result, const std::string& name, double bytes) {
    if (PassResult* pass = find_pass(result, name)) pass->bytes = bytes;
}

void set_ceiling(CaseResult& result, const std::string& name, double milliseconds) {
    if (PassResult* pass = find_pass(result, name)) pass->ceiling = milliseconds;
}

/// A pass of the sort reads the keys to count, then reads and writes keys and values.
double sort_bytes(uint64_t items, const pipeline::RadixCut& cut) {
    return 20.0 * double(items) * cut.passes;
}

/// Parameters, moments and records are read and written once; slots are read.
void add_bytes(CaseResult& result, const FrameRun& run, double copy_bandwidth) {
    const double params = double(pipeline::parameter_bytes(run.model().capacity, run.model().sh_degree));
    const double records = double(run.model().splats) * shared::RECORD_TEXELS * 16;
    const double slots = double(result.instances) * shared::SLOT_FLOATS * 4;
    const pipeline::Sizes& sizes = run.frame().sizes;
    set_bytes(result, "project", params + records);
    set_bytes(result, "update", 6 * params + slots);
    set_bytes(result, "depth order", sort_bytes(run.model().splats, sizes.depth_sort));
    set_bytes(result, "tile order", sort_bytes(result.instances, sizes.tile_sort));
    for (const char* name : {"project", "update"})
        if (const PassResult* pass = find_pass(result, name))
            set_ceiling(result, name, pass->bytes / copy_bandwidth * 1e-6);
}

void add_ceilings(CaseResult& result, const FrameRun& run, int runs) {
    const pipeline::Sizes& sizes = run.frame().sizes;
    const auto records = run.records();
    const auto splats = run.sorted_splats(), starts = run.tile_starts();
    BlendLists lists;
    lists.records = records.data();
    lists.splats = splats.data();
    lists.tile_starts = starts.data();
    lists.width = uint32_t(run.camera().width);
    lists.height = uint32_t(run.camera().height);
    lists.tile_width = run.kernels().shape().tile_width;
    lists.tiles_x = sizes.tiles_x;
    for (size_t c = 0; c < 3; ++c) lists.background[c] = run.options().background[c];

    const PairCounts pairs = count_pairs(lists, sizes.tiles);
    result.pairs_evaluated = pairs.evaluated;
    result.pairs_blended = pairs.blended;
    std::vector<float> planes;
    result.ceiling_blend = time_blend(lists, sizes.tiles, runs, planes);
    set_ceiling(result, "blend", result.ceiling_blend.median);
    set_ceiling(result, "blend_backward", result.ceiling_blend.median);

    const uint32_t tile_bits = sizes.tile_sort.passes * sizes.tile_sort.bits;
    set_ceiling(result, "depth order", time_sort(run.model().splats, 32, runs).median);
    set_ceiling(result, "tile order", time_sort(result.instances, tile_bits, runs).median);
}

void check_frame(CaseResult& result, const std::shared_ptr<gpu::Device>& device, const FrameRun& run,
                 const Scene& scene) {
    const auto add = [&](const std::vector<Check>& checks) {
        result.checks.insert(result.checks.end(), checks.begin(), checks.end());
    };
    add(check_lists(run, scene));
    if (!within_twins_reach(result.one)) {
        result.note = "picture and gradient not checked: the float64 twin would take minutes";
        return;
    }
    add(check_picture(run, scene));
    if (result.one.kind == Kind::train) add(check_gradient(device, scene));
    if (result.one.kind == Kind::update) add(check_update(device, scene));
}

CaseResult measure_frame(const std::shared_ptr<gpu::Device>& device, const Case& one,
                         const MeasureOptions& options, double copy_bandwidth) {
    CaseResult result;
    result.one = one;
    const Scene scene = make_scene(one);
    FrameRun run(device, scene, one.kind != Kind::forward);
    run.run();
    Stopwatch watch;
    repeat(options.runs, [&] {
        watch.start();
        if (one.kind == Kind::update)
            run.run_update();
        else
            run.run();
        watch.stop(run.timings());
    });
    watch.write(result);
    result.instances = run.counts().instances;
    result.device_bytes = device_bytes(*device);
    add_bytes(result, run, copy_bandwidth);
    if (one.kind != Kind::update) add_ceilings(result, run, options.runs);
    if (options.check) check_frame(result, device, run, scene);
    return result;
}

CaseResult measure_sort(const std::shared_ptr<gpu::Device>& device, const Case& one,
                        const MeasureOptions& options) {
    CaseResult result;
    result.one = one;
    SortRun run(device, one.splats);
    run.run();
    Stopwatch watch;
    repeat(options.runs, [&] {
        watch.start();
        run.run();
        watch.stop(run.timings());
    });
    watch.write(result);
    result.device_bytes = device_bytes(*device);
    set_bytes(result, "sort", 20.0 * one.splats * 4);
    set_ceiling(result, "sort", time_sort(one.splats, 32, options.runs).median);
    if (options.check) result.checks.push_back(run.check());
    return result;
}

}  // namespace

CaseResult measure(const std::shared_ptr<gpu::Device>& device, const Case& one, const MeasureOptions& options,
                   double copy_bandwidth) {
    switch (one.kind) {
        case Kind::sort:
            return measure_sort(device, one, options);
        case Kind::first_step:
            return measure_first_step(one, options);
        default:
            return measure_frame(device, one, options, copy_bandwidth);
    }
}

}  // namespace ewa::bench
