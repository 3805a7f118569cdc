// SPDX-License-Identifier: Apache-2.0
// SPZ (nianticlabs/spz): one block per attribute, as a structure of arrays, quantised, then compressed.
//   versions 1 to 3   one gzip stream: a header of 16 bytes, then the blocks, then extensions where a flag says so; some
//                     programs leave it unpacked
//   version 4         a header of 32 bytes, extension records, a table of (compressed, decompressed) sizes,
//                     then one Zstandard frame per block
// The blocks, in this order, per splat:
//   positions   3 x 24-bit signed fixed point with the header's fractional bits (version 1: 3 x float16)
//   opacities   u8
//   colours     3 x u8: 0.15 * 255 * (SH coefficient 0) + 127.5
//   scales      3 x u8: 16 * (ln s + 10)
//   rotations   4 bytes: index of the largest of x y z w, then sign and 9 bits of each other in 1/sqrt(2)
//               (versions 1 and 2: x y z in 3 x u8: 127.5 q + 127.5, w >= 0)
//   SH          3 x u8 per coefficient, RGB inner: 128 v + 128, in steps of 8 (degree 1) or 16 (others)
// The file's frame is RUB (y up, z back). So y and z, their quaternion components, and the SH that are odd in
// them change sign.
#include <cmath>
#include <glm/gtc/packing.hpp>
#include <numbers>
#include <numeric>

#include "core/atomic_file.h"
#include "ewa/error.h"
#include "io/splats/formats.h"
#include "io/splats/splat_values.h"
#include "io/splats/unpacking.h"

