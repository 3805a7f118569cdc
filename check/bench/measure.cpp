// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <bit>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bench/device_runs.h"
#include "bench/result.h"
#include "core/folders.h"
#include "core/process.h"
#include "ewa/error.h"

namespace ewa::bench {
namespace {

/// An idle GPU lowers its clocks, an H200 from 1,980 to 345 MHz. Under load they rise within some hundred milliseconds.
constexpr double kMillisecondsToFullClocks = 1000;

/// Times per pass and run, in order of first appearance. Times of one name within one run are added.
struct PassSamples {
    std::vector<std::pair<std::string, std::vector<double>>> passes;
    size_t runs = 0;

    void add(const std::string& name, double milliseconds) {
        auto found =
            std::find_if(passes.begin(), passes.end(), [&](const auto& p) { return p.first == name; });
        if (found == passes.end()) found = passes.insert(found, {name, {}});
        found->second.resize(runs + 1);
        found->second.back() += milliseconds;
    }
};

PassResult* find_pass(CaseResult& result, const std::string& name) {
    const auto named = [&](const PassResult& pass) { return pass.name == name; };
    const auto found = std::find_if(result.passes.begin(), result.passes.end(), named);
    return found == result.passes.end() ? nullptr : &*found;
}

PassResult& pass_of(CaseResult& result, const std::string& name) {
    if (PassResult* pass = find_pass(result, name)) return *pass;
    return result.passes.emplace_back(PassResult{name, {}, 0, {}});
}

/// Times work() and, in it, the device's passes.
template <class Run>
void time_passes(CaseResult& result, const gpu::Device& device, int runs, Run& run, void (Run::*work)()) {
    if (!device.limits().cpu) repeat_for(kMillisecondsToFullClocks, [&] { (run.*work)(); });
    PassSamples samples;
    Stopwatch watch;
    std::vector<double> sums;
    repeat(runs, [&] {
        watch.start();
        (run.*work)();
        watch.stop();
        sums.push_back(0);
        for (const PassTime& time : run.timings()) {
            samples.add(time.pass, time.milliseconds);
            sums.back() += time.milliseconds;
        }
        ++samples.runs;
    });
    result.total = watch.timed();
    result.device = spread_of(sums);
    for (const auto& [name, times] : samples.passes) pass_of(result, name).time.wall = spread_of(times);
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
        ++samples.runs;
    });
    for (const auto& [name, times] : samples.passes) pass_of(result, name).time.cpu = spread_of(times);
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
    lists.tile_width = run.cache().config().tile_width * (sizes.quads > 0 ? 2 : 1);
    lists.tile_height = run.cache().config().tile_height * (sizes.quads > 0 ? 2 : 1);
    lists.tiles_x = sizes.tiles_x;
    for (size_t c = 0; c < 3; ++c) lists.background[c] = run.options().background[c];

    const PairCounts pairs = count_pairs(lists, sizes.tiles);
    result.pairs_evaluated = pairs.evaluated;
    result.pairs_blended = pairs.blended;
    std::vector<float> planes;
    result.ceiling_blend = time_blend(lists, sizes.tiles, runs, planes);
    set_ceiling(result, "blend", result.ceiling_blend);
    set_ceiling(result, "blend_backward", result.ceiling_blend);

    const uint32_t tile_bits = sizes.sorted_lists ? uint32_t(std::bit_width(sizes.tiles))
                                                  : sizes.tile_sort.passes * sizes.tile_sort.bits;
    set_ceiling(result, "depth order", time_sort(run.model().splats, 32, runs));
    set_ceiling(result, "tile order", time_sort(result.instances, tile_bits, runs));
}

CaseResult measure_frame(const std::shared_ptr<gpu::Device>& device, const Case& one,
                         const MeasureOptions& options) {
    CaseResult result;
    result.one = one;
    const BenchScene scene = make_scene(one);
    FrameRun run(device, scene, one.kind != Kind::forward, {}, options.kernels);
    run.run();
    if (one.kind == Kind::update) {
        time_passes(result, *device, options.runs, run, &FrameRun::run_update);
        pass_of(result, "update").time.cpu = result.total.cpu;
    } else {
        time_passes(result, *device, options.runs, run, &FrameRun::run);
        if (device->limits().cpu) time_passes_apart(result, run, options.runs);
    }
    result.instances = run.counts().instances;
    result.device_bytes = device_bytes(*device);
    add_bytes(result, run, options.copies);
    if (one.kind != Kind::update) add_ceilings(result, run, options.runs);
    if (options.check) check_frame(result, device, run, scene);
    return result;
}

