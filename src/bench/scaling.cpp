// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <map>

#include "bench/result.h"

namespace ewa::bench {
namespace {

struct Points {
    std::vector<double> x, y;
};

Scaling fit(const std::string& of, const std::string& against, const Points& points) {
    const size_t n = points.x.size();
    double mx = 0, my = 0, xx = 0, xy = 0;
    for (size_t i = 0; i < n; ++i)
        mx += std::log(points.x[i]) / double(n), my += std::log(points.y[i]) / double(n);
    for (size_t i = 0; i < n; ++i) {
        const double dx = std::log(points.x[i]) - mx, dy = std::log(points.y[i]) - my;
        xx += dx * dx;
        xy += dx * dy;
    }
    Scaling scaling{of, against, xy / xx, 0, int(n)};
    for (size_t i = 0; i < n; ++i) {
        const double dx = std::log(points.x[i]) - mx, dy = std::log(points.y[i]) - my;
        scaling.residual += std::pow(dy - scaling.exponent * dx, 2) / double(n);
    }
    scaling.residual = std::sqrt(scaling.residual);
    return scaling;
}

/// A case's name without its number of splats: what stays fixed while that grows.
std::string series_of(const Case& one) {
    const size_t begin = one.name.find('_'), end = one.name.find('_', begin + 1);
    return one.name.substr(0, begin) + one.name.substr(end);
}

constexpr size_t kFewest = 3;              // points of a fit
constexpr uint32_t kFewestSplats = 10000;  // below, a frame is the cost of its dispatches

}  // namespace

std::vector<Scaling> fit_scaling(const std::vector<CaseResult>& cases) {
    std::map<std::string, Points> by_splats;
    Points by_pairs;
    for (const CaseResult& c : cases) {
        const bool frame = c.one.kind == Kind::forward || c.one.kind == Kind::train;
        // What the machine spends, where that can be told from what else it was busy with.
        const double time = c.total.cpu.samples > 0 ? c.total.cpu.median : c.total.wall.median;
        if (!frame || c.one.splats < kFewestSplats || !(time > 0)) continue;
        Points& series = by_splats[series_of(c.one)];
        series.x.push_back(double(c.one.splats));
        series.y.push_back(time);
        if (c.one.kind != Kind::forward || c.pairs_evaluated == 0) continue;
        by_pairs.x.push_back(double(c.pairs_evaluated));
        by_pairs.y.push_back(time);
    }
    std::vector<Scaling> scaling;
    for (const auto& [name, points] : by_splats)
        if (points.x.size() >= kFewest) scaling.push_back(fit(name, "splats", points));
    if (by_pairs.x.size() >= kFewest)
        scaling.push_back(fit("all forward cases", "pairs evaluated", by_pairs));
    return scaling;
}

}  // namespace ewa::bench
