// SPDX-License-Identifier: Apache-2.0
#include "cli/bench_ranks.h"

#include <spdlog/fmt/fmt.h>

#include <chrono>
#include <nlohmann/json.hpp>

#include "cli/output.h"
#include "ewa/error.h"
#include "ranks/network.h"
#include "ranks/open.h"

namespace ewa::cli {
namespace {

using ranks::Network;

constexpr std::chrono::seconds kPatience{300};
const std::vector<uint64_t> kTransferBytes = {4 << 10, 64 << 10, 1 << 20, 4 << 20, 16 << 20, 64 << 20};

void print_network(const Ranks& ranks, const Network& network) {
    fmt::print("{} ranks: {} to {}\ngather of a number from each rank: {:.3f} ms\n\n", ranks.size(),
               ranks.name(0), ranks.name(ranks.size() - 1), network.gather_ms);
    fmt::print("{:>14} {:>10} {:>10}\n", "bytes a rank", "ms", "MB/s");
    for (const ranks::Transfer& one : network.transfers)
        fmt::print("{:>14} {:>10.3f} {:>10.0f}\n", one.bytes, one.milliseconds,
                   double(one.bytes) / one.milliseconds / 1000);
}

report::Json json_of(const Network& network) {
    report::Json json{{"ranks", network.ranks}, {"gather_ms", network.gather_ms}};
    for (const ranks::Transfer& one : network.transfers)
        json["transfers"].push_back({{"bytes", one.bytes}, {"ms", one.milliseconds}});
    return json;
}

}  // namespace

int run_rank_bench(const std::filesystem::path& json) {
    check_command_outputs({{"--json", json}}, {});
    const std::shared_ptr<Ranks> group = open_ranks(kPatience);
    if (group->size() == 1)
        throw InputError(
            "--ranks measures the network between several processes; start them together: mpirun -n 2 ewa "
            "bench --ranks");
    const Network network = ranks::measure_network(*group, kTransferBytes);
    if (group->rank() > 0) return 0;
    print_network(*group, network);
    if (!json.empty()) write_json(json, json_of(network));
    return 0;
}

}  // namespace ewa::cli