CaseResult measure_sort(const std::shared_ptr<gpu::Device>& device, const Case& one,
                        const MeasureOptions& options) {
    CaseResult result;
    result.one = one;
    SortRun run(device, one.splats, options.kernels);
    run.run();
    time_passes(result, *device, options.runs, run, &SortRun::run);
    pass_of(result, "sort").time.cpu = result.total.cpu;
    result.device_bytes = device_bytes(*device);
    set_bytes(result, "sort", sort_bytes(one.splats, run.cut()));
    set_ceiling(result, "sort", time_sort(one.splats, 32, options.runs));
    if (options.check) result.checks.push_back(run.check());
    return result;
}

// The time from the start of a process to the end of its first training step. Drivers keep shader caches per
// process, so a new process is needed.

int64_t now_nanoseconds() {
    using namespace std::chrono;
    return duration_cast<nanoseconds>(steady_clock::now().time_since_epoch()).count();
}

/// Runs a command with the shader caches of Mesa and NVIDIA in a folder. Returns its standard output. Throws RunError
/// unless it exits with status 0.
std::string output_of(const std::vector<std::string>& command, const std::string& cache) {
    core::Program program;
    program.command = command;
    program.environment = {"MESA_SHADER_CACHE_DIR=" + cache, "MESA_SHADER_CACHE_DISABLE=false",
                           "__GL_SHADER_DISK_CACHE=1", "__GL_SHADER_DISK_CACHE_PATH=" + cache};
    std::string text;
    const core::Ended ended = core::run_program(program, [&](std::string_view piece) {
        text += piece;
        return true;
    });
    if (ended != core::Ended::done) throw RunError("the process of the first step failed: " + command[0]);
    return text;
}

double start_to_first_step(const std::vector<std::string>& command, const std::string& cache) {
    const int64_t start = now_nanoseconds();
    const int64_t end = std::strtoll(output_of(command, cache).c_str(), nullptr, 10);
    if (end <= start) throw RunError("the process of the first step did not print a time");
    return double(end - start) * 1e-6;
}

/// Runs the first step in a new process, first with an empty shader cache, then with the cache of that run.
CaseResult measure_first_step(const Case& one, const MeasureOptions& options) {
    const std::vector<std::string> command{core::own_program().string(), "--first-step", "--device",
                                           std::to_string(options.device)};
    std::vector<double> cold, warm;
    for (int run = 0; run < (options.runs > 0 ? std::min(options.runs, 3) : 3); ++run) {
        const core::TemporaryFolder cache("ewa-bench-");
        cold.push_back(start_to_first_step(command, cache.path().string()));
        warm.push_back(start_to_first_step(command, cache.path().string()));
    }
    CaseResult result;
    result.one = one;
    result.passes = {{"shader cache cold", {spread_of(cold), {}}, 0, {}},
                     {"shader cache warm", {spread_of(warm), {}}, 0, {}}};
    result.total = result.passes[1].time;
    return result;
}

}  // namespace

CaseResult measure(const std::shared_ptr<gpu::Device>& device, const Case& one,
                   const MeasureOptions& options) {
    if (one.kind == Kind::first_step) return measure_first_step(one, options);
    CaseResult result =
        one.kind == Kind::sort ? measure_sort(device, one, options) : measure_frame(device, one, options);
    if (device->limits().cpu) return result;
    // CPU time is meaningful only for a device that runs on the CPU.
    result.total.cpu = {};
    for (PassResult& pass : result.passes) pass.time.cpu = {};
    return result;
}

int run_first_step(const std::string& device) {
    for (const Case& one : all_cases()) {
        if (one.kind != Kind::first_step) continue;
        // The constructor runs the step.
        const FrameRun run(open_device({.selector = device}), make_scene(one), true);
        std::printf("%lld\n", static_cast<long long>(now_nanoseconds()));
    }
    return 0;
}

}  // namespace ewa::bench
