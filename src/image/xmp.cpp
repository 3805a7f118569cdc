// SPDX-License-Identifier: Apache-2.0
// XMP in the files of images that are written.
#include <spdlog/fmt/fmt.h>
#include <zlib.h>

#include <cstdint>

#include "ewa/error.h"
#include "image/image_files.h"

namespace ewa::image {
namespace {

constexpr size_t kPngSignature = 8, kAroundData = 12;  // length, type and checksum of a chunk
constexpr size_t kMostOfMarker = 65533;                // after the two bytes of the length

uint32_t big_endian_at(const std::vector<unsigned char>& bytes, size_t at, size_t count) {
    uint32_t value = 0;
    for (size_t i = 0; i < count; ++i) value = value << 8 | bytes[at + i];
    return value;
}

void add_big_endian(std::string& out, size_t value, int count) {
    for (int i = count - 1; i >= 0; --i) out.push_back(char(value >> (8 * i) & 0xff));
}

/// An uncompressed iTXt chunk.
std::string png_chunk(const std::string& packet) {
    const std::string data = std::string("iTXtXML:com.adobe.xmp") + std::string(5, '\0') + packet;
    std::string out;
    add_big_endian(out, data.size() - 4, 4);
    out += data;
    add_big_endian(out, crc32(0, reinterpret_cast<const Bytef*>(data.data()), uInt(data.size())), 4);
    return out;
}

std::string jpeg_marker(const std::string& packet) {
    const std::string data = std::string("http://ns.adobe.com/xap/1.0/") + '\0' + packet;
    if (data.size() > kMostOfMarker) throw RunError("XMP is too long for a JPEG");
    std::string out = "\xff\xe1";
    add_big_endian(out, data.size() + 2, 2);
    return out + data;
}

}  // namespace

std::vector<unsigned char> with_xmp(std::vector<unsigned char> bytes, const std::string& packet) {
    const bool png = bytes[0] == 0x89;
    // A JPEG begins with the marker of its start, which has no length, and JFIF's.
    const size_t after = png ? kPngSignature + kAroundData + big_endian_at(bytes, kPngSignature, 4)
                             : 4 + big_endian_at(bytes, 4, 2);
    const std::string added = png ? png_chunk(packet) : jpeg_marker(packet);
    bytes.insert(bytes.begin() + std::ptrdiff_t(after), added.begin(), added.end());
    return bytes;
}

std::string panorama_xmp(int width, int height) {
    return fmt::format(
        "<?xpacket begin=\"\xef\xbb\xbf\" id=\"W5M0MpCehiHzreSzNTczkc9d\"?>"
        "<x:xmpmeta xmlns:x=\"adobe:ns:meta/\">"
        "<rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\">"
        "<rdf:Description rdf:about=\"\" xmlns:GPano=\"http://ns.google.com/photos/1.0/panorama/\" "
        "GPano:UsePanoramaViewer=\"True\" GPano:ProjectionType=\"equirectangular\" "
        "GPano:FullPanoWidthPixels=\"{0}\" GPano:FullPanoHeightPixels=\"{1}\" "
        "GPano:CroppedAreaImageWidthPixels=\"{0}\" GPano:CroppedAreaImageHeightPixels=\"{1}\" "
        "GPano:CroppedAreaLeftPixels=\"0\" GPano:CroppedAreaTopPixels=\"0\"/>"
        "</rdf:RDF></x:xmpmeta><?xpacket end=\"r\"?>",
        width, height);
}

}  // namespace ewa::image
