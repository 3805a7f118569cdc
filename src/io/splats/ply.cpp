// SPDX-License-Identifier: Apache-2.0
// Splats in INRIA's PLY layout (3D Gaussian Splatting, scene/gaussian_model.py, save_ply).
//
// The element "vertex" has one row per splat. Properties are found by name:
//   x y z            means
//   nx ny nz         written as zero, ignored when read
//   f_dc_0..2        SH coefficient 0 of R, G, B; or else red green blue, as point clouds have them
//   f_rest_0..3K-1   SH coefficients 1..K of R, then of G, then of B; K = 0, 3, 8, 15 for degree 0..3
//   opacity          logit; of Footprint::density, fitted so that 3DGS's viewers show about the same
//   scale_0..2       natural logarithm; the flat splats of 2DGS have no scale_2
//   rot_0..3         w x y z
//   filter_3D        Mip-Splatting's 3D filter, a standard deviation that is added to the scales
// In memory, SH is coefficient after coefficient with RGB inner. So f_rest is transposed here.
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstring>

#include "core/atomic_file.h"
#include "core/text.h"
#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "io/splats/formats.h"
#include "io/splats/ply_table.h"
#include "io/splats/render_mark.h"
#include "io/splats/splat_values.h"
#include "scene/opacity_fit.h"

