// SPDX-License-Identifier: Apache-2.0
// The results of a benchmark run: how they are measured and shown. bench/README.md describes the JSON.
#pragma once
#include <cstdint>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "bench/cases.h"
#include "bench/ceiling/ceiling.h"
#include "bench/statistics.h"
#include "ewa/device.h"
#include "passes/kernel_config.h"

namespace ewa::bench {

struct PassResult {
    std::string name;
    Timed time;        // cpu only on a CPU device
    double bytes = 0;  // least number moved, if known; else 0
    Timed ceiling;     // the host at the same work; no samples: unknown
};

/// One comparison with the CPU reference, or with the rule of a sort or a scan.
struct Check {
    std::string what;
    double error = 0;
    double bound = 0;
    bool good() const { return error <= bound; }  // NaN is not
};

struct CaseResult {
    Case one;
    Timed total;    // from recording to the end of the wait
    Spread device;  // the sum of the passes
    std::vector<PassResult> passes;
    uint32_t instances = 0;
    uint64_t pairs_evaluated = 0, pairs_blended = 0;
    uint64_t device_bytes = 0;
    Timed ceiling_blend;  // the same lists on the host
    std::vector<Check> checks;
    std::string note;  // what was skipped, and why
};

/// log(time) = log(factor) + exponent log(x), by least squares.
struct Scaling {
    std::string of;       // the fitted cases
    std::string against;  // "splats" or "pairs evaluated"
    double exponent = 0;
    double residual = 0;  // root mean square, of the logarithms
    int points = 0;
};

struct Host {
    std::string cpu;
    unsigned threads = 0;
    std::string vectors;
    double load = 0;  // of the last minute, before the run
    Bandwidth copies;
};

struct Result {
    std::string version;
    DeviceInfo device;
    Host host;
    std::vector<CaseResult> cases;
    std::vector<Scaling> scaling;
};

struct MeasureOptions {
    int runs = 0;  // 0: see repeat()
    bool check = false;
    passes::KernelConfig kernels;
    Bandwidth copies;  // of the host
    int device = 0;    // its number
};

CaseResult measure(const std::shared_ptr<gpu::Device>& device, const Case& one,
                   const MeasureOptions& options);

/// Opens a device, uploads a scene, trains one step and prints the time of its end (steady clock, ns).
int run_first_step(const std::string& device);

/// Fits time against splats for each image size and layout with at least three cases, and
/// against evaluated pairs.
std::vector<Scaling> fit_scaling(const std::vector<CaseResult>& cases);

using Json = nlohmann::ordered_json;

void to_json(Json& json, const Result& result);

std::string header_text(const Result& result);
std::string case_text(const CaseResult& result);
std::string scaling_text(const std::vector<Scaling>& scaling);

/// The ratio of new to old times per case and pass, with the noise of both; larger changes are marked. Throws
/// InputError if `old_results` is not a results file.
std::string compare_text(const Json& old_results, const Json& new_results);

/// printf into a string. ewa-bench links no formatting library.
[[gnu::format(printf, 1, 2)]] std::string text_of(const char* format, ...);

/// Prints on standard output at once, because a run takes minutes.
void print(const std::string& text);

}  // namespace ewa::bench
