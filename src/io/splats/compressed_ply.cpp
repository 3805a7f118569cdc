// SPDX-License-Identifier: Apache-2.0
// SuperSplat's compressed PLY (playcanvas/splat-transform, write-compressed-ply.ts): a PLY container with the
// elements
//   chunk    a box per 256 splats: float min_x..z max_x..z, min_scale_x..z max_scale_x..z (logarithms),
//            min_r..b max_r..b (colours; older files lack them, which means 0..1)
//   vertex   uint packed_position, packed_scale   11, 10 and 11 bits from the top, within the chunk's box
//            uint packed_rotation                 2 bits: which of w x y z is the largest;
//                                                 each other component c as c / sqrt(2) + 0.5 in 10 bits
//            uint packed_color                    8 bits each: r g b within the chunk's box, opacity
//   sh       uchar f_rest_i, channel-major: v = (byte + 0.5) / 32 - 4; the ends are -4 and 4
#include <numbers>

#include "core/atomic_file.h"
#include "core/text.h"
#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "io/splats/formats.h"
#include "io/splats/ply_table.h"
#include "io/splats/render_mark.h"
#include "io/splats/splat_values.h"

namespace ewa::io {

namespace {

constexpr size_t kChunkSplats = 256;
constexpr double kScaleLimit = 20;  // of a logarithm
constexpr double kShRange = 8;

const char* const kBoxNames[] = {"min_x",       "min_y",       "min_z",       "max_x",       "max_y",
                                 "max_z",       "min_scale_x", "min_scale_y", "min_scale_z", "max_scale_x",
                                 "max_scale_y", "max_scale_z", "min_r",       "min_g",       "min_b",
                                 "max_r",       "max_g",       "max_b"};
constexpr size_t kBoxValues = std::size(kBoxNames), kColorsFrom = 12;
const char* const kPackedNames[] = {"packed_position", "packed_rotation", "packed_scale", "packed_color"};

/// As in the file: three ranges of three axes each, minima before maxima in each range.
using Box = std::array<float, kBoxValues>;

double unpacked(const Box& box, size_t range, size_t axis, double t) {
    const double low = box[6 * range + axis], high = box[6 * range + 3 + axis];
    return low * (1 - t) + high * t;
}

std::array<double, 3> unpack_11_10_11(uint32_t v) {
    return {double(v >> 21) / 2047, double(v >> 11 & 1023) / 1023, double(v & 2047) / 2047};
}

uint32_t pack_11_10_11(const std::array<double, 3>& t) {
    return to_level(t[0] * 2047, 2047) << 21 | to_level(t[1] * 1023, 1023) << 11 |
           to_level(t[2] * 2047, 2047);
}

void unpack_rotation(uint32_t v, float* q) {
    const size_t largest = v >> 30;
    double sum = 0;
    int shift = 20;
    for (size_t i = 0; i < 4; ++i) {
        if (i == largest) continue;
        const double c = (double(v >> shift & 1023) / 1023 - 0.5) * std::numbers::sqrt2;
        q[i] = float(c);
        sum += c * c;
        shift -= 10;
    }
    q[largest] = float(std::sqrt(std::max(0.0, 1 - sum)));
}

uint32_t pack_rotation(const float* stored) {
    const std::array<double, 4> q = unit_quaternion(stored);
    const size_t largest = largest_component(q);
    const double sign = q[largest] < 0 ? -1 : 1;
    uint32_t v = uint32_t(largest);
    for (size_t i = 0; i < 4; ++i)
        if (i != largest) v = v << 10 | to_level((sign * q[i] / std::numbers::sqrt2 + 0.5) * 1023, 1023);
    return v;
}

uint8_t pack_sh(double v) {
    return uint8_t(std::clamp(std::trunc((v / kShRange + 0.5) * 256), 0.0, 255.0));
}

double unpack_sh(double byte) {
    const double t = byte == 0 ? 0 : byte == 255 ? 1 : (byte + 0.5) / 256;
    return (t - 0.5) * kShRange;
}

std::vector<size_t> columns_of(const PlyTable& table, const PlyElement& element,
                               const std::vector<std::string>& names) {
    std::vector<size_t> columns;
    for (const std::string& name : names) {
        const std::optional<size_t> found = element.find_number(name);
        if (!found)
            throw InputError(table.name() + ": the element \"" + element.name + "\" has no number \"" + name +
                             "\", which SuperSplat's compressed layout needs");
        columns.push_back(*found);
    }
    return columns;
}

std::vector<Box> read_boxes(PlyTable& table) {
    const PlyElement& element = table.go_to("chunk");
    const bool colored = element.find("min_r").has_value();
    const std::vector<std::string> names(kBoxNames, kBoxNames + (colored ? kBoxValues : kColorsFrom));
    const std::vector<size_t> columns = columns_of(table, element, names);
    std::vector<Box> boxes(size_t(element.count));
    table.read(columns, [&](size_t i, const double* row) {
        Box& box = boxes[i];
        for (size_t k = 0; k < kBoxValues; ++k)
            box[k] = k < columns.size() ? float(row[k]) : k < kColorsFrom + 3 ? 0.0f : 1.0f;
    });
    return boxes;
}

void read_vertices(PlyTable& table, const std::vector<Box>& boxes, Gaussians& gaussians) {
    const PlyElement& element = table.go_to("vertex");
    const std::vector<size_t> columns =
        columns_of(table, element, {std::begin(kPackedNames), std::end(kPackedNames)});
    for (const size_t column : columns)
        if (element.properties[column].type != PlyType::uint32)
            throw InputError(table.name() + ": the property \"" + element.properties[column].name +
                             "\" is not a uint");
    if ((element.count + kChunkSplats - 1) / kChunkSplats != boxes.size())
        throw InputError(table.name() + ": " + std::to_string(element.count) +
                         " splats need a chunk for every " + std::to_string(kChunkSplats) +
                         ", but the element \"chunk\" has " + std::to_string(boxes.size()));
    require_memory(table.name(), table.file_bytes(), element.count, gaussians.sh_degree);
    gaussians.resize(size_t(element.count));
    table.read(columns, [&](size_t i, const double* row) {
        const Box& box = boxes[i / kChunkSplats];
        const auto word = [](double v) { return v >= 0 && v <= 4294967295.0 ? uint32_t(v) : 0u; };
        const std::array<double, 3> place = unpack_11_10_11(word(row[0])),
                                    scale = unpack_11_10_11(word(row[2]));
        const uint32_t color = word(row[3]);
        for (size_t k = 0; k < 3; ++k) {
            gaussians.means[3 * i + k] = float(unpacked(box, 0, k, place[k]));
            gaussians.log_scales[3 * i + k] = float(unpacked(box, 1, k, scale[k]));
            const double t = double(color >> (24 - 8 * k) & 255) / 255;
            gaussians.sh[gaussians.sh_stride() * i + k] = float(sh0_of_color(unpacked(box, 2, k, t)));
        }
        unpack_rotation(word(row[1]), &gaussians.quaternions[4 * i]);
        gaussians.opacity_logits[i] = float(logit_of_level(color & 255, 255));
    });
}

int sh_degree_of(const PlyTable& table) {
    for (const PlyElement& element : table.elements()) {
        if (element.name != "sh") continue;
        for (int degree = 1; degree <= kMaxShDegree; ++degree)
            if (element.properties.size() == 3 * (size_t(sh_coefficients(degree)) - 1)) return degree;
        throw InputError(table.name() + ": the element \"sh\" has " +
                         std::to_string(element.properties.size()) +
                         " properties, which does not fit any SH degree (9, 24 or 45 are degree 1 to 3)");
    }
    return 0;
}

void read_sh(PlyTable& table, Gaussians& gaussians) {
    const PlyElement& element = table.go_to("sh");
    if (element.count != gaussians.size())
        throw InputError(table.name() + ": the element \"sh\" has " + std::to_string(element.count) +
                         " rows for " + std::to_string(gaussians.size()) + " splats");
    const size_t per_channel = size_t(sh_coefficients(gaussians.sh_degree)) - 1;
    std::vector<std::string> names;
    for (size_t k = 0; k < per_channel; ++k)
        for (size_t channel = 0; channel < 3; ++channel)
            names.push_back("f_rest_" + std::to_string(channel * per_channel + k));
    const std::vector<size_t> columns = columns_of(table, element, names);
    for (const size_t column : columns)
        if (element.properties[column].type != PlyType::uint8)
            throw InputError(table.name() + ": the property \"" + element.properties[column].name +
                             "\" is not a uchar");
    table.read(columns, [&](size_t i, const double* row) {
        float* sh = &gaussians.sh[gaussians.sh_stride() * i] + 3;
        for (size_t k = 0; k < columns.size(); ++k) sh[k] = float(unpack_sh(row[k]));
    });
}

std::string header(const Gaussians& gaussians, const SaveOptions& options) {
    const std::string count = std::to_string(gaussians.size());
    std::string text = "ply\nformat binary_little_endian 1.0\n";
    for (const std::string& comment : marked_comments(options)) text += "comment " + comment + "\n";
    text += "element chunk " + std::to_string((gaussians.size() + kChunkSplats - 1) / kChunkSplats) + "\n";
    for (const char* name : kBoxNames) text += std::string("property float ") + name + "\n";
    text += "element vertex " + count + "\n";
    for (const char* name : kPackedNames) text += std::string("property uint ") + name + "\n";
    if (gaussians.sh_degree > 0) text += "element sh " + count + "\n";
    for (int i = 0; i < 3 * (sh_coefficients(gaussians.sh_degree) - 1); ++i)
        text += "property uchar f_rest_" + std::to_string(i) + "\n";
    return text + "end_header\n";
}

/// The values that a chunk's box bounds: mean, clamped log scale, colour.
std::array<double, 9> bounded(const Gaussians& gaussians, size_t i) {
    std::array<double, 9> values{};
    for (size_t k = 0; k < 3; ++k) {
        values[k] = gaussians.means[3 * i + k];
        values[3 + k] = std::clamp(double(gaussians.log_scales[3 * i + k]), -kScaleLimit, kScaleLimit);
        values[6 + k] = color_of_sh0(gaussians.sh[gaussians.sh_stride() * i + k]);
    }
    return values;
}

Box box_of(const Gaussians& gaussians, const uint32_t* begin, const uint32_t* end) {
    Box box{};
    for (const uint32_t* index = begin; index != end; ++index) {
        const std::array<double, 9> values = bounded(gaussians, *index);
        for (size_t k = 0; k < 9; ++k) {
            float& low = box[k / 3 * 6 + k % 3];
            float& high = box[k / 3 * 6 + 3 + k % 3];
            low = index == begin ? float(values[k]) : std::min(low, float(values[k]));
            high = index == begin ? float(values[k]) : std::max(high, float(values[k]));
        }
    }
    return box;
}

std::array<uint32_t, 4> packed(const Gaussians& gaussians, size_t i, const Box& box) {
    const std::array<double, 9> values = bounded(gaussians, i);
    std::array<double, 9> t{};
    for (size_t k = 0; k < 9; ++k) {
        const double low = box[k / 3 * 6 + k % 3], high = box[k / 3 * 6 + 3 + k % 3];
        t[k] = high > low ? (values[k] - low) / (high - low) : 0;
    }
    uint32_t color = 0;
    for (size_t k = 0; k < 3; ++k) color = color << 8 | to_byte(t[6 + k] * 255);
    color = color << 8 | to_byte(sigmoid(gaussians.opacity_logits[i]) * 255);
    return {pack_11_10_11({t[0], t[1], t[2]}), pack_rotation(&gaussians.quaternions[4 * i]),
            pack_11_10_11({t[3], t[4], t[5]}), color};
}

void write_chunks(core::AtomicFile& file, const Gaussians& gaussians, const std::vector<uint32_t>& order,
                  const SaveOptions& options) {
    const auto chunk_end = [&](size_t begin) { return std::min(begin + kChunkSplats, order.size()); };
    std::vector<Box> boxes;
    for (size_t begin = 0; begin < order.size(); begin += kChunkSplats)
        boxes.push_back(box_of(gaussians, order.data() + begin, order.data() + chunk_end(begin)));
    file.write(boxes.data(), boxes.size() * sizeof(Box));
    std::vector<std::array<uint32_t, 4>> rows;
    for (size_t begin = 0; begin < order.size(); begin += kChunkSplats) {
        rows.clear();
        for (size_t i = begin; i < chunk_end(begin); ++i)
            rows.push_back(packed(gaussians, order[i], boxes[begin / kChunkSplats]));
        file.write(rows.data(), rows.size() * sizeof(rows[0]));
        if (options.progress) options.progress(chunk_end(begin), order.size());
    }
}

void write_sh(core::AtomicFile& file, const Gaussians& gaussians, const std::vector<uint32_t>& order) {
    const size_t stride = gaussians.sh_stride();
    encode_in_pieces(
        order.size(), stride - 3,
        [&](size_t i, std::byte* to) {
            for (size_t channel = 0; channel < 3; ++channel)
                for (size_t k = 3; k < stride; k += 3)
                    *to++ = std::byte(pack_sh(gaussians.sh[stride * order[i] + k + channel]));
        },
        [&](const std::byte* bytes, size_t size, size_t) { file.write(bytes, size); });
}

}  // namespace

bool is_compressed_ply(const PlyTable& table) {
    const auto& elements = table.elements();
    return std::any_of(elements.begin(), elements.end(), [](const PlyElement& element) {
        return element.name == "vertex" && element.find("packed_position").has_value();
    });
}

SplatScene read_compressed_ply(const std::filesystem::path& path) {
    PlyTable table(path);
    SplatScene scene;
    scene.format = SplatFormat::compressed_ply;
    scene.comments = table.comments();
    take_marks(scene);
    scene.gaussians.sh_degree = scene.file_sh_degree = sh_degree_of(table);
    const std::vector<Box> boxes = read_boxes(table);
    read_vertices(table, boxes, scene.gaussians);
    if (scene.gaussians.sh_degree > 0) read_sh(table, scene.gaussians);
    return scene;
}

std::vector<std::string> write_compressed_ply(const std::filesystem::path& path, const Gaussians& gaussians,
                                              const SaveOptions& options) {
    // The bytes of a coefficient have no 0.
    if (const int present = sh_degree_present(gaussians); present < gaussians.sh_degree) {
        Gaussians lower = gaussians;
        set_sh_degree(lower, present);
        return write_compressed_ply(path, lower, options);
    }
    const std::vector<uint32_t> order = morton_order(gaussians);
    core::AtomicFile file(path);
    file.write(header(gaussians, options));
    write_chunks(file, gaussians, order, options);
    if (gaussians.sh_degree > 0) write_sh(file, gaussians, order);
    file.commit();
    std::vector<std::string> remarks = {
        "the splats are in Morton order",
        "positions and scales have 11, 10 and 11 bits in the box of their 256 splats, colours 8 bits in it, "
        "opacities 8 bits, rotations 10 bits per component"};
    if (gaussians.sh_degree > 0)
        remarks.push_back("SH coefficients of degree 1 and more have 8 bits, clamped to -4..4");
    return remarks;
}

}  // namespace ewa::io
