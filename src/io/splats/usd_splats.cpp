// SPDX-License-Identifier: Apache-2.0
// OpenUSD's ParticleField3DGaussianSplat (OpenUSD 26.03 and later), as text (.usda) or in a package (.usdz).
//
// A prim of that type has the arrays
//   positions                                  in the frame of the prim
//   orientations                               unit quaternion w x y z
//   scales                                     linear standard deviations
//   opacities                                  linear, 0..1
//   radiance:sphericalHarmonicsCoefficients    (degree + 1)^2 RGB values a splat, in INRIA's order
// or the same in half precision under names that end in h. A package is a zip archive of stored entries, whose first one
// is the scene. Entries begin at multiples of 64 bytes. Deflated ones are read too, as people make them with zip.
//
// The stage has y up, z towards the viewer. Values are turned by 180 degrees about x from PLY's frame, SH too: whether a
// renderer turns SH by the transform of a parent is not settled.
#include <algorithm>
#include <array>
#include <charconv>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>
#include <limits>

#include "core/atomic_file.h"
#include "core/file_reader.h"
#include "core/text.h"
#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "io/splats/archive.h"
#include "io/splats/formats.h"
#include "io/splats/linear_colors.h"
#include "io/splats/splat_values.h"
#include "io/splats/usd_text.h"
#include "io/splats/zip_files.h"

namespace ewa::io {

namespace {

constexpr const char* kType = "ParticleField3DGaussianSplat";
constexpr const char* kSh = "radiance:sphericalHarmonicsCoefficients";
constexpr const char* kShDegree = "radiance:sphericalHarmonicsDegree";

constexpr size_t kMostOps = 256;  // each is searched among the properties

/// Y up and z towards the viewer from PLY's frame, and back.
glm::dmat4 half_turn() {
    return glm::scale(glm::dmat4(1.0), glm::dvec3(1, -1, -1));
}

class UsdReader {
  public:
    /// nurec: the package of the layer has a file of NuRec.
    explicit UsdReader(const UsdText& layer, bool nurec = false) : layer_(layer), nurec_(nurec) {}

    SplatScene read() {
        glm::dmat4 to_ply = half_turn();
        if (usd_metadata(layer_.metadata(), "upAxis") == "Z")
            to_ply = glm::dmat4({1, 0, 0, 0}, {0, 0, 1, 0}, {0, -1, 0, 0}, {0, 0, 0, 1});
        for (const UsdPrim& prim : layer_.prims()) visit(prim, to_ply);
        if (fields_ == 0) fail_without_fields();
        if (clamped_ > 0) remark(clamped_opacities_remark(clamped_));
        scene_.format = SplatFormat::usda;
        scene_.variant = std::to_string(fields_) + (fields_ == 1 ? " particle field" : " particle fields");
        return std::move(scene_);
    }

  private:
    [[noreturn]] void fail_without_fields() const {
        if (nurec_ || layer_.contains("OmniNuRec"))
            throw InputError(layer_.name() + ": holds a NuRec volume, which Omniverse alone draws; " +
                             "export the splats from the program that trained them as " + kType +
                             " or as a PLY, since usdcat does not convert it");
        layer_.fail(0, std::string("no prim has the type ") + kType +
                           "; a scene of several layers becomes one with usdcat --flatten");
    }

    void visit(const UsdPrim& prim, const glm::dmat4& parent) {
        if (prim.specifier != "def" || usd_metadata(prim.metadata, "active") == "false") return;
        for (const char* outside : {"references", "payload", "inherits", "specializes"})
            if (usd_metadata(prim.metadata, outside))
                remark("references to other prims and files are skipped");
        if (prim.variants) remark("variants are skipped");
        if (const UsdProperty* visibility = prim.property("visibility"))
            if (layer_.word(*visibility) == "invisible") {
                remark("invisible prims are skipped");
                return;
            }
        const glm::dmat4 matrix = placed(prim, parent);
        if (prim.type == kType) add(prim, matrix);
        for (const UsdPrim& child : prim.children) visit(child, matrix);
    }