namespace ewa::io {

namespace {

constexpr size_t kBeforeSh = 11;  // columns before f_rest: x y z opacity scale_0..2 rot_0..3
constexpr int kMaxFileDegree = 4;
constexpr float kFlat = -13.8155f;  // the logarithm of a millionth
// Says that the opacities are fitted to those of Footprint::density.
constexpr char kDensityComment[] = "ewa kernel density";

/// The SH degree of f_rest_0..3K-1.
int degree_of(const PlyTable& table, const PlyElement& vertex) {
    size_t count = 0;
    for (const PlyProperty& property : vertex.properties) count += property.name.starts_with("f_rest_");
    for (int degree = 0; degree <= kMaxFileDegree; ++degree)
        if (count == 3 * (size_t(sh_coefficients(degree)) - 1)) return degree;
    throw InputError(table.name() + ": " + std::to_string(count) +
                     " properties f_rest_* do not fit any SH degree (0, 9, 24 or 45 are degree 0 to 3)");
}

bool has_faces(const PlyTable& table) {
    const auto& all = table.elements();
    return std::any_of(all.begin(), all.end(),
                       [](const PlyElement& element) { return element.name == "face" && element.count > 0; });
}

size_t column(const PlyTable& table, const PlyElement& vertex, const std::string& name) {
    const std::optional<size_t> found = vertex.find(name);
    if (found && !vertex.properties[*found].list_count) return *found;
    std::string text = table.name() + ": the vertices have no property \"" + name + "\"";
    if (found) text = table.name() + ": the property \"" + name + "\" is a list, not a number";
    if (name.starts_with("f_dc_") && !vertex.find("opacity"))
        text +=
            std::string("; this is a ") + (has_faces(table) ? "mesh" : "point cloud") + ", not a splat file";
    throw InputError(text);
}

/// What a file has besides INRIA's layout.
struct Extras {
    std::optional<PlyColors> colors;  // in place of f_dc
    bool flat = false;                // no scale_2
    std::optional<size_t> filter;     // the column of filter_3D, the last of read_ply's rows
};

Extras extras_of(const std::filesystem::path& path, const PlyElement& vertex) {
    Extras extras;
    if (vertex.find("opacity") && !vertex.find("f_dc_0")) extras.colors = find_colors(path, vertex);
    extras.flat = vertex.find("scale_1") && !vertex.find("scale_2");
    extras.filter = vertex.find_number("filter_3D");
    return extras;
}

/// Columns in the order of read_ply's rows: the eleven, then SH in the order of memory, then the filter.
std::vector<size_t> splat_columns(const PlyTable& table, const PlyElement& vertex, int degree,
                                  int file_degree, const Extras& extras) {
    std::vector<size_t> columns;
    const auto add = [&](const std::string& name) { columns.push_back(column(table, vertex, name)); };
    for (const char* name : {"x", "y", "z"}) add(name);
    for (int i = 0; i < 3 && !extras.colors; ++i) column(table, vertex, "f_dc_" + std::to_string(i));
    add("opacity");
    for (const char* name : {"scale_0", "scale_1", extras.flat ? "scale_1" : "scale_2"}) add(name);
    for (int i = 0; i < 4; ++i) add("rot_" + std::to_string(i));
    for (size_t channel = 0; channel < 3; ++channel)
        if (extras.colors)
            columns.push_back(extras.colors->columns[channel]);
        else
            add("f_dc_" + std::to_string(channel));
    const int per_channel = sh_coefficients(file_degree) - 1;
    for (int k = 0; k < sh_coefficients(degree) - 1; ++k)
        for (int channel = 0; channel < 3; ++channel)
            add("f_rest_" + std::to_string(channel * per_channel + k));
    if (extras.filter) columns.push_back(*extras.filter);
    return columns;
}

/// Adds the variance of Mip-Splatting's 3D filter to the splat's. Its opacity falls as its density does.
void add_filter(double filter, float* log_scales, float& logit) {
    if (filter == 0) return;
    constexpr double kFarLarger = 100;
    double log_opacity = -std::log1p(std::exp(-double(logit)));
    for (size_t k = 0; k < 3; ++k) {
        const double before = log_scales[k];
        if (before > kFarLarger) continue;
        const double after = std::log(std::hypot(std::exp(before), filter));
        log_opacity += before - after;
        log_scales[k] = float(after);
    }
    logit = float(log_opacity - std::log(-std::expm1(log_opacity)));
}

/// Adds a remark on the contents that are skipped.
void remark_ignored(const PlyElement& vertex, const std::vector<size_t>& columns, SplatScene& scene) {
    std::string ignored;
    for (size_t i = 0; i < vertex.properties.size(); ++i) {
        const std::string& name = vertex.properties[i].name;
        if (std::find(columns.begin(), columns.end(), i) != columns.end() || name.starts_with("f_rest_") ||
            name == "nx" || name == "ny" || name == "nz")
            continue;
        constexpr size_t kLongest = 200;
        if (ignored.size() > kLongest) {
            ignored += ", ...";
            break;
        }
        ignored += (ignored.empty() ? "" : ", ") + name;
    }
    if (!ignored.empty())
        scene.remarks.push_back("properties that splats do not have are skipped: " + ignored);
    if (scene.file_sh_degree > kMaxShDegree)
        scene.remarks.push_back("has SH degree " + std::to_string(scene.file_sh_degree) + "; degrees above " +
                                std::to_string(kMaxShDegree) + " are skipped");
}

/// Whether float32 would round the world positions.
bool in_double(const Gaussians& gaussians) {
    return gaussians.origin != glm::dvec3(0);
}

}  // namespace

std::string ply_header(const Gaussians& gaussians, const SaveOptions& options) {
    std::string text = "ply\nformat binary_little_endian 1.0\n";
    for (const std::string& comment : marked_comments(options)) text += "comment " + comment + "\n";
    if (gaussians.density) text += std::string("comment ") + kDensityComment + "\n";
    text += "element vertex " + std::to_string(gaussians.size()) + "\n";
    const auto property = [&](const std::string& name) { text += "property float " + name + "\n"; };
    for (const char* name : {"x", "y", "z"})
        text += std::string("property ") + (in_double(gaussians) ? "double " : "float ") + name + "\n";
    for (const char* name : {"nx", "ny", "nz"}) property(name);
    for (int i = 0; i < 3; ++i) property("f_dc_" + std::to_string(i));
    for (int i = 0; i < 3 * (sh_coefficients(gaussians.sh_degree) - 1); ++i)
        property("f_rest_" + std::to_string(i));
    property("opacity");
    for (int i = 0; i < 3; ++i) property("scale_" + std::to_string(i));
    for (int i = 0; i < 4; ++i) property("rot_" + std::to_string(i));
    return text + "end_header\n";
}

size_t ply_row_bytes(const Gaussians& gaussians) {
    const size_t positions = in_double(gaussians) ? 6 : 3;  // in floats
    return sizeof(float) * (positions + 3 + gaussians.sh_stride() + 1 + 3 + 4);
}

void append_ply_row(const Gaussians& gaussians, size_t i, std::vector<float>& rows) {
    const size_t stride = gaussians.sh_stride();
    const auto append = [&](const float* values, size_t n) { rows.insert(rows.end(), values, values + n); };
    if (in_double(gaussians)) {
        const glm::dvec3 mean = gaussians.world_mean(i);
        std::array<float, 6> bytes;
        std::memcpy(bytes.data(), &mean[0], sizeof(bytes));
        append(bytes.data(), bytes.size());
    } else {
        append(&gaussians.means[3 * i], 3);
    }
    rows.insert(rows.end(), 3, 0.0f);
    append(&gaussians.sh[stride * i], 3);
    for (size_t channel = 0; channel < 3; ++channel)
        for (size_t k = 3; k < stride; k += 3) rows.push_back(gaussians.sh[stride * i + k + channel]);
    const float logit = gaussians.opacity_logits[i];
    rows.push_back(gaussians.density ? scene::shown_logit(logit) : logit);
    append(&gaussians.log_scales[3 * i], 3);
    append(&gaussians.quaternions[4 * i], 4);
}

SplatScene read_ply(const std::filesystem::path& path) {
    PlyTable table(path);
    SplatScene scene;
    scene.comments = table.comments();
    scene.variant = table.format_name();
    take_marks(scene);
    const bool density = std::erase(scene.comments, kDensityComment) > 0;
    const PlyElement& vertex = table.go_to("vertex");
    scene.file_sh_degree = degree_of(table, vertex);
    Gaussians& gaussians = scene.gaussians;
    gaussians.sh_degree = std::min(scene.file_sh_degree, kMaxShDegree);
    const Extras extras = extras_of(path, vertex);
    const std::vector<size_t> columns =
        splat_columns(table, vertex, gaussians.sh_degree, scene.file_sh_degree, extras);
    if (extras.flat) remark_surfels(scene);
    if (extras.filter)
        scene.remarks.emplace_back("Mip-Splatting's filter_3D is added to the scales and opacities");
    remark_ignored(vertex, columns, scene);
    require_memory(table.name(), table.file_bytes(), vertex.count, gaussians.sh_degree);
    gaussians.resize(static_cast<size_t>(vertex.count));
    const size_t stride = gaussians.sh_stride();
    const auto copy = [](const double* from, float* to, size_t n) {
        for (size_t k = 0; k < n; ++k) to[k] = static_cast<float>(from[k]);
    };
    const bool wide = vertex.properties[columns[0]].type == PlyType::float64;
    std::vector<glm::dvec3> positions(wide ? gaussians.size() : 0);
    table.read(columns, [&](size_t i, const double* row) {
        if (wide)
            positions[i] = {row[0], row[1], row[2]};
        else
            copy(row, &gaussians.means[3 * i], 3);
        gaussians.opacity_logits[i] = static_cast<float>(row[3]);
        copy(row + 4, &gaussians.log_scales[3 * i], 3);
        copy(row + 7, &gaussians.quaternions[4 * i], 4);
        copy(row + kBeforeSh, &gaussians.sh[stride * i], stride);
        float* log_scales = &gaussians.log_scales[3 * i];
        if (extras.flat) log_scales[2] = std::max(log_scales[0], log_scales[1]) + kFlat;
        if (extras.colors)
            for (size_t k = 0; k < 3; ++k)
                gaussians.sh[stride * i + k] = float(sh0_of_color(row[kBeforeSh + k] / extras.colors->full));
        if (extras.filter) add_filter(row[kBeforeSh + stride], log_scales, gaussians.opacity_logits[i]);
    });
    if (wide) set_world_means(gaussians, positions);
    if (density) fit_opacities(gaussians, true);
    return scene;
}

std::vector<std::string> write_ply(const std::filesystem::path& path, const Gaussians& gaussians,
                                   const SaveOptions& options) {
    const size_t n = gaussians.size();
    assert(gaussians.means.size() == 3 * n && gaussians.quaternions.size() == 4 * n);
    assert(gaussians.log_scales.size() == 3 * n && gaussians.sh.size() == gaussians.sh_stride() * n);
    core::AtomicFile file(path);
    file.write(ply_header(gaussians, options));
    constexpr size_t kRowsAtOnce = 4096;
    std::vector<float> rows;
    for (size_t i = 0; i < n; ++i) {
        append_ply_row(gaussians, i, rows);
        if ((i + 1) % kRowsAtOnce == 0 || i + 1 == n) {
            file.write(rows.data(), rows.size() * sizeof(float));
            rows.clear();
            if (options.progress) options.progress(i + 1, n);
        }
    }
    file.commit();
    return {};
}

}  // namespace ewa::io
