// SPDX-License-Identifier: Apache-2.0
#include "cli/compare_meshes.h"

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "cli/output.h"
#include "core/text.h"
#include "core/typing.h"
#include "io/meshes/mesh_files.h"
#include "mesh/distance.h"
#include "mesh/parts.h"

namespace ewa::cli {
namespace {

constexpr double kUsualDistance = 0.005;  // of the diagonal of B's box

report::Json to_json(const mesh::Topology& topology, size_t triangles) {
    return {{"triangles", triangles},
            {"parts", topology.parts},
            {"holes", topology.holes},
            {"largest_hole", topology.largest_hole},
            {"border_edges", topology.border_edges},
            {"crowded_edges", topology.crowded_edges},
            {"watertight", topology.watertight()}};
}

}  // namespace

void compare_meshes(const MeshComparison& comparison) {
    check_command_outputs({{"--json", comparison.json}}, {{"A", comparison.a}, {"B", comparison.b}});
    const scene::MeshScene a = io::read_mesh(comparison.a), b = io::read_mesh(comparison.b);
    const mesh::Surface of_a(a), of_b(b);
    const double threshold = comparison.distance.value_or(kUsualDistance * of_b.diagonal());
    const mesh::SurfaceDifference d = mesh::difference(of_a, of_b, threshold);
    fmt::print("accuracy {:.4g}  completeness {:.4g}  chamfer {:.4g}  normal error {:.3g}°\n", d.accuracy,
               d.completeness, d.chamfer(), d.normal_error);
    fmt::print("within {:.4g}: precision {:.2f} %  recall {:.2f} %  F-score {:.2f} %\n", threshold,
               100 * d.precision, 100 * d.recall, 100 * d.f_score());
    report::Json json{{"accuracy", d.accuracy}, {"completeness", d.completeness},
                      {"chamfer", d.chamfer()}, {"normal_error", d.normal_error},
                      {"threshold", threshold}, {"precision", d.precision},
                      {"recall", d.recall},     {"f_score", d.f_score()}};
    for (const auto& [name, path, mesh] :
         {std::tuple{"a", &comparison.a, &a}, std::tuple{"b", &comparison.b, &b}}) {
        const mesh::Topology topology = mesh::topology_of(mesh::joined(*mesh));
        fmt::print("{}: {} in {}, {}\n", core::one_line(path->string()),
                   core::counted(mesh->triangles.size(), "triangle"), core::counted(topology.parts, "part"),
                   mesh::watertight_text(topology));
        json[name] = to_json(topology, mesh->triangles.size());
    }
    if (!comparison.json.empty()) write_json(comparison.json, json);
}

}  // namespace ewa::cli
