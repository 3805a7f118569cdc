// SPDX-License-Identifier: Apache-2.0
// JPEG by libjpeg-turbo, with its default transform (ISLOW) and upsampling.
// jpeglib.h needs FILE, and jerror.h needs jpeglib.h.
#include <cstdio>

#include <jpeglib.h>

#include <jerror.h>

#include <csetjmp>
#include <cstdlib>
#include <cstring>
#include <stdexcept>

#include "ewa/error.h"
#include "image/image_files.h"

namespace ewa::image {

namespace {

/// CMYK is stored inverted, so colour is the product with K. Rounded to 8 bits, as OpenImageIO does.
void cmyk_to_rgb(const JSAMPLE* cmyk, size_t pixels, float* rgb) {
    constexpr float kUnit = 1.0f / 255;
    for (size_t i = 0; i < pixels; ++i)
        for (size_t c = 0; c < 3; ++c) {
            const float product = float(cmyk[4 * i + c]) * kUnit * (float(cmyk[4 * i + 3]) * kUnit);
            rgb[3 * i + c] = float(uint8_t(product * 255 + 0.5f)) / 255.0f;
        }
}

/// libjpeg's error handler must not return, so it leaves by longjmp. Each call of libjpeg that may fail is in
/// a step of `attempt`, which has no object with a destructor. What must be released belongs to the class.
class JpegReader {
  public:
    explicit JpegReader(std::FILE* file) : file_(file) {
        jpeg_.err = jpeg_std_error(&errors_);
        errors_.error_exit = on_error;
        errors_.emit_message = on_message;
        jpeg_.client_data = this;
    }
    ~JpegReader() { jpeg_destroy_decompress(&jpeg_); }
    JpegReader(const JpegReader&) = delete;
    JpegReader& operator=(const JpegReader&) = delete;

    StoredImage read(uint64_t file_bytes, bool pixels) {
        StoredImage image = begin(file_bytes);
        if (pixels) read_values(image);
        return image;
    }

    void check(uint64_t file_bytes) {
        begin(file_bytes);
        jpeg_.scale_denom = 8;
        attempt([&] { jpeg_start_decompress(&jpeg_); });
        std::vector<JSAMPLE> samples(size_t(jpeg_.output_width) * size_t(jpeg_.output_components));
        JSAMPROW row = samples.data();
        for (JDIMENSION y = 0; y < jpeg_.output_height; ++y)
            attempt([&] { jpeg_read_scanlines(&jpeg_, &row, 1); });
        attempt([&] { jpeg_finish_decompress(&jpeg_); });
    }

    Shot shot() {
        attempt([&] { read_header(); });
        Shot found;
        with_exif([&](const JOCTET* exif, uint64_t size) { found = exif_shot(exif, size); });
        return found;
    }

  private:
    static JpegReader& self(j_common_ptr jpeg) { return *static_cast<JpegReader*>(jpeg->client_data); }

    [[noreturn]] static void on_error(j_common_ptr jpeg) {
        char text[JMSG_LENGTH_MAX];
        jpeg->err->format_message(jpeg, text);
        std::snprintf(self(jpeg).message_, sizeof(self(jpeg).message_), "the JPEG is damaged: %s", text);
        std::longjmp(self(jpeg).jump_, 1);
    }

    /// libjpeg warns where it fills what it cannot decode with grey. That is an error here. Superfluous bytes
    /// between two markers, which some cameras write, cost no pixel.
    static void on_message(j_common_ptr jpeg, int level) {
        if (level >= 0) return;  // a note, not a warning
        switch (jpeg->err->msg_code) {
            case JWRN_JPEG_EOF:
                std::strcpy(self(jpeg).message_, "the JPEG is truncated");
                std::longjmp(self(jpeg).jump_, 1);
            case JWRN_HIT_MARKER:
            case JWRN_HUFF_BAD_CODE:
            case JWRN_ARITH_BAD_CODE:
            case JWRN_MUST_RESYNC:
                on_error(jpeg);
            default:
                break;
        }
    }

    /// Each scan costs a pass over the whole image, however few bytes it has.
    static void on_progress(j_common_ptr jpeg) {
        if (reinterpret_cast<j_decompress_ptr>(jpeg)->input_scan_number <= kMaxJpegScans) return;
        std::snprintf(self(jpeg).message_, sizeof(self(jpeg).message_), "the JPEG has more than %d scans",
                      kMaxJpegScans);
        std::longjmp(self(jpeg).jump_, 1);
    }

    /// Calls `step`. Throws if libjpeg reports an error in it.
    template <class Step>
    void attempt(Step step) {
        if (setjmp(jump_)) throw std::runtime_error(message_);
        step();
    }

    void read_header() {
        jpeg_create_decompress(&jpeg_);
        progress_.progress_monitor = on_progress;
        jpeg_.progress = &progress_;
        jpeg_stdio_src(&jpeg_, file_);
        jpeg_save_markers(&jpeg_, kExifMarker, 0xffff);
        jpeg_read_header(&jpeg_, TRUE);
    }

    bool cmyk() const { return jpeg_.jpeg_color_space == JCS_CMYK || jpeg_.jpeg_color_space == JCS_YCCK; }

    /// Reads the header and checks it.
    StoredImage begin(uint64_t file_bytes) {
        attempt([&] { read_header(); });
        const uint64_t channels = uint64_t(jpeg_.num_components);
        check_limits({jpeg_.image_width, jpeg_.image_height, channels, 1}, file_bytes);
        if (channels > 3 && !cmyk()) throw std::runtime_error("the JPEG has more than 4 channels");
        StoredImage image;
        int orientation = 1;
        with_exif([&](const JOCTET* exif, uint64_t size) { orientation = exif_orientation(exif, size); });
        image.size = {int(jpeg_.image_width), int(jpeg_.image_height), orientation, true};
        // The second of two channels has no known meaning.
        image.channels = channels < 3 ? 1 : 3;
        return image;
    }

