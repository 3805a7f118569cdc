// SPDX-License-Identifier: Apache-2.0
// What a run of the benchmark found out.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "bench/cases.h"
#include "bench/ceiling/ceiling.h"
#include "bench/spread.h"
#include "ewa/device.h"

namespace ewa::bench {

struct PassResult {
    std::string name;
    Timed time;        // cpu only on a CPU device
    double bytes = 0;  // moved at least, where that is known; else 0
    Timed ceiling;     // the host at the same work; no samples where there is no such figure
};

/// One comparison with the float64 twin, or with the rule that a sort or a scan follows.
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
    std::string note;  // what was left out and why
};

/// log(time) = log(factor) + exponent log(x), by least squares.
struct Scaling {
    std::string of;       // what was fitted
    std::string against;  // "splats" or "pairs evaluated"
    double exponent = 0;
    double residual = 0;  // root mean square of the logarithm's residuals
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

/// Over the forward cases: splats at each fixed image and layout with three points or more, and pairs over
/// all.
std::vector<Scaling> fit_scaling(const std::vector<CaseResult>& cases);

}  // namespace ewa::bench