    /// The frame of the prim: column vectors, applied from the last of xformOpOrder to the first.
    glm::dmat4 placed(const UsdPrim& prim, glm::dmat4 parent) {
        const UsdProperty* order = prim.property("xformOpOrder");
        if (!order) return parent;
        const std::vector<std::string> ops = layer_.words(*order);
        if (ops.size() > kMostOps)
            layer_.fail(order->value, "more than " + std::to_string(kMostOps) + " transforms of a prim");
        for (const std::string& op : ops) {
            if (op == "!resetXformStack!") layer_.fail(order->value, "!resetXformStack! is not supported");
            const UsdProperty* value = prim.property(op);
            if (!value) layer_.fail(order->value, core::one_line(op) + " has no value");
            parent = parent * operation(op, *value);
        }
        return parent;
    }

    glm::dmat4 operation(const std::string& op, const UsdProperty& value) {
        const glm::dmat4 one(1.0);
        const std::string_view prefix = "xformOp:";
        std::string name = op.starts_with(prefix) ? op.substr(prefix.size()) : op;
        name = name.substr(0, name.find(':'));
        if (name == "translate" || name == "scale") {
            const std::vector<double> v = layer_.doubles(value, 3);
            return name == "scale" ? glm::scale(one, {v[0], v[1], v[2]})
                                   : glm::translate(one, {v[0], v[1], v[2]});
        }
        if (name == "orient") {
            const std::vector<double> q = layer_.doubles(value, 4);
            return glm::mat4_cast(glm::normalize(glm::dquat(q[0], q[1], q[2], q[3])));
        }
        if (name == "transform") {  // rows of a matrix for row vectors are columns of one for column vectors
            const std::vector<double> m = layer_.doubles(value, 16);
            glm::dmat4 matrix;
            for (int i = 0; i < 16; ++i) matrix[i / 4][i % 4] = m[size_t(i)];
            return matrix;
        }
        const std::string axes = name.starts_with("rotate") ? name.substr(6) : "";
        if (axes.empty() || axes.size() > 3 || axes.find_first_not_of("XYZ") != std::string::npos)
            layer_.fail(value.value, core::one_line(op) + " is not supported");
        // rotateXYZ turns about x first.
        const std::vector<double> degrees = layer_.doubles(value, axes.size());
        glm::dmat4 matrix = one;
        for (size_t i = axes.size(); i-- > 0;) {
            glm::dvec3 axis(0.0);
            axis[axes[i] - 'X'] = 1;
            const size_t which = axes.size() == 1 ? 0 : size_t(axes[i] - 'X');
            if (which >= degrees.size()) layer_.fail(value.value, core::one_line(op) + " is not supported");
            matrix = glm::rotate(matrix, glm::radians(degrees[which]), axis);
        }
        return matrix;
    }

    void add(const UsdPrim& prim, const glm::dmat4& matrix) {
        ++fields_;
        Gaussians part = field(prim);
        try {
            transform_splats(part, matrix);
        } catch (const InputError& error) {
            layer_.fail(prim.byte, error.what());
        }
        if (fields_ == 1)
            scene_.gaussians = std::move(part);
        else
            append_splats(scene_.gaussians, part);
    }

    Gaussians field(const UsdPrim& prim) {
        const std::vector<float> positions = array(prim, "positions", 3);
        const std::vector<float> scales = array(prim, "scales", 3);
        const std::vector<float> orientations = array(prim, "orientations", 4);
        const std::vector<float> opacities = array(prim, "opacities", 1);
        const size_t count = opacities.size();
        const auto require = [&](const char* name, size_t elements) {
            if (elements != count)
                layer_.fail(prim.byte, prim.name + ": " + std::to_string(elements) + " " + name + " and " +
                                           std::to_string(count) + " opacities");
        };
        require("positions", positions.size() / 3);
        require("scales", scales.size() / 3);
        require("orientations", orientations.size() / 4);
        Gaussians g;
        g.means = positions;
        g.quaternions = orientations;
        g.log_scales.reserve(scales.size());
        for (const float scale : scales) g.log_scales.push_back(log_of_scale(scale));
        g.opacity_logits.reserve(count);
        for (const float opacity : opacities) {
            clamped_ += opacity < 0 || opacity > 1;
            g.opacity_logits.push_back(float(logit_of_opacity(opacity)));
        }
        read_sh(prim, g);
        return g;
    }

