// SPDX-License-Identifier: Apache-2.0
// The format of GaussianSplats3D (mkkellogg), little endian: a header of 4096 bytes, section headers of 1024 bytes,
// then the data of each section.
//   header    byte 0   u8 version 0.1          4  u32 section headers       20  u16 compression level (0 to 2)
//             36  float32 least SH value      40  float32 largest SH value; 0 stands for -1.5 and 1.5
//   section   byte 0   u32 splats              4  u32 splats for which there is room
//             8   u32 splats of a full bucket 12  u32 buckets               16  float32 width of a bucket
//             20  u16 bytes of a bucket       24  u32 range of positions; 0 stands for 32767
//             32  u32 full buckets            36  u32 partly filled buckets 40  u16 SH degree
//   data      u32 splats of each partly filled bucket, float32 x y z of the middle of each bucket, then per splat
//             position   3 x float32; level 1 and 2: 3 x u16, minus the range, in steps of half the width / range
//                        from the middle of its bucket
//             scale      3 x float32 (level 1 and 2: float16), linear
//             rotation   4 x float32 (level 1 and 2: float16), w x y z
//             colour     u8 r g b, opacity
//             SH         degree by degree, red before green before blue: float32, float16, or at level 2 u8 between
//                        the least and largest value
#include <glm/gtc/packing.hpp>

#include "core/file_reader.h"
#include "io/splats/formats.h"
#include "io/splats/splat_values.h"

namespace ewa::io {

namespace {

constexpr size_t kKsplatHeader = 4096, kKsplatSection = 1024;
constexpr double kUsualShRange = 1.5;
constexpr uint32_t kUsualRange = 32767;

template <class T>
T value_at(const std::byte* bytes, size_t offset) {
    T value;
    std::memcpy(&value, bytes + offset, sizeof(T));
    return value;
}

struct KsplatHeader {
    int level = 0;
    double least_sh = 0, largest_sh = 0;
    size_t float_bytes() const { return level == 0 ? 4 : 2; }  // of positions, scales and rotations
    size_t sh_bytes() const { return level == 0 ? 4 : level == 1 ? 2 : 1; }
};

struct KsplatSection {
    uint64_t count = 0, room = 0, bucket_size = 0, buckets = 0, bucket_bytes = 0, full = 0, partial = 0;
    double width = 0;
    uint32_t range = 0;
    int degree = 0;
    size_t sh_values() const { return 3 * (size_t(sh_coefficients(degree)) - 1); }
};

class KsplatReader {
  public:
    explicit KsplatReader(const std::filesystem::path& path) : reader_(path) {}

    SplatScene read() {
        const uint32_t count = read_header();
        reader_.require_room(count, kKsplatSection, "section headers");
        std::vector<KsplatSection> sections(count);
        uint64_t splats = 0;
        Gaussians& g = scene_.gaussians;
        for (KsplatSection& section : sections) {
            section = read_section();
            splats += section.count;
            if (section.count > 0) g.sh_degree = std::max(g.sh_degree, section.degree);
        }
        scene_.format = SplatFormat::ksplat;
        scene_.variant = "compression level " + std::to_string(header_.level);
        scene_.file_sh_degree = g.sh_degree;
        // Before the allocation: the file must hold the splats.
        reader_.require_room(splats, 10 * header_.float_bytes() + 4, "splats");
        require_memory(reader_.name(), reader_.size(), splats, g.sh_degree);
        g.resize(size_t(splats));
        for (const KsplatSection& section : sections) read_data(section);
        return std::move(scene_);
    }

  private:
    /// Returns the number of section headers.
    uint32_t read_header() {
        const std::byte* bytes = reader_.take(kKsplatHeader, "the header");
        const auto major = value_at<uint8_t>(bytes, 0), minor = value_at<uint8_t>(bytes, 1);
        const auto level = value_at<uint16_t>(bytes, 20);
        if (major != 0 || minor < 1)
            reader_.fail("ksplat version " + std::to_string(major) + "." + std::to_string(minor) +
                         " is unknown; 0.1 is supported");
        if (level > 2) reader_.fail("the compression level " + std::to_string(level) + " is not 0 to 2");
        header_.level = level;
        const auto least = value_at<float>(bytes, 36), largest = value_at<float>(bytes, 40);
        header_.least_sh = least != 0 ? double(least) : -kUsualShRange;
        header_.largest_sh = largest != 0 ? double(largest) : kUsualShRange;
        return value_at<uint32_t>(bytes, 4);
    }

