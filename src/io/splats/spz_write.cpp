// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>
#include <optional>

#include "core/atomic_file.h"
#include "ewa/error.h"
#include "io/splats/splat_scene.h"
#include "io/splats/splat_values.h"
#include "io/splats/spz.h"
#include "io/splats/spz_layout.h"
#include "io/splats/unpacking.h"

namespace ewa::io {

namespace {

using namespace spz;

constexpr int kUsualFractionalBits = 12;
constexpr double kLargestFixed = (1 << 23) - 1;

/// As many fractional bits as usual, or as leave room for the largest coordinate.
int fractional_bits(const std::filesystem::path& path, const Gaussians& gaussians) {
    double largest = 0;
    size_t where = 0;
    for (size_t i = 0; i < gaussians.means.size(); ++i)
        if (std::abs(double(gaussians.means[i])) > largest) {
            largest = std::abs(double(gaussians.means[i]));
            where = i / 3;
        }
    for (int bits = kUsualFractionalBits; bits >= 0; --bits)
        if (std::round(std::ldexp(largest, bits)) <= kLargestFixed) return bits;
    throw InputError(path.string() + ": splat " + std::to_string(where) + " has the coordinate " +
                     std::to_string(largest) +
                     ", and SPZ holds none beyond 8388607; move or scale the scene");
}

class Encoder {
  public:
    Encoder(const Gaussians& gaussians, int bits) : g_(gaussians), bits_(bits) {}

    size_t clamped() const { return clamped_; }  // values beyond what their byte holds

    void encode(Block block, size_t i, uint8_t* to) {
        switch (block) {
            case positions:
                for (size_t k = 0; k < 3; ++k) {
                    const auto fixed =
                        int32_t(std::round(std::ldexp(double(kFlip[k] * g_.means[3 * i + k]), bits_)));
                    for (size_t byte = 0; byte < 3; ++byte) to[3 * k + byte] = uint8_t(fixed >> (8 * byte));
                }
                return;
            case opacities:
                to[0] = to_byte(sigmoid(g_.opacity_logits[i]) * 255);
                return;
            case colors:
                for (size_t k = 0; k < 3; ++k)
                    to[k] = counted(g_.sh[g_.sh_stride() * i + k] * kColorScale + kColorOffset);
                return;
            case scales:
                for (size_t k = 0; k < 3; ++k)
                    to[k] = counted((g_.log_scales[3 * i + k] + kScaleOffset) * kScaleSteps);
                return;
            case rotations:
                return encode_rotation(i, to);
            case sh:
                for (size_t k = 3; k < g_.sh_stride(); ++k) {
                    const double v = kFlipSh[k / 3 - 1] * double(g_.sh[g_.sh_stride() * i + k]);
                    to[k - 3] = encode_sh(v, k < 12 ? 8 : 16);
                }
                return;
            case kBlocks:
                return;
        }
    }

  private:
    uint8_t counted(double v) {
        clamped_ += !(v >= -0.5 && v < 255.5);
        return to_byte(v);
    }

    /// In steps, with zero on one of them, so that it packs better.
    uint8_t encode_sh(double v, int step) {
        const double level = std::round(v * kShSteps) + kShSteps;
        const int half = step / 2;
        const double stepped = std::floor((level + half) / step) * step;
        clamped_ += !(stepped >= 0 && stepped <= 256);
        return to_byte(stepped);
    }

    void encode_rotation(size_t i, uint8_t* to) const {
        const std::array<double, 4> wxyz = unit_quaternion(&g_.quaternions[4 * i]);
        const std::array<double, 4> q = {kFlip[0] * wxyz[1], kFlip[1] * wxyz[2], kFlip[2] * wxyz[3], wxyz[0]};
        const size_t largest = largest_component(q);
        const bool negate = q[largest] < 0;  // -q is the same rotation
        uint32_t word = uint32_t(largest);
        for (size_t k = 0; k < 4; ++k) {
            if (k == largest) continue;
            const uint32_t sign = (q[k] < 0) != negate;
            const uint32_t magnitude =
                to_level(std::abs(q[k]) * std::numbers::sqrt2 * kRotationSteps, kRotationSteps);
            word = word << 10 | sign << 9 | magnitude;
        }
        for (size_t byte = 0; byte < 4; ++byte) to[byte] = uint8_t(word >> (8 * byte));
    }