namespace ewa::io {

namespace {

constexpr uint32_t kSpzMagic = 0x5053474e;                    // "NGSP"
constexpr size_t kHeaderBytes = 16, kPackedHeaderBytes = 32;  // versions 1 to 3; version 4
constexpr uint8_t kAntialiased = 1, kExtended = 2;            // flags
constexpr int kMaxSpzDegree = 4;
constexpr unsigned kMaxFractionalBits = 24;
constexpr double kColorScale = 0.15 * 255, kColorOffset = 0.5 * 255;
constexpr double kScaleSteps = 16, kScaleOffset = 10;
constexpr double kShSteps = 128;
constexpr uint32_t kRotationSteps = 511;

enum Block { positions, opacities, colors, scales, rotations, sh, kBlocks };
constexpr const char* kBlockNames[kBlocks] = {"the positions", "the opacities", "the colours",
                                              "the scales",    "the rotations", "the SH coefficients"};

/// Bytes per splat of each block.
constexpr std::array<size_t, kBlocks> block_bytes(uint32_t version, int file_degree) {
    return {version == 1 ? size_t(6) : size_t(9),          1, 3, 3, version >= 3 ? size_t(4) : size_t(3),
            3 * (size_t(sh_coefficients(file_degree)) - 1)};
}

/// Signs of the means, of the quaternion's x y z, and of the SH basis (from coefficient 1) if y and z are
/// negated.
constexpr std::array<int, 3> kFlip = {1, -1, -1};
constexpr std::array<int, 15> kFlipSh = {-1, -1, 1, -1, 1, 1, -1, 1, -1, 1, -1, -1, 1, -1, 1};

constexpr uint64_t kMostGzipExpansion = 1032;      // at best, 2 bits encode a match of 258 bytes
constexpr uint64_t kMostZstdExpansion = 1u << 16;  // at best, 4 bytes encode a block of 128 KiB

struct Header {
    uint32_t version = 0, count = 0;
    int file_degree = 0;
    uint8_t fractional_bits = 0, flags = 0;
};

/// Parses the first 16 bytes, which all versions share.
Header parse_header(const std::byte* bytes, const core::FileReader& reader) {
    uint32_t magic = 0;
    Header header;
    std::memcpy(&magic, bytes, 4);
    std::memcpy(&header.version, bytes + 4, 4);
    std::memcpy(&header.count, bytes + 8, 4);
    header.file_degree = int(bytes[12]);
    header.fractional_bits = uint8_t(bytes[13]);
    header.flags = uint8_t(bytes[14]);
    if (magic != kSpzMagic)
        reader.fail("this is not an SPZ file (its packed data does not start with \"NGSP\")");
    if (header.version < 1 || header.version > 4)
        reader.fail("SPZ version " + std::to_string(header.version) + " is unknown; 1 to 4 are supported");
    if (header.file_degree > kMaxSpzDegree)
        reader.fail("the header's SH degree " + std::to_string(header.file_degree) + " is not 0 to 4");
    if (header.fractional_bits > kMaxFractionalBits)
        reader.fail("the header has " + std::to_string(header.fractional_bits) +
                    " fractional bits, more than the 24 bits of a position");
    return header;
}

void decode_position(const Header& header, const uint8_t* bytes, float* mean) {
    for (size_t k = 0; k < 3; ++k) {
        double v;
        if (header.version == 1) {
            v = glm::unpackHalf1x16(uint16_t(bytes[2 * k] | bytes[2 * k + 1] << 8));
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

/// Decodes the bytes of one splat in a block.
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
        scene.remarks.push_back("has SH degree 4; degrees above 3 are skipped");
    require_memory(reader.name(), reader.size(), header.count, scene.gaussians.sh_degree, kPackedExpansion);
    scene.gaussians.resize(header.count);
}

/// Throws if the file is too short for its splats at the method's best compression. Call it before the
/// allocation.
void require_packed(const core::FileReader& reader, uint64_t count, uint64_t bytes_each,
                    uint64_t most_expansion) {
    if (count * bytes_each > reader.size() * most_expansion)
        reader.fail("the header claims " + std::to_string(count) + " splats of " +
                    std::to_string(bytes_each) + " bytes, which " + std::to_string(reader.size()) +
                    " packed bytes cannot hold");
}

/// Versions 1 to 3. gzipped: false where they lie in the file as they are.
SplatScene read_one_stream(core::FileReader& reader, bool gzipped) {
    const std::unique_ptr<Unpacker> unpacker = gzipped ? open_gzip(reader) : open_plain(reader);
    std::byte bytes[kHeaderBytes];
    unpacker->read(bytes, sizeof(bytes), "the header");
    const Header header = parse_header(bytes, reader);
    if (header.version > 3) reader.fail("SPZ version 4 is not packed with gzip; the file is damaged");
    const auto sizes = block_bytes(header.version, header.file_degree);
    require_packed(reader, header.count, std::accumulate(sizes.begin(), sizes.end(), size_t(0)),
                   gzipped ? kMostGzipExpansion : 1);
    SplatScene scene;
    take_header(header, reader, scene);
    for (int block = 0; block < kBlocks; ++block)
        read_block(header, Block(block), *unpacker, scene.gaussians);
    if (unpacker->at_end()) return scene;
    // All blocks begin at other places if the number of splats is wrong.
    if (!(header.flags & kExtended))
        reader.fail("the data goes on after the " + std::to_string(header.count) +
                    " splats that the header counts; the count or the SH degree is wrong");
    scene.remarks.push_back("bytes after the splats (extensions) are skipped");
    return scene;
}

SplatScene read_streams(core::FileReader& reader) {
    std::byte bytes[kHeaderBytes];
    std::memcpy(bytes, reader.take(kHeaderBytes, "the header"), kHeaderBytes);
    const Header header = parse_header(bytes, reader);
    if (header.version != 4) {
        reader.go_to(0, "the header");
        return read_one_stream(reader, false);
    }
    const auto streams = uint8_t(bytes[15]);
    const auto table = reader.read<uint32_t>("the header");
    reader.skip(12, "the header");
    if (table < kPackedHeaderBytes) reader.fail("the table of streams overlaps the header");
    SplatScene scene;
    if (table > kPackedHeaderBytes) scene.remarks.push_back("extension records are skipped");
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
        // Some writers add a stream for an empty block. After the last block, only extensions can follow.
        if (i >= list.size()) continue;
        if (unpacked != list[i].unpacked)
            reader.fail(std::string(kBlockNames[list[i].block]) + " unpack to " + std::to_string(unpacked) +
                        " bytes; the header's splats make " + std::to_string(list[i].unpacked));
        list[i].packed = packed;
    }
    const uint64_t bytes_each = std::accumulate(sizes.begin(), sizes.end(), size_t(0));
    require_packed(reader, header.count, bytes_each, kMostZstdExpansion);
    take_header(header, reader, scene);
    for (const Stream& stream : list) {
        if (stream.packed > reader.remaining())
            reader.fail(std::string(kBlockNames[stream.block]) + " claim " + std::to_string(stream.packed) +
                        " packed bytes, but only " + std::to_string(reader.remaining()) + " follow");
        const std::unique_ptr<Unpacker> unpacker = open_zstd(reader, stream.packed, stream.unpacked);
        const uint64_t end = reader.offset() + stream.packed;
        read_block(header, stream.block, *unpacker, scene.gaussians);
        if (!unpacker->at_end())
            reader.fail(std::string(kBlockNames[stream.block]) +
                        " unpack to more bytes than the table states");
        reader.skip(end - reader.offset(), kBlockNames[stream.block]);
    }
    return scene;
}

constexpr int kUsualFractionalBits = 12;
constexpr double kLargestFixed = (1 << 23) - 1;

/// The usual number of fractional bits, or fewer so that the largest coordinate fits.
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
                     std::to_string(largest) + ", beyond SPZ's limit of 8388607; move or scale the scene");
}

class Encoder {
  public:
    Encoder(const Gaussians& gaussians, int bits, int version)
        : g_(gaussians), bits_(bits), version_(version) {}

    size_t clamped() const { return clamped_; }  // values outside the range of their byte

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

