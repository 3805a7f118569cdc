// SPDX-License-Identifier: Apache-2.0
#include "bench/measure.h"

#include <functional>
#include <string>
#include <vector>

#include "bench/ceiling/ceiling.h"
#include "bench/check.h"
#include "bench/device_runs.h"

namespace ewa::bench {
namespace {

/// Samples per pass, in order of first appearance. Times of one name within one run are added.
class PassSamples {
  public:
    void add(const std::string& name, double milliseconds) { running(name) += milliseconds; }
    void end_run() {
        for (Samples& one : samples_) {
            one.times.push_back(one.running);
            one.running = 0;
        }
    }
    template <class Visit>
    void visit(Visit visit) const {
        for (const Samples& one : samples_) visit(one.name, spread_of(one.times));
    }

  private:
    struct Samples {
        std::string name;
        double running = 0;
        std::vector<double> times;
    };
    double& running(const std::string& name) {
        for (Samples& one : samples_)
            if (one.name == name) return one.running;
        return samples_.emplace_back(Samples{name, 0, {}}).running;
    }
    std::vector<Samples> samples_;
};

PassResult& pass_of(CaseResult& result, const std::string& name) {
    for (PassResult& pass : result.passes)
        if (pass.name == name) return pass;
    result.passes.push_back({name, {}, 0, {}});
    return result.passes.back();
}

/// work() runs once; timings() returns the device's pass times of that run.
template <class Work, class Timings>
void time_passes(CaseResult& result, int runs, Work work, Timings timings) {
    PassSamples samples;
    Stopwatch watch;
    std::vector<double> sums;
    repeat(runs, [&] {
        watch.start();
        work();
        watch.stop();
        double sum = 0;
        for (const PassTime& time : timings()) {
            samples.add(time.pass, time.milliseconds);
            sum += time.milliseconds;
        }
        samples.end_run();
        sums.push_back(sum);
    });
    result.total = watch.timed();
    result.device = spread_of(sums);
    samples.visit(
        [&](const std::string& name, const Spread& spread) { pass_of(result, name).time.wall = spread; });
}

/// The CPU time of each pass, from separate submissions.
void time_passes_apart(CaseResult& result, FrameRun& run, int runs) {
    PassSamples samples;
    repeat(runs, [&] {
        run.run_apart([&](const std::string& name, const std::function<void()>& submit) {
            Stopwatch watch;
            watch.start();
            submit();
            watch.stop();
            samples.add(name, watch.timed().cpu.median);
        });
        samples.end_run();
    });
    samples.visit(
        [&](const std::string& name, const Spread& spread) { pass_of(result, name).time.cpu = spread; });
}

PassResult* find_pass(CaseResult& result, const std::string& name) {
    for (PassResult& pass : result.passes)
        if (pass.name == name) return &pass;
    return nullptr;
}

void set_ceiling(CaseResult& result, const std::string& name, const Timed& ceiling) {
    if (PassResult* pass = find_pass(result, name)) pass->ceiling = ceiling;
}

void set_bytes(CaseResult& result, const std::string& name, double bytes) {
    if (PassResult* pass = find_pass(result, name)) pass->bytes = bytes;
}

/// The ceiling of a pass that mainly moves memory: the time that the host takes to copy as many bytes.
void set_copy_ceiling(CaseResult& result, const std::string& name, double bytes, const Bandwidth& copies) {
    set_bytes(result, name, bytes);
    set_ceiling(result, name,
                {spread_of({bytes / copies.wall * 1e-6}), spread_of({bytes / copies.cpu * 1e-6})});
}

/// Each pass of the sort reads the keys to count them, then reads and writes keys and values.
double sort_bytes(uint64_t items, const pipeline::RadixCut& cut) {
    return 20.0 * double(items) * cut.passes;
}

/// Parameters, moments and records are read and written once; gradient slots are read.
void add_bytes(CaseResult& result, const FrameRun& run, const Bandwidth& copies) {
    const double params = double(pipeline::parameter_bytes(run.model().capacity, run.model().sh_degree));
    const double records = double(run.model().splats) * shared::RECORD_TEXELS * 16;
    const double slots = double(result.instances) * shared::SLOT_FLOATS * 4;
    const pipeline::Sizes& sizes = run.frame().sizes;
    set_copy_ceiling(result, "project", params + records, copies);
    set_copy_ceiling(result, "update", 6 * params + slots, copies);
    set_bytes(result, "depth order", sort_bytes(run.model().splats, sizes.depth_sort));
    set_bytes(result, "tile order", sort_bytes(result.instances, sizes.tile_sort));
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
    lists.tile_width = run.cache().config().tile_width;
    lists.tiles_x = sizes.tiles_x;
    for (size_t c = 0; c < 3; ++c) lists.background[c] = run.options().background[c];

    const PairCounts pairs = count_pairs(lists, sizes.tiles);
    result.pairs_evaluated = pairs.evaluated;
    result.pairs_blended = pairs.blended;
    std::vector<float> planes;
    result.ceiling_blend = time_blend(lists, sizes.tiles, runs, planes);
    set_ceiling(result, "blend", result.ceiling_blend);
    set_ceiling(result, "blend_backward", result.ceiling_blend);

    const uint32_t tile_bits = sizes.tile_sort.passes * sizes.tile_sort.bits;
    set_ceiling(result, "depth order", time_sort(run.model().splats, 32, runs));
    set_ceiling(result, "tile order", time_sort(result.instances, tile_bits, runs));
}

void check_frame(CaseResult& result, const std::shared_ptr<gpu::Device>& device, const FrameRun& run,
                 const BenchScene& scene) {
    const auto add = [&](const std::vector<Check>& checks) {
        result.checks.insert(result.checks.end(), checks.begin(), checks.end());
    };
    add(check_lists(run, scene));
    if (!reference_is_feasible(result.one)) {
        result.note = "picture and gradient not checked: the CPU reference would take minutes";
        return;
    }
    add(check_picture(run, scene));
    if (result.one.kind == Kind::train) add(check_gradient(device, scene));
    if (result.one.kind == Kind::update) add(check_update(device, scene));
}

/// CPU time is meaningful only for a device that runs on the CPU.
void drop_cpu_times_of_gpus(CaseResult& result, const gpu::Device& device) {
    if (device.limits().cpu) return;
    result.total.cpu = {};
    for (PassResult& pass : result.passes) pass.time.cpu = {};
}

CaseResult measure_frame(const std::shared_ptr<gpu::Device>& device, const Case& one,
                         const MeasureOptions& options, const Bandwidth& copies) {
    CaseResult result;
    result.one = one;
    const BenchScene scene = make_scene(one);
    FrameRun run(device, scene, one.kind != Kind::forward);
    run.run();
    const auto timings = [&] { return run.timings(); };
    if (one.kind == Kind::update) {
        time_passes(
            result, options.runs, [&] { run.run_update(); }, timings);
        pass_of(result, "update").time.cpu = result.total.cpu;
    } else {
        time_passes(
            result, options.runs, [&] { run.run(); }, timings);
        if (device->limits().cpu) time_passes_apart(result, run, options.runs);
    }
    result.instances = run.counts().instances;
    result.device_bytes = device_bytes(*device);
    add_bytes(result, run, copies);
    if (one.kind != Kind::update) add_ceilings(result, run, options.runs);
    if (options.check) check_frame(result, device, run, scene);
    drop_cpu_times_of_gpus(result, *device);
    return result;
}

CaseResult measure_sort(const std::shared_ptr<gpu::Device>& device, const Case& one,
                        const MeasureOptions& options) {
    CaseResult result;
    result.one = one;
    SortRun run(device, one.splats);
    run.run();
    time_passes(
        result, options.runs, [&] { run.run(); }, [&] { return run.timings(); });
    pass_of(result, "sort").time.cpu = result.total.cpu;
    result.device_bytes = device_bytes(*device);
    set_bytes(result, "sort", sort_bytes(one.splats, run.cut()));
    set_ceiling(result, "sort", time_sort(one.splats, 32, options.runs));
    if (options.check) result.checks.push_back(run.check());
    drop_cpu_times_of_gpus(result, *device);
    return result;
}

}  // namespace

CaseResult measure(const std::shared_ptr<gpu::Device>& device, const Case& one, const MeasureOptions& options,
                   const Bandwidth& copies) {
    switch (one.kind) {
        case Kind::sort:
            return measure_sort(device, one, options);
        case Kind::first_step:
            return measure_first_step(one, options);
        default:
            return measure_frame(device, one, options, copies);
    }
}

}  // namespace ewa::bench