    const Gaussians& g_;
    int bits_;
    size_t clamped_ = 0;
};

void write_block(Block block, size_t bytes_each, Encoder& encoder, size_t count, Packer& packer) {
    if (bytes_each == 0) return;
    constexpr size_t kSplatsAtOnce = 4096;
    std::vector<uint8_t> bytes(kSplatsAtOnce * bytes_each);
    for (size_t begin = 0; begin < count; begin += kSplatsAtOnce) {
        const size_t n = std::min(kSplatsAtOnce, count - begin);
        for (size_t i = 0; i < n; ++i) encoder.encode(block, begin + i, &bytes[i * bytes_each]);
        packer.write(reinterpret_cast<const std::byte*>(bytes.data()), n * bytes_each);
    }
}

std::vector<std::byte> header(const Gaussians& gaussians, const SaveOptions& options, int bits) {
    std::vector<std::byte> bytes(kHeaderBytes);
    const uint32_t words[3] = {kMagic, uint32_t(options.spz_version), uint32_t(gaussians.size())};
    std::memcpy(bytes.data(), words, sizeof(words));
    bytes[12] = std::byte(gaussians.sh_degree);
    bytes[13] = std::byte(bits);
    bytes[14] = std::byte(options.antialiased ? kAntialiased : 0);
    return bytes;
}

using Sizes = std::array<size_t, kBlocks>;

void write_gzipped(core::AtomicFile& file, const std::vector<std::byte>& head, const Sizes& sizes,
                   Encoder& encoder, size_t count, const SaveOptions& options) {
    const std::unique_ptr<Packer> packer =
        make_gzip([&](const void* bytes, size_t n) { file.write(bytes, n); });
    packer->write(head.data(), head.size());
    for (int block = 0; block < kBlocks; ++block) {
        write_block(Block(block), sizes[size_t(block)], encoder, count, *packer);
        if (options.progress) options.progress(count * uint64_t(block + 1) / kBlocks, count);
    }
    packer->finish();
}

void write_streams(core::AtomicFile& file, std::vector<std::byte> head, const Sizes& sizes, Encoder& encoder,
                   size_t count, const SaveOptions& options) {
    std::vector<uint64_t> table;
    std::vector<std::byte> packed;
    for (int block = 0; block < kBlocks; ++block) {
        const uint64_t unpacked = uint64_t(sizes[size_t(block)]) * count;
        if (unpacked == 0) continue;
        const size_t before = packed.size();
        const std::unique_ptr<Packer> packer = make_zstd(
            [&](const void* bytes, size_t n) {
                const auto* from = static_cast<const std::byte*>(bytes);
                packed.insert(packed.end(), from, from + n);
            },
            unpacked);
        write_block(Block(block), sizes[size_t(block)], encoder, count, *packer);
        packer->finish();
        table.insert(table.end(), {packed.size() - before, unpacked});
        if (options.progress) options.progress(count * uint64_t(block + 1) / kBlocks, count);
    }
    head[15] = std::byte(table.size() / 2);
    head.resize(kPackedHeaderBytes);
    const auto table_at = uint32_t(kPackedHeaderBytes);
    std::memcpy(&head[kHeaderBytes], &table_at, sizeof(table_at));
    file.write(head.data(), head.size());
    file.write(table.data(), table.size() * sizeof(table[0]));
    file.write(packed.data(), packed.size());
}

}  // namespace

std::vector<std::string> write_spz(const std::filesystem::path& path, const Gaussians& gaussians,
                                   const SaveOptions& options) {
    if (options.spz_version != 3 && options.spz_version != 4)
        throw InputError("SPZ version " + std::to_string(options.spz_version) +
                         " cannot be written; 3 and 4 can");
    if (gaussians.size() > std::numeric_limits<uint32_t>::max())
        throw InputError(path.string() + ": SPZ holds no more than 4294967295 splats");
    const int bits = fractional_bits(path, gaussians);
    const Sizes sizes = block_bytes(uint32_t(options.spz_version), gaussians.sh_degree);
    Encoder encoder(gaussians, bits);
    core::AtomicFile file(path);
    const std::vector<std::byte> head = header(gaussians, options, bits);
    if (options.spz_version == 3)
        write_gzipped(file, head, sizes, encoder, gaussians.size(), options);
    else
        write_streams(file, head, sizes, encoder, gaussians.size(), options);
    file.commit();

    std::vector<std::string> remarks = {"positions are rounded to 1/" + std::to_string(1 << bits) +
                                        ", scales to 1/16 of their logarithm, colours and opacities to 8 "
                                        "bits, rotations to 10 bits a component"};
    if (gaussians.sh_degree > 0)
        remarks.push_back("SH coefficients have 5 bits (degree 1) and 4 bits (others), clamped to -1..1");
    if (encoder.clamped() > 0)
        remarks.push_back(std::to_string(encoder.clamped()) +
                          " scales, colours and SH coefficients are beyond what SPZ holds and are clamped");
    return remarks;
}

}  // namespace ewa::io
