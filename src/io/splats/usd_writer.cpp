// SPDX-License-Identifier: Apache-2.0
// Writes OpenUSD's ParticleField3DGaussianSplat (OpenUSD 26.03 and later), as text (.usda) or in a package (.usdz).
//
// A prim of that type has the arrays
//   positions                                  in the frame of the prim
//   orientations                               unit quaternion w x y z
//   scales                                     linear standard deviations
//   opacities                                  linear, 0..1
//   radiance:sphericalHarmonicsCoefficients    (degree + 1)^2 RGB values a splat, in INRIA's order
// A package is a zip archive of stored entries, whose first one is the scene. Entries begin at multiples of 64 bytes.
//
// The stage has y up, z towards the viewer. Values are turned by 180 degrees about x from PLY's frame, SH too: whether a
// renderer turns SH by the transform of a parent is not settled.
#include <algorithm>
#include <array>
#include <charconv>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>

#include "core/atomic_file.h"
#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "io/splats/archive.h"
#include "io/splats/formats.h"
#include "io/splats/splat_values.h"

namespace ewa::io {

namespace {

constexpr const char* kType = "ParticleField3DGaussianSplat";
constexpr const char* kSh = "radiance:sphericalHarmonicsCoefficients";
constexpr const char* kShDegree = "radiance:sphericalHarmonicsDegree";

/// Y up and z towards the viewer from PLY's frame.
glm::dmat4 half_turn() {
    return glm::scale(glm::dmat4(1.0), glm::dvec3(1, -1, -1));
}

/// Text in pieces, so that the values of a large scene do not lie in memory as text.
class UsdWriter {
  public:
    explicit UsdWriter(std::function<void(std::string_view)> sink) : sink_(std::move(sink)) {}

    void line(std::string_view text) { (text_ += text) += '\n'; }

    /// An array of `count` elements of `each` numbers; value(i, k) is number k of element i.
    template <class Value>
    void array(const std::string& type, const std::string& name, size_t count, size_t each,
               const Value& value, const std::string& metadata = "") {
        ((text_ += "    " + type) += "[] ") += name + " = [";
        for (size_t i = 0; i < count; ++i) {
            text_ += i == 0 ? "" : ", ";
            if (each > 1) text_ += '(';
            for (size_t k = 0; k < each; ++k) {
                if (k > 0) text_ += ", ";
                number(value(i, k));
            }
            if (each > 1) text_ += ')';
            if (text_.size() > kPiece) flush();
        }
        line("]" + metadata);
    }

    void flush() {
        sink_(text_);
        text_.clear();
    }

  private:
    static constexpr size_t kPiece = 1 << 20;

    /// The shortest text that reads back as the same float32.
    void number(float value) {
        std::array<char, 32> digits;
        text_.append(digits.data(), std::to_chars(digits.begin(), digits.end(), value).ptr);
    }

    std::function<void(std::string_view)> sink_;
    std::string text_;
};

void write_layer(const Gaussians& g, const SaveOptions& options,
                 const std::function<void(std::string_view)>& sink) {
    UsdWriter writer(sink);
    const size_t n = g.size(), coefficients = size_t(sh_coefficients(g.sh_degree));
    std::array<glm::vec3, 2> box = {glm::vec3(n > 0 ? INFINITY : 0), glm::vec3(n > 0 ? -INFINITY : 0)};
    for (size_t i = 0; i < n; ++i) {
        const glm::vec3 mean(g.means[3 * i], g.means[3 * i + 1], g.means[3 * i + 2]);
        box = {glm::min(box[0], mean), glm::max(box[1], mean)};
    }
    writer.line("#usda 1.0\n(\n    defaultPrim = \"Splats\"\n    doc = \"ewa " EWA_VERSION
                "\"\n    metersPerUnit = 1\n    upAxis = \"Y\"\n)\n");
    writer.line(std::string("def ") + kType +
                " \"Splats\" (\n    prepend apiSchemas = [\"ColorSpaceAPI\"]\n)\n{");
    writer.line("    uniform token colorSpace:name = \"srgb_rec709_display\"");
    writer.line("    uniform token projectionModeHint = \"perspective\"");
    writer.line("    uniform token sortingModeHint = \"zDepth\"");
    writer.array("float3", "extent", 2, 3, [&](size_t i, size_t k) { return box[i][int(k)]; });
    writer.array("point3f", "positions", n, 3, [&](size_t i, size_t k) { return g.means[3 * i + k]; });
    writer.array("quatf", "orientations", n, 4,
                 [&](size_t i, size_t k) { return float(unit_quaternion(&g.quaternions[4 * i])[k]); });
    writer.array("float3", "scales", n, 3,
                 [&](size_t i, size_t k) { return scale_of_log(g.log_scales[3 * i + k]); });
    writer.array("float", "opacities", n, 1,
                 [&](size_t i, size_t) { return float(sigmoid(g.opacity_logits[i])); });
    writer.line("    uniform int " + std::string(kShDegree) + " = " + std::to_string(g.sh_degree));
    writer.array(
        "float3", kSh, n * coefficients, 3,
        [&](size_t i, size_t k) {
            if (options.progress && k == 0 && i % (coefficients << 12) == 0)
                options.progress(i / coefficients, n);
            return g.sh[3 * i + k];
        },
        " (\n        elementSize = " + std::to_string(coefficients) + "\n    )");
    writer.line("}");
    writer.flush();
}

}  // namespace

std::vector<std::string> write_usda(const std::filesystem::path& path, const Gaussians& gaussians,
                                    const SaveOptions& options) {
    Gaussians turned = gaussians;
    transform_splats(turned, half_turn());
    core::AtomicFile file(path);
    write_layer(turned, options, [&](std::string_view text) { file.write(text); });
    file.commit();
    return {};
}

std::vector<std::string> write_usdz(const std::filesystem::path& path, const Gaussians& gaussians,
                                    const SaveOptions& options) {
    Gaussians turned = gaussians;
    transform_splats(turned, half_turn());
    std::string text;
    write_layer(turned, options, [&](std::string_view piece) {
        text += piece;
        if (text.size() > std::numeric_limits<uint32_t>::max())
            throw InputError(path.string() + ": a .usdz is limited to 4 GiB; write a .usda");
    });
    constexpr size_t kAlignment = 64;
    ArchiveWriter archive;
    archive.add("splats.usda", text, kAlignment);
    core::write_text_file(path, archive.finish());
    return {};
}

}  // namespace ewa::io
