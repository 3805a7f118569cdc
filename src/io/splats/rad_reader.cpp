// SPDX-License-Identifier: Apache-2.0
// Reads Spark's .rad, whose layout rad.h describes.
#include <sys/stat.h>

#include <array>
#include <cmath>
#include <map>
#include <set>

#include "core/folders.h"
#include "core/messages.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/splat_edit.h"
#include "io/splats/formats.h"
#include "io/splats/rad.h"
#include "io/splats/rad_head.h"
#include "io/splats/render_mark.h"
#include "io/splats/splat_values.h"
#include "io/splats/unpacking.h"

namespace ewa::io {

namespace {

using enum RadEncoding;

/// At best, 2 bits of deflate encode a match of 258 bytes.
constexpr uint64_t kMostDeflated = 1032;
constexpr size_t kMostComments = 1000;

class RadReader {
  public:
    explicit RadReader(const std::filesystem::path& path)
        : folder_(path.parent_path()),
          reader_(path),
          head_(read_rad_head(reader_, folder_)),
          all_bytes_(bytes_of_chunks(path)) {}

    SplatScene read() {
        Gaussians& g = scene_.gaussians;
        scene_.format = SplatFormat::rad;
        scene_.file_sh_degree = g.sh_degree = head_.sh_degree;
        require_memory(reader_.name(), all_bytes_, head_.count, g.sh_degree, kPackedExpansion);
        g.resize(size_t(head_.count));
        if (head_.tree) nodes_.resize(g.size());
        for (size_t index = 0; index < head_.chunks.size(); ++index) {
            const RadChunkPlace& place = head_.chunks[index];
            if (!place.file) {
                read_chunk(reader_, place.offset, index);
                continue;
            }
            core::FileReader chunk(folder_ / *place.file);
            read_chunk(chunk, place.offset, index);
        }
        if (head_.tree) keep_leaves();
        add_comments();
        take_marks(scene_);
        if (!brighter_.empty())
            scene_.remarks.push_back("the opacity of " + core::counted(brighter_.size(), "splat") +
                                     " above 1 becomes 1");
        return std::move(scene_);
    }

  private:
    /// The bytes of all chunks. Those that several chunks claim count once, as many chunks may name one file.
    uint64_t bytes_of_chunks(const std::filesystem::path& path) const {
        struct File {
            uint64_t size = 0, used = 0;
        };
        std::map<std::pair<dev_t, ino_t>, File> files;  // links, soft or hard, name the same one
        std::map<std::optional<std::filesystem::path>, File*> named;
        for (const RadChunkPlace& place : head_.chunks) {
            File*& file = named[place.file];
            if (!file) {
                struct stat found {};
                if (stat((place.file ? folder_ / *place.file : path).c_str(), &found) != 0)
                    found = {};  // it is an error once it is read
                file = &files[{found.st_dev, found.st_ino}];
                file->size = place.file ? uint64_t(found.st_size) : reader_.size();
            }
            const uint64_t left = file->size - std::min(file->size, place.offset);
            file->used = std::min(file->size, file->used + std::min(left, place.bytes));
        }
        uint64_t bytes = 0;
        for (const auto& [name, file] : files) bytes += file.used;
        return bytes;
    }

    void read_chunk(core::FileReader& reader, uint64_t offset, size_t index) {
        reader.go_to(offset, "a chunk");
        const uint64_t base = uint64_t(index) * head_.chunk_size,
                       count = std::min(head_.chunk_size, head_.count - base);
        const RadProperties properties = read_rad_chunk_head(reader, base, count);
        base_ = size_t(base);
        in_chunk_ = size_t(count);
        decode_geometry(reader, properties);
        decode_colors(reader, properties);
        decode_harmonics(reader, properties);
        if (head_.tree) decode_tree(reader, properties);
    }

    static const RadProperties::value_type& required(const core::FileReader& reader,
                                                     const RadProperties& properties, std::string_view name) {
        const auto found = properties.find(name);
        if (found == properties.end()) reader.fail("a chunk has no property \"" + std::string(name) + "\"");
        return *found;
    }

