// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>
#include <numeric>

#include "io/splats/splat_scene.h"
#include "io/splats/splat_values.h"
#include "io/splats/spz.h"
#include "io/splats/spz_layout.h"
#include "io/splats/unpacking.h"

namespace ewa::io {

namespace {

using namespace spz;

constexpr uint64_t kMostGzipFolds = 1032;      // a match of 258 bytes in 2 bits
constexpr uint64_t kMostZstdFolds = 1u << 16;  // a block of 128 KiB in 4 bytes, and its share of the frame

struct Header {
    uint32_t version = 0, count = 0;
    int file_degree = 0;
    uint8_t fractional_bits = 0, flags = 0;
};

/// The first 16 bytes, which all versions have; bytes 4 to 15 where the magic was read already.
Header parse_header(const std::byte* bytes, const core::FileReader& reader) {
    uint32_t magic = 0;
    Header header;
    std::memcpy(&magic, bytes, 4);
    std::memcpy(&header.version, bytes + 4, 4);
    std::memcpy(&header.count, bytes + 8, 4);
    header.file_degree = int(bytes[12]);
    header.fractional_bits = uint8_t(bytes[13]);
    header.flags = uint8_t(bytes[14]);
    if (magic != kMagic) reader.fail("this is no SPZ file (its packed data does not start with \"NGSP\")");
    if (header.version < 1 || header.version > 4)
        reader.fail("SPZ version " + std::to_string(header.version) + " is not known; 1 to 4 are");
    if (header.file_degree > kMaxFileDegree)
        reader.fail("the header's SH degree " + std::to_string(header.file_degree) + " is not 0 to 4");
    if (header.fractional_bits > kMaxFractionalBits)
        reader.fail("the header's fractional bits " + std::to_string(header.fractional_bits) +
                    " are more than a position has");
    return header;
}

double half_to_double(uint16_t half) {
    const int exponent = half >> 10 & 31, mantissa = half & 1023;
    const double magnitude = exponent == 0    ? std::ldexp(mantissa, -24)
                             : exponent == 31 ? (mantissa ? NAN : INFINITY)
                                              : std::ldexp(mantissa + 1024, exponent - 25);
    return half & 0x8000 ? -magnitude : magnitude;
}

void decode_position(const Header& header, const uint8_t* bytes, float* mean) {
    for (size_t k = 0; k < 3; ++k) {
        double v;
        if (header.version == 1) {
            v = half_to_double(uint16_t(bytes[2 * k] | bytes[2 * k + 1] << 8));
        } else {
            const uint32_t raw = uint32_t(bytes[3 * k] | bytes[3 * k + 1] << 8 | bytes[3 * k + 2] << 16);
            const int32_t fixed = int32_t(raw << 8) >> 8;
            v = std::ldexp(double(fixed), -int(header.fractional_bits));
        }
        mean[k] = float(kFlip[k] * v);
    }
}

void decode_rotation(const Header& header, const uint8_t* bytes, float* quaternion) {
    double q[4] = {};  // x y z w
    double sum = 0;
    if (header.version < 3) {
        for (size_t k = 0; k < 3; ++k) {
            q[k] = bytes[k] / 127.5 - 1;
            sum += q[k] * q[k];
        }
        q[3] = std::sqrt(std::max(0.0, 1 - sum));
    } else {
        uint32_t word = uint32_t(bytes[0]) | uint32_t(bytes[1]) << 8 | uint32_t(bytes[2]) << 16 |
                        uint32_t(bytes[3]) << 24;
        const size_t largest = word >> 30;
        for (size_t i = 4; i-- > 0;) {
            if (i == largest) continue;
            const double magnitude = double(word & kRotationSteps) / kRotationSteps / std::numbers::sqrt2;
            q[i] = word >> 9 & 1 ? -magnitude : magnitude;
            sum += q[i] * q[i];
            word >>= 10;
        }
        q[largest] = std::sqrt(std::max(0.0, 1 - sum));
    }
    quaternion[0] = float(q[3]);
    for (size_t k = 0; k < 3; ++k) quaternion[1 + k] = float(kFlip[k] * q[k]);
}

/// One splat's bytes of a block.
void decode(const Header& header, Block block, const uint8_t* bytes, size_t i, Gaussians& g) {
    switch (block) {
        case positions:
            return decode_position(header, bytes, &g.means[3 * i]);
        case opacities:
            g.opacity_logits[i] = float(logit_of_level(bytes[0], 255));
            return;
        case colors:
            for (size_t k = 0; k < 3; ++k)
                g.sh[g.sh_stride() * i + k] = float((bytes[k] - kColorOffset) / kColorScale);
            return;
        case scales:
            for (size_t k = 0; k < 3; ++k)
                g.log_scales[3 * i + k] = float(bytes[k] / kScaleSteps - kScaleOffset);
            return;
        case rotations:
            return decode_rotation(header, bytes, &g.quaternions[4 * i]);
        case sh:
            for (size_t k = 3; k < g.sh_stride(); ++k)
                g.sh[g.sh_stride() * i + k] =
                    float(kFlipSh[k / 3 - 1] * (int(bytes[k - 3]) - kShSteps) / kShSteps);
            return;
        case kBlocks:
            return;
    }
}

void read_block(const Header& header, Block block, Unpacker& unpacker, Gaussians& gaussians) {
    const size_t bytes_each = block_bytes(header.version, header.file_degree)[block];
    if (bytes_each == 0) return;
    constexpr size_t kSplatsAtOnce = 4096;
    std::vector<uint8_t> bytes(kSplatsAtOnce * bytes_each);
    for (size_t begin = 0; begin < header.count; begin += kSplatsAtOnce) {
        const size_t n = std::min<size_t>(kSplatsAtOnce, header.count - begin);
        unpacker.read(reinterpret_cast<std::byte*>(bytes.data()), n * bytes_each, kBlockNames[block]);
        for (size_t i = 0; i < n; ++i) decode(header, block, &bytes[i * bytes_each], begin + i, gaussians);
    }
}

void take_header(const Header& header, const core::FileReader& reader, SplatScene& scene) {
    scene.format = SplatFormat::spz;
    scene.variant = "version " + std::to_string(header.version);
    scene.file_sh_degree = header.file_degree;
    scene.antialiased = header.flags & kAntialiased;
    scene.gaussians.sh_degree = std::min(header.file_degree, kMaxShDegree);
    if (header.file_degree > kMaxShDegree)
        scene.remarks.push_back("has SH degree 4; degrees above 3 are left out");
    require_memory(reader.name(), reader.size(), header.count, scene.gaussians.sh_degree, kPackedFolds);
    scene.gaussians.resize(header.count);
}

/// Throws where a packing method cannot make the splats' bytes of the file's, before memory is taken for
/// them.
void require_packed(const core::FileReader& reader, uint64_t count, uint64_t bytes_each,
                    uint64_t most_folds) {
    if (count * bytes_each > reader.size() * most_folds)
        reader.fail("the header claims " + std::to_string(count) + " splats of " +
                    std::to_string(bytes_each) + " bytes, which " + std::to_string(reader.size()) +
                    " packed bytes cannot hold");
}

SplatScene read_gzipped(core::FileReader& reader) {
    const std::unique_ptr<Unpacker> unpacker = open_gzip(reader);
    std::byte bytes[kHeaderBytes];
    unpacker->read(bytes, sizeof(bytes), "the header");
    const Header header = parse_header(bytes, reader);
    if (header.version > 3) reader.fail("SPZ version 4 is not packed with gzip; the file is damaged");
    const auto sizes = block_bytes(header.version, header.file_degree);
    require_packed(reader, header.count, std::accumulate(sizes.begin(), sizes.end(), size_t(0)),
                   kMostGzipFolds);
    SplatScene scene;
    take_header(header, reader, scene);
    for (int block = 0; block < kBlocks; ++block)
        read_block(header, Block(block), *unpacker, scene.gaussians);
    if (!unpacker->at_end()) scene.remarks.push_back("bytes behind the splats (extensions) are left out");
    return scene;
}

SplatScene read_streams(core::FileReader& reader) {
    std::byte bytes[kHeaderBytes];
    std::memcpy(bytes, reader.take(kHeaderBytes, "the header"), kHeaderBytes);
    const Header header = parse_header(bytes, reader);
    if (header.version != 4)
        reader.fail("SPZ version " + std::to_string(header.version) +
                    " is packed with gzip; the file is damaged");
    const auto streams = uint8_t(bytes[15]);
    const auto table = reader.read<uint32_t>("the header");
    reader.skip(12, "the header");
    if (table < kPackedHeaderBytes) reader.fail("the table of streams overlaps the header");
    SplatScene scene;
    if (table > kPackedHeaderBytes) scene.remarks.push_back("extension records are left out");
    reader.skip(table - kPackedHeaderBytes, "the extension records");

    struct Stream {
        Block block;
        uint64_t packed, unpacked;
    };
    std::vector<Stream> list;
    const auto sizes = block_bytes(header.version, header.file_degree);
    for (int block = 0; block < kBlocks; ++block)
        if (sizes[size_t(block)] * header.count > 0)
            list.push_back({Block(block), 0, uint64_t(sizes[size_t(block)]) * header.count});
    if (streams < list.size())
        reader.fail("the header names " + std::to_string(streams) + " streams; its splats need " +
                    std::to_string(list.size()));
    for (size_t i = 0; i < streams; ++i) {
        const auto packed = reader.read<uint64_t>("the table of streams");
        const auto unpacked = reader.read<uint64_t>("the table of streams");
        // Writers differ in whether an empty block has a stream; behind the last block only extensions can
        // come.
        if (i >= list.size()) continue;
        if (unpacked != list[i].unpacked)
            reader.fail(std::string(kBlockNames[list[i].block]) + " unpack to " + std::to_string(unpacked) +
                        " bytes; the header's splats make " + std::to_string(list[i].unpacked));
        list[i].packed = packed;
    }
    const uint64_t bytes_each = std::accumulate(sizes.begin(), sizes.end(), size_t(0));
    require_packed(reader, header.count, bytes_each, kMostZstdFolds);
    take_header(header, reader, scene);
    for (const Stream& stream : list) {
        if (stream.packed > reader.remaining())
            reader.fail(std::string(kBlockNames[stream.block]) + " claim " + std::to_string(stream.packed) +
                        " packed bytes, but only " + std::to_string(reader.remaining()) + " follow");
        const std::unique_ptr<Unpacker> unpacker = open_zstd(reader, stream.packed, stream.unpacked);
        const uint64_t end = reader.offset() + stream.packed;
        read_block(header, stream.block, *unpacker, scene.gaussians);
        if (!unpacker->at_end())
            reader.fail(std::string(kBlockNames[stream.block]) + " unpack to more bytes than the table says");
        reader.skip(end - reader.offset(), kBlockNames[stream.block]);
    }
    return scene;
}

}  // namespace

SplatScene read_spz(const std::filesystem::path& path) {
    core::FileReader reader(path);
    uint8_t first[2] = {};
    if (reader.size() < sizeof(first)) reader.fail("this is no SPZ file: it has less than 2 bytes");
    {
        core::FileReader peek(path);
        std::memcpy(first, peek.take(sizeof(first), "the header"), sizeof(first));
    }
    const bool gzipped = first[0] == 0x1f && first[1] == 0x8b;
    return gzipped ? read_gzipped(reader) : read_streams(reader);
}

}  // namespace ewa::io