    void read_values(StoredImage& image) {
        const bool inverted = cmyk();
        if (inverted) jpeg_.out_color_space = JCS_CMYK;
        attempt([&] { jpeg_start_decompress(&jpeg_); });
        const size_t width = size_t(image.size.width), channels = size_t(image.channels);
        const size_t components = size_t(jpeg_.output_components);
        std::vector<JSAMPLE> samples(width * components);
        JSAMPROW row = samples.data();
        image.values.resize(width * channels * size_t(image.size.height));
        for (size_t y = 0; y < size_t(image.size.height); ++y) {
            attempt([&] { jpeg_read_scanlines(&jpeg_, &row, 1); });
            float* values = &image.values[y * width * channels];
            if (inverted) {
                cmyk_to_rgb(row, width, values);
                continue;
            }
            for (size_t x = 0; x < width; ++x)
                for (size_t c = 0; c < channels; ++c)
                    values[x * channels + c] = float(row[x * components + c]) / 255.0f;
        }
        attempt([&] { jpeg_finish_decompress(&jpeg_); });  // up to the end-of-image marker
    }

    /// Calls use(bytes, size) with each EXIF block.
    template <class Use>
    void with_exif(const Use& use) const {
        static constexpr char kName[] = "Exif\0";  // and the second zero that ends a literal
        for (const jpeg_marker_struct* m = jpeg_.marker_list; m; m = m->next)
            if (m->data_length > sizeof(kName) && std::memcmp(m->data, kName, sizeof(kName)) == 0)
                use(m->data + sizeof(kName), uint64_t(m->data_length - sizeof(kName)));
    }

    static constexpr int kExifMarker = JPEG_APP0 + 1;

    std::FILE* file_;
    jpeg_decompress_struct jpeg_{};
    jpeg_error_mgr errors_{};
    jpeg_progress_mgr progress_{};
    std::jmp_buf jump_{};
    char message_[JMSG_LENGTH_MAX + 64] = {};
};

/// Leaves libjpeg's errors by longjmp, as JpegReader does.
class JpegWriter {
  public:
    JpegWriter() {
        jpeg_.err = jpeg_std_error(&errors_);
        errors_.error_exit = on_error;
        jpeg_.client_data = this;
    }
    ~JpegWriter() {
        jpeg_destroy_compress(&jpeg_);
        std::free(bytes_);
    }
    JpegWriter(const JpegWriter&) = delete;
    JpegWriter& operator=(const JpegWriter&) = delete;

    std::vector<unsigned char> write(const Image& image, std::vector<uint8_t> rgb, int quality) {
        if (setjmp(jump_)) throw RunError(message_);
        compress(image.width, image.height, rgb.data(), quality);
        return {bytes_, bytes_ + size_};
    }

  private:
    [[noreturn]] static void on_error(j_common_ptr jpeg) {
        auto& writer = *static_cast<JpegWriter*>(jpeg->client_data);
        char text[JMSG_LENGTH_MAX];
        jpeg->err->format_message(jpeg, text);
        std::snprintf(writer.message_, sizeof(writer.message_), "cannot be encoded as JPEG: %s", text);
        std::longjmp(writer.jump_, 1);
    }

    void compress(int width, int height, uint8_t* rgb, int quality) {
        jpeg_create_compress(&jpeg_);
        jpeg_mem_dest(&jpeg_, &bytes_, &size_);
        jpeg_.image_width = JDIMENSION(width);
        jpeg_.image_height = JDIMENSION(height);
        jpeg_.input_components = 3;
        jpeg_.in_color_space = JCS_RGB;
        jpeg_set_defaults(&jpeg_);
        jpeg_set_quality(&jpeg_, quality, TRUE);
        jpeg_.comp_info[0].h_samp_factor = jpeg_.comp_info[0].v_samp_factor = 1;
        jpeg_.optimize_coding = TRUE;
        jpeg_start_compress(&jpeg_, TRUE);
        while (jpeg_.next_scanline < jpeg_.image_height) {
            JSAMPROW row = rgb + size_t(jpeg_.next_scanline) * size_t(width) * 3;
            jpeg_write_scanlines(&jpeg_, &row, 1);
        }
        jpeg_finish_compress(&jpeg_);
    }

    jpeg_compress_struct jpeg_{};
    jpeg_error_mgr errors_{};
    std::jmp_buf jump_{};
    unsigned char* bytes_ = nullptr;
    unsigned long size_ = 0;
    char message_[JMSG_LENGTH_MAX + 64] = {};
};

}  // namespace

std::vector<unsigned char> encode_jpeg(const Image& image, int quality) {
    if (image.channels != 3)
        throw RunError("a JPEG has 3 channels here, not " + std::to_string(image.channels));
    return JpegWriter().write(image, eight_bit_values(image), quality);
}

StoredImage read_jpeg(std::FILE* file, uint64_t file_bytes, bool pixels) {
    return JpegReader(file).read(file_bytes, pixels);
}

void check_jpeg(std::FILE* file, uint64_t file_bytes) {
    JpegReader(file).check(file_bytes);
}

Shot jpeg_shot(std::FILE* file) {
    return JpegReader(file).shot();
}

}  // namespace ewa::image