    /// The unpacked bytes of so many splats or codes.
    std::vector<std::byte> bytes_of(core::FileReader& reader, const RadProperties::value_type& named,
                                    uint64_t count) {
        const auto& [name, property] = named;
        const std::string what = "the property \"" + name + "\"";
        const uint64_t size = rad_bytes(property.encoding, count, property.numbers);
        reader.go_to(property.offset, what);
        // Chunks may share their bytes, so that a small file could unpack to any size.
        constexpr uint64_t kMostAlways = uint64_t(100) << 20;
        unpacked_ += size;
        if (unpacked_ > 2 * kPackedExpansion * all_bytes_ + kMostAlways)
            reader.fail(what + ": all properties together unpack to more than " +
                        std::to_string(2 * kPackedExpansion) + " times the file and " +
                        core::bytes_text(kMostAlways));
        if (property.deflated ? size > kMostDeflated * property.bytes : size != property.bytes)
            reader.fail(what + " has " + std::to_string(property.bytes) + " bytes, which are not those of " +
                        std::to_string(count) + " splats or codes");
        if (!property.deflated) {
            const std::byte* bytes = reader.take(size_t(size), what);
            return {bytes, bytes + size};
        }
        std::vector<std::byte> bytes(static_cast<size_t>(size));
        const std::unique_ptr<Unpacker> unpacker = open_deflate(reader, property.bytes);
        unpacker->read(bytes.data(), bytes.size(), what);
        if (!unpacker->at_end())
            reader.fail(what + " unpacks to more than " + std::to_string(size) + " bytes");
        return bytes;
    }

    std::vector<float> values_of(core::FileReader& reader, const RadProperties::value_type& named,
                                 uint64_t count) {
        const RadProperty& property = named.second;
        return decode_rad(property.encoding, bytes_of(reader, named, count), size_t(count), property.numbers,
                          property.min, property.max);
    }

    /// Calls set(i, k, value) for number k of splat i.
    template <class Set>
    void decode(core::FileReader& reader, const RadProperties::value_type& named, const Set& set) {
        const std::vector<float> values = values_of(reader, named, in_chunk_);
        for (size_t at = 0; at < values.size(); ++at) set(base_ + at % in_chunk_, at / in_chunk_, values[at]);
    }

    void decode_geometry(core::FileReader& reader, const RadProperties& properties) {
        Gaussians& g = scene_.gaussians;
        decode(reader, required(reader, properties, "center"),
               [&](size_t i, size_t k, float value) { g.means[3 * i + k] = value; });
        const auto& scales = required(reader, properties, "scales");
        const bool logarithms = scales.second.encoding == ln_f16 || scales.second.encoding == ln_0r8;
        const float least = log_of_scale(0);
        decode(reader, scales, [&](size_t i, size_t k, float value) {
            g.log_scales[3 * i + k] = !logarithms     ? log_of_scale(double(value))
                                      : value < least ? least
                                                      : value;
        });
        decode(reader, required(reader, properties, "orientation"),
               [&](size_t i, size_t k, float value) { g.quaternions[4 * i + 1 + k] = value; });
        for (size_t i = base_; i < base_ + in_chunk_; ++i) {
            float* q = &g.quaternions[4 * i];
            const double rest = 1 - double(q[1]) * q[1] - double(q[2]) * q[2] - double(q[3]) * q[3];
            q[0] = float(std::sqrt(rest > 0 ? rest : 0.0));
        }
    }

    void decode_colors(core::FileReader& reader, const RadProperties& properties) {
        Gaussians& g = scene_.gaussians;
        const size_t stride = g.sh_stride();
        decode(reader, required(reader, properties, "rgb"), [&](size_t i, size_t k, float value) {
            g.sh[stride * i + k] = float(sh0_of_color(double(value)));
        });
        const auto& alpha = required(reader, properties, "alpha");
        const RadProperty& steps = alpha.second;
        // As logit_of_steps: the ends move inwards, so that they round back to themselves.
        double least = 1e-30, end = 0x1p-25;
        if (steps.encoding == r8 || steps.encoding == r8_delta)
            least = end = std::clamp(0.25 * (steps.max - steps.min) / 255, 1e-30, 0.25);
        decode(reader, alpha, [&](size_t i, size_t, float value) {
            if (value > 1) brighter_.push_back(uint32_t(i));
            g.opacity_logits[i] = float(logit(double(value), least, 1 - end));
        });
    }

    void decode_harmonics(core::FileReader& reader, const RadProperties& properties) {
        Gaussians& g = scene_.gaussians;
        const auto label = properties.find("sh_label");
        std::vector<uint32_t> labels;
        if (label != properties.end())
            labels = decode_rad_integers(label->second.encoding, bytes_of(reader, *label, in_chunk_));
        for (int degree = 1; degree <= g.sh_degree; ++degree) {
            const std::string name = "sh" + std::to_string(degree);
            const size_t first = 3 * size_t(sh_coefficients(degree - 1));
            std::vector<float>& codes = codes_[size_t(degree - 1)];
            if (const auto code = properties.find(name + "_code"); code != properties.end()) {
                require_memory(reader_.name(), all_bytes_, head_.codes, g.sh_degree, kPackedExpansion);
                codes = values_of(reader, *code, head_.codes);
            }
            if (properties.contains(name) || labels.empty())
                decode(reader, required(reader, properties, name),
                       [&](size_t i, size_t k, float value) { g.sh[g.sh_stride() * i + first + k] = value; });
            else
                copy_codes(reader, labels, codes, first);
        }
    }

