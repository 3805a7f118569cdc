// SPDX-License-Identifier: Apache-2.0
#include "image/png_file.h"

#include <png.h>

#include <algorithm>
#include <bit>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>

#include "core/text.h"
#include "ewa/error.h"
#include "image/integers.h"

namespace ewa::image {

namespace {

struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
};

/// Tag 274 of EXIF's first directory, which is laid out as TIFF's; 1 where it is not there.
int exif_orientation(const std::byte* exif, uint64_t size) {
    constexpr uint64_t kTag = 274, kEntryBytes = 12;
    const auto number = [&](uint64_t at, int bytes) -> uint64_t {
        if (at + uint64_t(bytes) > size) return 0;
        return exif[0] == std::byte('M') ? big_endian(exif + at, bytes) : little_endian(exif + at, bytes);
    };
    const uint64_t directory = number(4, 4), count = number(directory, 2);
    for (uint64_t i = 0; i < count; ++i) {
        const uint64_t entry = directory + 2 + i * kEntryBytes;
        if (number(entry, 2) == kTag) return int(number(entry + 8, 2));
    }
    return 1;
}

/// libpng leaves by longjmp from any call: each call that may fail stands in a function of its own without
/// anything to destroy, and everything else lives here.
class PngReader {
  public:
    explicit PngReader(const std::filesystem::path& path)
        : name_(path.string()), file_(std::fopen(path.c_str(), "rbe")) {
        if (!file_) fail(std::strerror(errno));
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

    PngPicture read(bool pixels) {
        if (!read_header()) fail(message_);
        PngPicture picture;
        picture.size = {int(png_get_image_width(png_, info_)), int(png_get_image_height(png_, info_)),
                        orientation(), png_get_bit_depth(png_, info_) <= 8};
        picture.channels = png_get_channels(png_, info_);
        if (!pixels) return picture;
        const size_t row = png_get_rowbytes(png_, info_), height = size_t(picture.size.height);
        // Only the passes of an interlaced picture need all rows at once.
        const bool interlaced = png_get_interlace_type(png_, info_) != PNG_INTERLACE_NONE;
        std::vector<png_byte> bytes(row * (interlaced ? height : 1));
        std::vector<png_bytep> rows;
        for (size_t y = 0; interlaced && y < height; ++y) rows.push_back(&bytes[y * row]);
        if (interlaced && !read_all(rows.data())) fail(message_);
        const size_t count = size_t(picture.size.width) * size_t(picture.channels);
        picture.values.resize(count * height);
        for (size_t y = 0; y < height; ++y) {
            if (!interlaced && !read_row(bytes.data())) fail(message_);
            to_floats(interlaced ? rows[y] : bytes.data(), count, picture.size.eight_bit,
                      &picture.values[y * count]);
        }
        if (!read_end()) fail(message_);
        return picture;
    }

  private:
    [[noreturn]] void fail(const std::string& reason) const {
        throw InputError(core::one_line(name_ + ": not a readable image: " + reason));
    }
    [[noreturn]] static void on_error(png_structp png, png_const_charp text) {
        auto* self = static_cast<PngReader*>(png_get_error_ptr(png));
        std::snprintf(self->message_, sizeof(self->message_), "the PNG is damaged: %s", text);
        png_longjmp(png, 1);
    }
    static void on_warning(png_structp, png_const_charp) {}

    bool read_header() {
        if (setjmp(png_jmpbuf(png_))) return false;
        png_init_io(png_, file_.get());
        // No notes but EXIF's; transparency belongs to the pixels and is read in any case.
        static constexpr png_byte kExif[] = "eXIf";
        png_set_keep_unknown_chunks(png_, PNG_HANDLE_CHUNK_NEVER, nullptr, -1);
        png_set_keep_unknown_chunks(png_, PNG_HANDLE_CHUNK_AS_DEFAULT, kExif, 1);
        png_read_info(png_, info_);
        png_set_expand(png_);
        if (std::endian::native == std::endian::little) png_set_swap(png_);
        png_set_interlace_handling(png_);
        png_read_update_info(png_, info_);
        return true;
    }
    bool read_all(png_bytepp rows) {
        if (setjmp(png_jmpbuf(png_))) return false;
        png_read_image(png_, rows);
        return true;
    }
    bool read_row(png_bytep bytes) {
        if (setjmp(png_jmpbuf(png_))) return false;
        png_read_row(png_, bytes, nullptr);
        return true;
    }
    bool read_end() {
        if (setjmp(png_jmpbuf(png_))) return false;
        png_read_end(png_, nullptr);
        return true;
    }

    int orientation() {
        png_uint_32 bytes = 0;
        png_bytep exif = nullptr;
        if (!png_get_eXIf_1(png_, info_, &bytes, &exif)) return 1;
        return exif_orientation(reinterpret_cast<const std::byte*>(exif), bytes);
    }

    static void to_floats(const png_byte* row, size_t count, bool eight_bit, float* values) {
        for (size_t i = 0; i < count; ++i) {
            uint16_t word = row[eight_bit ? i : 0];
            if (!eight_bit) std::memcpy(&word, row + 2 * i, 2);
            values[i] = float(word) / (eight_bit ? 255.0f : 65535.0f);
        }
    }

    std::string name_;
    std::unique_ptr<std::FILE, CloseFile> file_;
    png_structp png_ = nullptr;
    png_infop info_ = nullptr;
    char message_[256] = {};
};

}  // namespace

PngPicture read_png(const std::filesystem::path& path, bool pixels) {
    return PngReader(path).read(pixels);
}

}  // namespace ewa::image
