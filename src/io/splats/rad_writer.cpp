// SPDX-License-Identifier: Apache-2.0
// Writes Spark's .rad, whose layout rad.h describes, in the encodings that Spark writes.
#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/atomic_file.h"
#include "core/parallel.h"
#include "core/typing.h"
#include "ewa/splat_edit.h"
#include "io/splats/formats.h"
#include "io/splats/rad.h"
#include "io/splats/rad_values.h"
#include "io/splats/render_mark.h"
#include "io/splats/splat_values.h"
#include "io/splats/unpacking.h"
#include "scene/splat_arrays.h"

namespace ewa::io {

namespace {

using nlohmann::ordered_json;

/// The least part of a range of logarithms that steps are given to; what is smaller gets its lower end.
constexpr double kMostScales = 21;
constexpr double kLeastSh = 1e-6;
constexpr size_t kMeasured = size_t(1) << 18;  // splats that ranges are measured on
/// Trees have up to twice as many, whose indices have 32 bits.
constexpr uint64_t kMostRadSplats = uint64_t(1) << 31;

struct Range {
    double low = 0, high = 0;

    double step(double value, int steps) const {
        return std::clamp(std::round((value - low) / (high - low) * steps), 0.0, double(steps));
    }
    double rounded(double value, int steps) const { return low + step(value, steps) / steps * (high - low); }
};

/// The range between `least` and `all` whose steps miss the values least, in squares of at most 1. Values outside get its ends. So
/// single values far out do not make all others coarse, and values that are on the steps of `all` stay.
Range best_range(const std::vector<float>& values, const Range& least, const Range& all, int steps) {
    Range best = all;
    double error = std::numeric_limits<double>::infinity();
    constexpr int kTried = 16;
    for (int k = 0; k <= kTried; ++k) {
        const double part = k == kTried ? 0 : std::exp2(-k / 3.0);
        const Range range = {double(float(least.low + part * (all.low - least.low))),
                             double(float(least.high + part * (all.high - least.high)))};
        if (!(range.low < range.high)) break;
        double sum = 0;
        for (const float value : values) {
            const double missed = value - range.rounded(value, steps);
            sum += std::min(missed * missed, 1.0);
        }
        if (sum < error) {
            error = sum;
            best = range;
        }
    }
    return best;
}

void append(std::string& to, const void* bytes, size_t count) {
    to.append(static_cast<const char*>(bytes), count);
}

void append_head(std::string& to, uint32_t magic, const ordered_json& meta) {
    const std::string text = meta.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
    const auto length = uint32_t(text.size());
    append(to, &magic, sizeof(magic));
    append(to, &length, sizeof(length));
    to += text;
    to.resize((to.size() + 7) / 8 * 8, '\0');
}

std::string deflated(const std::string& bytes) {
    std::string packed;
    const std::unique_ptr<Packer> packer =
        make_deflate([&](const void* from, size_t n) { append(packed, from, n); });
    packer->write(reinterpret_cast<const std::byte*>(bytes.data()), bytes.size());
    packer->finish();
    return packed;
}

class RadWriter {
  public:
    RadWriter(const Gaussians& scene, const RadTree& tree, const SaveOptions& options)
        : levels_(1, &scene), nodes_(tree.nodes), options_(options) {
        for (const Gaussians& level : tree.coarser) levels_.push_back(&level);
        measure();
    }

    void write(const std::filesystem::path& path) {
        constexpr size_t kAtOnce = 16;  // chunks between two calls of progress
        std::vector<std::string> chunks((nodes_.size() + kRadChunk - 1) / kRadChunk);
        for (size_t begin = 0; begin < chunks.size(); begin += kAtOnce) {
            const size_t end = std::min(chunks.size(), begin + kAtOnce);
            core::on_all_cores(end - begin, [&](size_t k) {
                const size_t first = (begin + k) * kRadChunk;
                chunks[begin + k] = chunk(first, std::min(nodes_.size(), first + kRadChunk));
            });
            const size_t splats = levels_[0]->size();
            if (options_.progress) options_.progress(splats * end / chunks.size(), splats);
        }
        std::string head;
        append_head(head, kRadMagic, meta(chunks));
        core::AtomicFile file(path);
        file.write(head);
        for (const std::string& bytes : chunks) file.write(bytes);
        file.commit();
    }

    std::vector<std::string> remarks() const {
        std::vector<std::string> lines = {
            "colours and opacities are rounded to 8 bits, scales to 1/" +
            std::to_string(std::lround(kScaleSteps / (scales_.high - scales_.low))) +
            " of their logarithm, rotations to 8 bits per component"};
        if (degree() > 0) lines.emplace_back("SH coefficients are rounded to 8 bits");
        if (clamped_ > 0)
            lines.push_back(std::to_string(clamped_) +
                            " colours and SH coefficients are far from all others and are clamped");
        return lines;
    }

  private:
    bool tree() const { return levels_.size() > 1; }
    int degree() const { return levels_[0]->sh_degree; }
    /// The first value of an SH degree among a splat's.
    static size_t first_of(int degree) { return 3 * size_t(sh_coefficients(degree - 1)); }