    /// Rounds to steps, which compress better. Zero is one of the steps.
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
        if (version_ < 3) {
            for (size_t k = 0; k < 3; ++k) to[k] = to_byte((q[3] < 0 ? -q[k] : q[k]) * 127.5 + 127.5);
            return;
        }
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
    int bits_, version_;
    size_t clamped_ = 0;
};

void write_block(Block block, size_t bytes_each, Encoder& encoder, size_t count, Packer& packer) {
    if (bytes_each == 0) return;
    encode_in_pieces(
        count, bytes_each,
        [&](size_t i, std::byte* to) { encoder.encode(block, i, reinterpret_cast<uint8_t*>(to)); },
        [&](const std::byte* bytes, size_t size, size_t) { packer.write(bytes, size); });
}

std::vector<std::byte> header(const Gaussians& gaussians, const SaveOptions& options, int bits) {
    std::vector<std::byte> bytes(kHeaderBytes);
    const uint32_t words[3] = {kSpzMagic, uint32_t(options.spz_version), uint32_t(gaussians.size())};
    std::memcpy(bytes.data(), words, sizeof(words));
    bytes[12] = std::byte(gaussians.sh_degree);
    bytes[13] = std::byte(bits);
    bytes[14] = std::byte(options.antialiased ? kAntialiased : 0);
    return bytes;
}

using Sizes = std::array<size_t, kBlocks>;

void write_gzipped(const Packer::Sink& sink, const std::vector<std::byte>& head, const Sizes& sizes,
                   Encoder& encoder, size_t count, const SaveOptions& options) {
    const std::unique_ptr<Packer> packer = make_gzip(sink);
    packer->write(head.data(), head.size());
    for (int block = 0; block < kBlocks; ++block) {
        write_block(Block(block), sizes[size_t(block)], encoder, count, *packer);
        if (options.progress) options.progress(count * uint64_t(block + 1) / kBlocks, count);
    }
    packer->finish();
}

void write_streams(const Packer::Sink& sink, std::vector<std::byte> head, const Sizes& sizes,
                   Encoder& encoder, size_t count, const SaveOptions& options) {
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
    sink(head.data(), head.size());
    sink(table.data(), table.size() * sizeof(table[0]));
    sink(packed.data(), packed.size());
}

/// Passes the bytes of the file to the sink.
SpzLoss write_to(const Packer::Sink& sink, const std::filesystem::path& path, const Gaussians& gaussians,
                 const SaveOptions& options) {
    if (options.spz_version < 2 || options.spz_version > 4)
        throw InputError("SPZ version " + std::to_string(options.spz_version) +
                         " cannot be written; write 2, 3 or 4");
    if (gaussians.size() > std::numeric_limits<uint32_t>::max())
        throw InputError(path.string() + ": SPZ holds no more than 4294967295 splats");
    const int bits = fractional_bits(path, gaussians);
    const Sizes sizes = block_bytes(uint32_t(options.spz_version), gaussians.sh_degree);
    Encoder encoder(gaussians, bits, options.spz_version);
    const std::vector<std::byte> head = header(gaussians, options, bits);
    if (options.spz_version < 4)
        write_gzipped(sink, head, sizes, encoder, gaussians.size(), options);
    else
        write_streams(sink, head, sizes, encoder, gaussians.size(), options);

    return {options.spz_version, gaussians.sh_degree, bits, encoder.clamped()};
}

}  // namespace

void SpzLoss::add(const SpzLoss& other) {
    version = other.version;
    sh_degree = std::max(sh_degree, other.sh_degree);
    fractional_bits = std::min(fractional_bits, other.fractional_bits);
    clamped += other.clamped;
}

std::vector<std::string> SpzLoss::remarks() const {
    std::vector<std::string> lines = {"positions are rounded to 1/" + std::to_string(1 << fractional_bits) +
                                      ", scales to 1/16 of their logarithm, colours and opacities to 8 "
                                      "bits, rotations to " +
                                      (version < 3 ? "8" : "10") + " bits per component"};
    if (sh_degree > 0)
        lines.push_back("SH coefficients have 5 bits (degree 1) and 4 bits (others), clamped to -1..1");
    if (clamped > 0)
        lines.push_back(std::to_string(clamped) +
                        " scales, colours and SH coefficients are outside SPZ's range and are clamped");
    return lines;
}

SplatScene read_spz(core::FileReader& reader) {
    if (reader.size() < 2) reader.fail("this is not an SPZ file: it has less than 2 bytes");
    const bool gzipped = reader.read<uint16_t>("the header") == 0x8b1f;
    reader.go_to(0, "the header");
    return gzipped ? read_one_stream(reader, true) : read_streams(reader);
}

SplatScene read_spz(const std::filesystem::path& path) {
    core::FileReader reader(path);
    return read_spz(reader);
}

std::vector<std::string> write_spz(const std::filesystem::path& path, const Gaussians& gaussians,
                                   const SaveOptions& options) {
    core::AtomicFile file(path);
    const SpzLoss loss =
        write_to([&](const void* bytes, size_t n) { file.write(bytes, n); }, path, gaussians, options);
    file.commit();
    return loss.remarks();
}

std::string pack_spz(const std::filesystem::path& path, const Gaussians& gaussians,
                     const SaveOptions& options, SpzLoss& loss) {
    std::string packed;
    loss.add(write_to([&](const void* bytes, size_t n) { packed.append(static_cast<const char*>(bytes), n); },
                      path, gaussians, options));
    return packed;
}

}  // namespace ewa::io