    KsplatSection read_section() {
        const std::byte* bytes = reader_.take(kKsplatSection, "a section header");
        const auto word = [&](size_t offset) { return value_at<uint32_t>(bytes, offset); };
        const KsplatSection section{.count = word(0),
                                    .room = word(4),
                                    .bucket_size = word(8),
                                    .buckets = word(12),
                                    .bucket_bytes = value_at<uint16_t>(bytes, 20),
                                    .full = word(32),
                                    .partial = word(36),
                                    .width = value_at<float>(bytes, 16),
                                    .range = word(24) != 0 ? word(24) : kUsualRange,
                                    .degree = value_at<uint16_t>(bytes, 40)};
        if (section.count > section.room)
            reader_.fail("a section has " + std::to_string(section.count) + " splats, and room for " +
                         std::to_string(section.room));
        if (section.degree > kMaxShDegree)
            reader_.fail("a section's SH degree " + std::to_string(section.degree) + " is not 0 to 3");
        return section;
    }

    void read_data(const KsplatSection& section) {
        reader_.require_room(section.partial, 4, "sizes of buckets");
        std::vector<uint32_t> sizes(size_t(section.partial));
        for (uint32_t& size : sizes) size = reader_.read<uint32_t>("the sizes of buckets");
        reader_.require_room(section.buckets, section.bucket_bytes, "buckets");
        std::vector<std::array<float, 3>> middles;
        if (section.bucket_bytes < sizeof(middles[0]) && section.buckets > 0 && header_.level > 0)
            reader_.fail("a bucket of " + std::to_string(section.bucket_bytes) + " bytes has no position");
        if (header_.level > 0) middles.resize(size_t(section.buckets));
        for (std::array<float, 3>& middle : middles)
            std::memcpy(&middle, reader_.take(section.bucket_bytes, "the buckets"), sizeof(middle));
        if (header_.level == 0) reader_.skip(section.buckets * section.bucket_bytes, "the buckets");

        const size_t bytes_each = 10 * header_.float_bytes() + 4 + section.sh_values() * header_.sh_bytes();
        reader_.require_room(section.room, bytes_each, "splats");
        uint64_t bucket = 0, left = 0;  // left: splats of the bucket that follow
        for (uint64_t i = 0; i < section.count; ++i, ++next_) {
            if (header_.level > 0) {
                for (bucket += i > 0 && left == 0; left == 0; bucket += left == 0) {
                    if (bucket >= section.buckets || bucket >= section.full + section.partial)
                        reader_.fail("splat " + std::to_string(next_) + " is in no bucket");
                    left = bucket < section.full ? section.bucket_size : sizes[size_t(bucket - section.full)];
                }
                --left;
            }
            decode(section, reader_.take(bytes_each, "a splat"),
                   header_.level > 0 ? middles[size_t(bucket)].data() : nullptr);
        }
        reader_.skip((section.room - section.count) * bytes_each, "a section");
    }

    /// Float number `index` of a splat.
    double number(const std::byte* bytes, size_t index) const {
        return header_.level == 0 ? double(value_at<float>(bytes, 4 * index))
                                  : double(glm::unpackHalf1x16(value_at<uint16_t>(bytes, 2 * index)));
    }

    void decode(const KsplatSection& section, const std::byte* bytes, const float* middle) {
        Gaussians& g = scene_.gaussians;
        const size_t i = next_, stride = g.sh_stride();
        for (size_t k = 0; k < 3; ++k) {
            double place = 0;
            if (header_.level == 0)
                place = number(bytes, k);
            else
                place = (double(value_at<uint16_t>(bytes, 2 * k)) - section.range) *
                            (section.width / 2 / section.range) +
                        double(middle[k]);
            g.means[3 * i + k] = float(place);
            g.log_scales[3 * i + k] = log_of_scale(number(bytes, 3 + k));
        }
        for (size_t k = 0; k < 4; ++k) g.quaternions[4 * i + k] = float(number(bytes, 6 + k));
        const std::byte* color = bytes + 10 * header_.float_bytes();
        for (size_t k = 0; k < 3; ++k)
            g.sh[stride * i + k] = float(sh0_of_color(value_at<uint8_t>(color, k) / 255.0));
        g.opacity_logits[i] = float(logit_of_level(value_at<uint8_t>(color, 3), 255));
        decode_sh(section, color + 4, &g.sh[stride * i]);
    }

    void decode_sh(const KsplatSection& section, const std::byte* bytes, float* sh) const {
        size_t next = 0;
        for (int degree = 1; degree <= section.degree; ++degree)
            for (size_t channel = 0; channel < 3; ++channel)
                for (int k = sh_coefficients(degree - 1); k < sh_coefficients(degree); ++k, ++next) {
                    double value = 0;
                    if (header_.level < 2)
                        value = number(bytes, next);
                    else
                        value = header_.least_sh + (header_.largest_sh - header_.least_sh) *
                                                       (value_at<uint8_t>(bytes, next) / 255.0);
                    sh[3 * size_t(k) + channel] = float(value);
                }
    }

    core::FileReader reader_;
    KsplatHeader header_;
    SplatScene scene_;
    size_t next_ = 0;  // splat
};

}  // namespace

SplatScene read_ksplat(const std::filesystem::path& path) {
    return KsplatReader(path).read();
}

}  // namespace ewa::io
