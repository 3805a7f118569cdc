// SPDX-License-Identifier: Apache-2.0
// PNG by libpng.
#include <png.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <new>
#include <stdexcept>

#include "ewa/error.h"
#include "image/image_files.h"

namespace ewa::image {

namespace {

/// Whether the chunks reach the end chunk. Finds a truncated file without decoding it.
bool has_end_chunk(std::FILE* file, uint64_t file_bytes) {
    constexpr uint64_t kSignatureBytes = 8, kFrameBytes = 12;  // a chunk's length, type and checksum
    std::byte chunk[8];
    for (uint64_t at = kSignatureBytes; at + kFrameBytes <= file_bytes;) {
        if (std::fseek(file, long(at), SEEK_SET) != 0 || std::fread(chunk, 1, 8, file) != 8) return false;
        if (std::memcmp(chunk + 4, "IEND", 4) == 0) return true;
        at += kFrameBytes + big_endian(chunk, 4);
    }
    return false;
}

/// libpng reports errors by longjmp. So no call of libpng after the constructor leaves a function that has an
/// object with a destructor: each is in a step of `attempt`, and what must be released belongs to the class.
class PngReader {
  public:
    explicit PngReader(std::FILE* file) : file_(file) {
        png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, this, on_error, on_warning);
        info_ = png_ ? png_create_info_struct(png_) : nullptr;
        if (!info_) {
            png_destroy_read_struct(&png_, nullptr, nullptr);
            throw std::bad_alloc();
        }
    }
    ~PngReader() { png_destroy_read_struct(&png_, &info_, nullptr); }
    PngReader(const PngReader&) = delete;
    PngReader& operator=(const PngReader&) = delete;

    StoredImage read(uint64_t file_bytes, bool pixels) {
        attempt([&] { read_header(); });
        StoredImage image;
        const uint64_t width = png_get_image_width(png_, info_), height = png_get_image_height(png_, info_);
        const bool eight_bit = png_get_bit_depth(png_, info_) <= 8;
        // The channels after expansion: a palette becomes RGB, and transparency becomes alpha.
        const bool palette = png_get_color_type(png_, info_) == PNG_COLOR_TYPE_PALETTE;
        const uint64_t channels = palette ? 3 : png_get_channels(png_, info_);
        check_limits({width, height, channels, eight_bit ? uint64_t(1) : 2}, file_bytes);
        attempt([&] { expand(); });
        image.size = {int(width), int(height), orientation(), eight_bit};
        image.channels = png_get_channels(png_, info_);
        if (pixels) read_values(image);
        return image;
    }

  private:
    [[noreturn]] void fail() const {
        throw std::runtime_error("the PNG is " +
                                 (std::feof(file_) ? "truncated" : "damaged: " + std::string(message_)));
    }
    [[noreturn]] static void on_error(png_structp png, png_const_charp text) {
        auto* self = static_cast<PngReader*>(png_get_error_ptr(png));
        std::snprintf(self->message_, sizeof(self->message_), "%s", text);
        png_longjmp(png, 1);
    }
    static void on_warning(png_structp, png_const_charp) {}

    /// Calls `step`. Throws if libpng reports an error in it.
    template <class Step>
    void attempt(Step step) {
        if (setjmp(png_jmpbuf(png_))) fail();
        step();
    }

    void read_header() {
        png_init_io(png_, file_);
        png_set_crc_action(png_, PNG_CRC_ERROR_QUIT, PNG_CRC_ERROR_QUIT);
        // Colour spaces and texts are not read, so they cannot fail. EXIF has the orientation.
        static constexpr png_byte kExif[] = "eXIf";
        png_set_keep_unknown_chunks(png_, PNG_HANDLE_CHUNK_NEVER, nullptr, -1);
        png_set_keep_unknown_chunks(png_, PNG_HANDLE_CHUNK_AS_DEFAULT, kExif, 1);
        png_read_info(png_, info_);
    }
    void expand() {
        png_set_expand(png_);
        if (std::endian::native == std::endian::little) png_set_swap(png_);
        png_set_interlace_handling(png_);
        png_read_update_info(png_, info_);
    }

    void read_values(StoredImage& image) {
        const size_t row = png_get_rowbytes(png_, info_), height = size_t(image.size.height);
        // The passes of an interlaced image need all rows at once.
        const bool interlaced = png_get_interlace_type(png_, info_) != PNG_INTERLACE_NONE;
        std::vector<png_byte> bytes(row * (interlaced ? height : 1));
        std::vector<png_bytep> rows;
        for (size_t y = 0; interlaced && y < height; ++y) rows.push_back(&bytes[y * row]);
        if (interlaced) attempt([&] { png_read_image(png_, rows.data()); });
        const size_t count = size_t(image.size.width) * size_t(image.channels);
        image.values.resize(count * height);
        for (size_t y = 0; y < height; ++y) {
            if (!interlaced) attempt([&] { png_read_row(png_, bytes.data(), nullptr); });
            to_floats(interlaced ? rows[y] : bytes.data(), count, image.size.eight_bit,
                      &image.values[y * count]);
        }
        attempt([&] { png_read_end(png_, nullptr); });
    }

    static void to_floats(const png_byte* row, size_t count, bool eight_bit, float* values) {
        for (size_t i = 0; i < count; ++i) {
            uint16_t word = row[eight_bit ? i : 0];
            if (!eight_bit) std::memcpy(&word, row + 2 * i, 2);
            values[i] = float(word) / (eight_bit ? 255.0f : 65535.0f);
        }
    }

    int orientation() {
        png_uint_32 size = 0;
        png_bytep exif = nullptr;
        return png_get_eXIf_1(png_, info_, &size, &exif) ? exif_orientation(exif, size) : 1;
    }

    std::FILE* file_;
    png_structp png_ = nullptr;
    png_infop info_ = nullptr;
    char message_[256] = {};
};

}  // namespace

StoredImage read_png(std::FILE* file, uint64_t file_bytes, bool pixels) {
    StoredImage image = PngReader(file).read(file_bytes, pixels);
    if (!pixels && !has_end_chunk(file, file_bytes)) throw std::runtime_error("the PNG is truncated");
    return image;
}

std::vector<uint8_t> eight_bit_values(const Image& image) {
    std::vector<uint8_t> rounded(image.pixels.size());
    // NaN compares false and becomes 0.
    std::transform(image.pixels.begin(), image.pixels.end(), rounded.begin(), [](float v) {
        return v > 0.0f ? static_cast<uint8_t>(std::lround(std::min(v, 1.0f) * 255.0f)) : uint8_t(0);
    });
    return rounded;
}

std::vector<unsigned char> encode_png(const Image& image) {
    if (image.channels > 4)
        throw RunError("a PNG has at most 4 channels, not " + std::to_string(image.channels));
    const std::vector<uint8_t> rounded = eight_bit_values(image);
    constexpr png_uint_32 kFormats[] = {PNG_FORMAT_GRAY, PNG_FORMAT_GA, PNG_FORMAT_RGB, PNG_FORMAT_RGBA};
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    png.width = png_uint_32(image.width);
    png.height = png_uint_32(image.height);
    png.format = kFormats[image.channels - 1];
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(png);
    std::vector<unsigned char> bytes(size);
    if (!png_image_write_to_memory(&png, bytes.data(), &size, 0, rounded.data(), 0, nullptr))
        throw RunError(std::string("cannot be encoded as PNG: ") + png.message);
    bytes.resize(size);
    return bytes;
}

}  // namespace ewa::image
