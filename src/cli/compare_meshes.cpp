// SPDX-License-Identifier: Apache-2.0
#include "cli/compare_meshes.h"

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "cli/comparison.h"
#include "cli/output.h"
#include "core/text.h"
#include "core/typing.h"
#include "io/datasets/image_records.h"
#include "io/meshes/mesh_files.h"
#include "mesh/distance.h"
#include "mesh/parts.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;

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

std::string counted_mesh(const scene::MeshScene& mesh, const mesh::Topology& topology) {
    return fmt::format("{} in {}, {}", core::counted(mesh.triangles.size(), "triangle"),
                       core::counted(topology.parts, "part"), mesh::watertight_text(topology));
}

void describe_mesh(const char* side, const fs::path& path, const scene::MeshScene& mesh, report::Json& json) {
    const mesh::Topology topology = mesh::topology_of(mesh::joined(mesh));
    fmt::print("{}: {}\n", core::one_line(path.string()), counted_mesh(mesh, topology));
    json[side] = to_json(topology, mesh.triangles.size());
}

}  // namespace

void compare_meshes(const MeshComparison& comparison) {
    const bool scan = !io::is_mesh(comparison.b);
    const scene::MeshScene a = io::read_mesh(comparison.a);
    const scene::MeshScene b = scan ? scene::MeshScene() : io::read_mesh(comparison.b);
    const mesh::Surface of_a(a),
        of_b = scan ? mesh::Surface(io::read_points_ply(comparison.b).points.positions) : mesh::Surface(b);
    const mesh::SurfaceDifference d = mesh::difference(
        of_a, of_b, {.threshold = comparison.distance.value_or(kUsualDistance * of_b.diagonal())});
    fmt::print("accuracy {:.4g}  completeness {:.4g}  chamfer {:.4g}{}\n", d.accuracy, d.completeness,
               d.chamfer(), scan ? "" : fmt::format("  normal error {:.3g}°", d.normal_error));
    fmt::print("within {:.4g}: precision {:.2f} %  recall {:.2f} %  F-score {:.2f} %\n", d.threshold,
               100 * d.precision, 100 * d.recall, 100 * d.f_score());
    report::Json json{{"accuracy", finite_number(d.accuracy)},
                      {"completeness", finite_number(d.completeness)},
                      {"chamfer", finite_number(d.chamfer())},
                      {"normal_error", finite_number(d.normal_error)},
                      {"threshold", d.threshold},
                      {"precision", d.precision},
                      {"recall", d.recall},
                      {"f_score", d.f_score()}};
    describe_mesh("a", comparison.a, a, json);
    if (scan) {
        fmt::print("{}: {}\n", core::one_line(comparison.b.string()), core::counted(of_b.size(), "point"));
        json["b"] = {{"points", of_b.size()}};
    } else {
        describe_mesh("b", comparison.b, b, json);
    }
    if (!comparison.json.empty()) write_json(comparison.json, json);
}

}  // namespace ewa::cli