    /// Calls visit(value) for these SH values of every `step`-th splat.
    template <class Visit>
    void visit_sh(size_t begin, size_t end, size_t step, const Visit& visit) const {
        for (const Gaussians* level : levels_)
            for (size_t i = 0; i < level->size(); i += step)
                for (size_t k = begin; k < end; ++k) visit(level->sh[level->sh_stride() * i + k]);
    }

    /// The range of these SH values, as `to` converts them. least: what it has at least.
    template <class Convert>
    Range range_of(size_t begin, size_t end, const Range& least, int steps, const Convert& to) const {
        Range all = least;
        visit_sh(begin, end, 1, [&](float value) {
            all = {std::min(all.low, to(value)), std::max(all.high, to(value))};
        });
        if (least.low == -least.high) all.low = -(all.high = std::max(all.high, -all.low));
        std::vector<float> some;
        visit_sh(begin, end, levels_[0]->size() / kMeasured + 1,
                 [&](float value) { some.push_back(float(to(value))); });
        return best_range(some, least, all, steps);
    }

    void measure() {
        colors_ = range_of(0, 3, {0, 1}, 255, [](float value) { return color_of_sh0(double(value)); });
        for (int sh = 1; sh <= degree(); ++sh)
            harmonics_[size_t(sh - 1)] =
                range_of(first_of(sh), first_of(sh + 1), {-kLeastSh, kLeastSh}, 254, [](float value) {
                    return double(value);
                }).high;
        // From the smallest size that an image can show to the largest one.
        Range range = {std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
        std::vector<float> sizes;
        for (const Gaussians* level : levels_)
            for (const float scale : level->log_scales)
                if (scale > kRadNoSize) {
                    range = {std::min(range.low, double(scale)), std::max(range.high, double(scale))};
                    sizes.push_back(scale);
                }
        if (!(range.low <= range.high)) range = {-12, 9};
        // A single splat far larger than the scene must not leave the others without steps.
        if (!sizes.empty() && range.high - range.low > kMostScales) {
            const auto middle = sizes.begin() + std::ptrdiff_t(sizes.size() / 2);
            std::nth_element(sizes.begin(), middle, sizes.end());
            if (*middle < range.high - kMostScales) range.high = double(*middle + float(kMostScales / 2));
        }
        range.low = double(float(std::max(range.low, range.high - kMostScales)));
        scales_ = {range.low, std::max(range.high, double(float(range.low + 1e-3)))};
    }

    ordered_json ranges() const {
        return {{"rgbMin", colors_.low},      {"rgbMax", colors_.high},  {"lnScaleMin", scales_.low},
                {"lnScaleMax", scales_.high}, {"sh1Max", harmonics_[0]}, {"sh2Max", harmonics_[1]},
                {"sh3Max", harmonics_[2]},    {"lodOpacity", tree()}};
    }

    ordered_json meta(const std::vector<std::string>& chunks) const {
        ordered_json value = {
            {"version", 1}, {"type", "gsplat"}, {"count", nodes_.size()}, {"maxSh", degree()}};
        if (tree()) value["lodTree"] = true;
        value["chunkSize"] = kRadChunk;
        size_t all = 0;
        value["allChunkBytes"] = 0;
        value["chunks"] = ordered_json::array();
        for (const std::string& chunk : chunks) {
            value["chunks"].push_back({{"offset", all}, {"bytes", chunk.size()}});
            all += chunk.size();
        }
        value["allChunkBytes"] = all;
        value["splatEncoding"] = ranges();
        std::string comment;
        for (const std::string& line : marked_comments(options_))
            comment += (comment.empty() ? "" : "\n") + line;
        if (!comment.empty()) value["comment"] = comment;
        return value;
    }

    /// The properties of a chunk.
    struct Payload {
        ordered_json properties = ordered_json::array();
        std::string bytes;

        void add(const char* name, RadEncoding encoding, const std::string& values,
                 const Range* range = nullptr) {
            const std::string packed = deflated(values);
            ordered_json property = {{"offset", bytes.size()},
                                     {"bytes", packed.size()},
                                     {"property", name},
                                     {"encoding", name_of(encoding)},
                                     {"compression", "gz"}};
            if (range) {
                property["min"] = range->low;
                property["max"] = range->high;
            }
            properties.push_back(std::move(property));
            bytes += packed;
            bytes.resize((bytes.size() + 7) / 8 * 8, '\0');
        }
    };

    /// The splats of a chunk.
    Gaussians part_of(size_t begin, size_t end) const {
        Gaussians part;
        part.sh_degree = degree();
        part.resize(end - begin);
        for (size_t i = 0; i < part.size(); ++i) {
            const RadNode& node = nodes_[begin + i];
            scene::copy_splats(*levels_[node.level], node.index, 1, part, i);
        }
        return part;
    }

    std::string chunk(size_t begin, size_t end) {
        const Gaussians part = part_of(begin, end);
        const size_t count = part.size(), stride = part.sh_stride();
        Payload payload;
        std::string places;
        for (int byte = 0; byte < 4; ++byte)
            places += planes(count, 3, [&](size_t i, size_t k) {
                return std::bit_cast<uint32_t>(part.means[3 * i + k]) >> (8 * byte);
            });
        payload.add("center", RadEncoding::f32_lebytes, places);
        const Range opacities = {0, 1};
        const auto opacity = [&](size_t i, size_t) {
            return opacities.step(sigmoid(double(part.opacity_logits[i])), 255);
        };
        payload.add("alpha", RadEncoding::r8, planes(count, 1, opacity), &opacities);
        uint8_t before = 0;
        const auto color = [&](size_t i, size_t k) {
            const auto level = uint8_t(step_in(colors_, color_of_sh0(double(part.sh[stride * i + k])), 255));
            const auto delta = uint8_t(level - (i == 0 ? 0 : before));
            before = level;
            return delta;
        };
        payload.add("rgb", RadEncoding::r8_delta, planes(count, 3, color), &colors_);
        const auto scale = [&](size_t i, size_t k) {
            const double value = part.log_scales[3 * i + k];
            return value > kRadNoSize ? 1 + scales_.step(value, kScaleSteps) : 0;
        };
        payload.add("scales", RadEncoding::ln_0r8, planes(count, 3, scale), &scales_);
        std::string turns;
        for (size_t i = 0; i < count; ++i)
            append(turns, packed_turn(unit_quaternion(&part.quaternions[4 * i])).data(), 3);
        payload.add("orientation", RadEncoding::oct88r8, turns);
        for (int sh = 1; sh <= degree(); ++sh) {
            const size_t first = first_of(sh);
            const Range range = {-harmonics_[size_t(sh - 1)], harmonics_[size_t(sh - 1)]};
            const auto value = [&](size_t i, size_t k) {
                return int8_t(step_in(range, double(part.sh[stride * i + first + k]), 254) - 127);
            };
            payload.add(("sh" + std::to_string(sh)).c_str(), RadEncoding::s8,
                        planes(count, first_of(sh + 1) - first, value), &range);
        }
        if (tree()) add_children(payload, begin, end);
        ordered_json value = {{"version", 1},
                              {"base", begin},
                              {"count", end - begin},
                              {"payloadBytes", payload.bytes.size()},
                              {"maxSh", degree()}};
        if (tree()) value["lodTree"] = true;
        value["splatEncoding"] = ranges();
        value["properties"] = std::move(payload.properties);
        std::string bytes;
        append_head(bytes, kRadChunkMagic, value);
        const uint64_t size = payload.bytes.size();
        append(bytes, &size, sizeof(size));
        return bytes + payload.bytes;
    }

    /// The bytes that byte_of gives, the first one of all splats before the second one.
    template <class ByteOf>
    static std::string planes(size_t count, size_t numbers, const ByteOf& byte_of) {
        std::string bytes;
        bytes.reserve(count * numbers);
        for (size_t k = 0; k < numbers; ++k)
            for (size_t i = 0; i < count; ++i) bytes.push_back(char(uint8_t(byte_of(i, k))));
        return bytes;
    }

    double step_in(const Range& range, double value, int steps) {
        const double half = (range.high - range.low) / steps / 2;
        if (value < range.low - half || value > range.high + half) ++clamped_;
        return range.step(value, steps);
    }

    void add_children(Payload& payload, size_t begin, size_t end) const {
        std::string counts, starts;
        for (size_t row = begin; row < end; ++row) {
            append(counts, &nodes_[row].child_count, sizeof(uint16_t));
            append(starts, &nodes_[row].child_start, sizeof(uint32_t));
        }
        payload.add("child_count", RadEncoding::u16, counts);
        payload.add("child_start", RadEncoding::u32, starts);
    }

    static constexpr int kScaleSteps = 254;

    std::vector<const Gaussians*> levels_;
    const std::vector<RadNode>& nodes_;
    const SaveOptions& options_;
    Range colors_, scales_;
    std::array<double, 3> harmonics_ = {1, 1, 1};  // the largest value of SH degrees 1 to 3
    std::atomic<uint64_t> clamped_{0};             // values
};

}  // namespace

std::vector<std::string> write_rad(const std::filesystem::path& path, const Gaussians& gaussians,
                                   const SaveOptions& options) {
    if (gaussians.size() > kMostRadSplats)
        throw InputError(path.string() + ": a .rad has no more than " + std::to_string(kMostRadSplats) +
                         " splats");
    const bool as_tree = options.levels > 1 && gaussians.size() > 1;
    RadTree tree;
    if (as_tree)
        tree = build_rad_tree(gaussians, options.levels);
    else
        for (const uint32_t i : morton_order(gaussians)) tree.nodes.push_back({i, 0, 0, 0});
    RadWriter writer(gaussians, tree, options);
    writer.write(path);
    std::string order = "the splats are in Morton order";
    if (as_tree) {
        order = "a tree of levels with " + std::to_string(gaussians.size());
        for (const Gaussians& level : tree.coarser) order += ", " + std::to_string(level.size());
        order += " splats";
    }
    std::vector<std::string> remarks = writer.remarks();
    remarks.insert(remarks.begin(), order);
    return remarks;
}

}  // namespace ewa::io