    void read_sh(const UsdPrim& prim, Gaussians& g) {
        const UsdProperty* degree = prim.property(kShDegree);
        const double stated = degree ? layer_.doubles(*degree, 1)[0] : 3;
        if (!(stated >= 0 && stated <= 10)) layer_.fail(degree->value, "the SH degree is not one of 0 to 10");
        const size_t each = 3 * size_t(sh_coefficients(int(stated)));
        const std::vector<float> all = array(prim, kSh, 3);
        if (all.size() != each * g.size())
            layer_.fail(prim.byte, prim.name + ": " + std::to_string(all.size() / 3) +
                                       " SH coefficients for " + std::to_string(g.size()) +
                                       " splats of SH degree " + std::to_string(int(stated)));
        g.sh_degree = std::min(int(stated), kMaxShDegree);
        scene_.file_sh_degree = std::max(scene_.file_sh_degree, int(stated));
        if (stated > kMaxShDegree) remark("SH degrees above 3 are skipped");
        g.sh.reserve(g.size() * g.sh_stride());
        for (size_t i = 0; i < g.size(); ++i) {
            const auto first = all.begin() + std::ptrdiff_t(i * each);
            g.sh.insert(g.sh.end(), first, first + std::ptrdiff_t(g.sh_stride()));
        }
        const UsdProperty* space = prim.property("colorSpace:name");
        if (space && layer_.word(*space).starts_with("lin_")) remark(linear_colors_to_srgb(g));
    }

    /// The array of this name, or of its half precision.
    std::vector<float> array(const UsdPrim& prim, const std::string& name, size_t each) const {
        const UsdProperty* property = prim.property(name);
        if (!property) property = prim.property(name + "h");
        if (property) return layer_.floats(*property, each);
        if (prim.property(name + ".timeSamples"))
            layer_.fail(prim.byte, prim.name + ": " + name + " change with time, which ewa does not read");
        layer_.fail(prim.byte, prim.name + " has no " + name);
    }

    void remark(const std::string& text) {
        if (std::find(scene_.remarks.begin(), scene_.remarks.end(), text) == scene_.remarks.end())
            scene_.remarks.push_back(text);
    }

    const UsdText& layer_;
    bool nurec_;
    SplatScene scene_;
    int fields_ = 0;        // read so far
    uint64_t clamped_ = 0;  // opacities
};

SplatScene read_layer(const std::filesystem::path& path, const std::string& entry, std::string text,
                      bool nurec = false) {
    const std::string name =
        core::one_line(path.string()) + (entry.empty() ? "" : ": \"" + core::one_line(entry) + "\"");
    if (text.starts_with("PXR-USDC"))
        throw InputError(name +
                         ": is OpenUSD's binary format; usdcat --flatten IN -o OUT.usda makes text of it, "
                         "which ewa reads");
    const UsdText layer(name, std::move(text));
    return UsdReader(layer, nurec).read();
}

// Writing.

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

SplatScene read_usda(const std::filesystem::path& path) {
    return read_layer(path, "", core::read_text_file(path));
}

SplatScene read_usdz(const std::filesystem::path& path) {
    const ZipFiles archive(path);
    const auto& entries = archive.entries();
    if (entries.empty()) throw InputError(core::one_line(path.string()) + ": the package is empty");
    const bool nurec = std::ranges::any_of(
        entries, [](const auto& entry) { return core::lower(entry.name.extension().string()) == ".nurec"; });
    SplatScene scene = read_layer(path, entries.front().name.string(), archive.text(entries.front()), nurec);
    scene.format = SplatFormat::usdz;
    return scene;
}

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