    void copy_codes(const core::FileReader& reader, const std::vector<uint32_t>& labels,
                    const std::vector<float>& codes, size_t first) {
        Gaussians& g = scene_.gaussians;
        const size_t count = codes.empty() ? 0 : size_t(head_.codes);
        for (size_t i = 0; i < in_chunk_; ++i) {
            if (labels[i] >= count)
                reader.fail("splat " + std::to_string(base_ + i) + " has the \"sh_label\" " +
                            std::to_string(labels[i]) + ", and there are " + std::to_string(count) +
                            " codes");
            for (size_t at = labels[i], k = first; at < codes.size(); at += count, ++k)
                g.sh[g.sh_stride() * (base_ + i) + k] = codes[at];
        }
    }

    void decode_tree(core::FileReader& reader, const RadProperties& properties) {
        const auto integers = [&](const char* name) {
            const auto& property = required(reader, properties, name);
            return decode_rad_integers(property.second.encoding, bytes_of(reader, property, in_chunk_));
        };
        const std::vector<uint32_t> counts = integers("child_count"), starts = integers("child_start");
        for (size_t i = 0; i < in_chunk_; ++i) nodes_[base_ + i] = {counts[i], starts[i]};
    }

    /// Every splat but the first must be a child of one splat before it, so that the leaves stand for all of the tree.
    void keep_leaves() {
        std::vector<uint8_t> is_child(nodes_.size());
        std::vector<uint32_t> leaves;
        for (size_t i = 0; i < nodes_.size(); ++i) {
            const auto [count, start] = nodes_[i];
            if (i > 0 && !is_child[i])
                reader_.fail("splat " + std::to_string(i) +
                             " of the \"lodTree\" is a child of none before it");
            if (count == 0) leaves.push_back(uint32_t(i));
            if (count > 0 && (start <= i || start > nodes_.size() || count > nodes_.size() - start))
                reader_.fail("splat " + std::to_string(i) + " of the \"lodTree\" has the children " +
                             std::to_string(start) + " to " + std::to_string(uint64_t(start) + count - 1) +
                             ", and there are " + std::to_string(nodes_.size()) + " splats");
            for (size_t child = start; child < size_t(start) + count; ++child)
                if (is_child[child]++)
                    reader_.fail("splat " + std::to_string(child) +
                                 " of the \"lodTree\" is a child of two splats");
        }
        std::erase_if(brighter_, [&](uint32_t i) { return nodes_[i].count > 0; });
        scene_.variant = "tree of " + core::counted(nodes_.size(), "splat");
        nodes_ = {};
        keep_splats(scene_.gaussians, leaves);
    }

    void add_comments() {
        const std::string& text = head_.comment;
        for (size_t begin = 0; begin < text.size();) {
            if (scene_.comments.size() == kMostComments) {
                scene_.remarks.push_back("comments after the first " + std::to_string(kMostComments) +
                                         " are skipped");
                return;
            }
            const size_t end = std::min(text.find('\n', begin), text.size());
            scene_.comments.push_back(core::one_line(std::string_view(text).substr(begin, end - begin)));
            begin = end + 1;
        }
    }

    struct Children {
        uint32_t count, start;
    };

    std::filesystem::path folder_;
    core::FileReader reader_;
    RadHead head_;
    uint64_t all_bytes_ = 0, unpacked_ = 0;  // of the files; of the properties so far
    SplatScene scene_;
    std::vector<uint32_t> brighter_;           // splats with an opacity above 1
    size_t base_ = 0, in_chunk_ = 0;           // splats of the chunk that is read
    std::array<std::vector<float>, 3> codes_;  // of SH degrees 1 to 3
    std::vector<Children> nodes_;
};

}  // namespace

SplatScene read_rad(const std::filesystem::path& path) {
    return RadReader(path).read();
}

std::vector<std::filesystem::path> rad_files(const std::filesystem::path& path) try {
    if (!core::is_file(path)) return {};
    core::FileReader reader(path);
    std::set<std::filesystem::path> files;
    for (const RadChunkPlace& place : read_rad_head(reader, path.parent_path()).chunks)
        if (place.file) files.insert(path.parent_path() / *place.file);
    std::error_code ignored;
    std::erase_if(files, [&](const std::filesystem::path& file) {
        return !core::is_file(file) || std::filesystem::equivalent(file, path, ignored);
    });
    return {files.begin(), files.end()};
} catch (const InputError&) {
    return {};
}

}  // namespace ewa::io
