// SPDX-License-Identifier: Apache-2.0
// ewa bench: speed per pass, and error against the float64 twin.
#include "bench/bench.h"

#include <memory>

#include "cli/command.h"

namespace ewa::cli {

Action add_bench(CLI::App& app) {
    const auto options = std::make_shared<bench::Options>();
    bench::add_options(app, *options);
    return [options] { return bench::run(*options, {"/proc/self/exe", "bench"}); };
}

}  // namespace ewa::cli
