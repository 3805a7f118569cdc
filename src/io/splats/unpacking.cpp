// SPDX-License-Identifier: Apache-2.0
#include "io/splats/unpacking.h"

#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <bit>
#include <new>

namespace ewa::io {

namespace {

constexpr size_t kPieceBytes = size_t(1) << 16;
constexpr int kGzip = 16;  // zlib adds a gzip header and trailer if this is added to the window bits

class GzipUnpacker final : public Unpacker {
  public:
    explicit GzipUnpacker(core::FileReader& reader) : Unpacker(reader) {
        if (inflateInit2(&stream_, kGzip + MAX_WBITS) != Z_OK) throw std::bad_alloc();
    }
    ~GzipUnpacker() override { inflateEnd(&stream_); }

  private:
    size_t advance(std::byte* to, size_t n) override {
        n = std::min(n, kPieceBytes);  // zlib counts in 32 bits
        if (stream_.avail_in == 0) {
            if (reader_.remaining() == 0)
                reader_.fail("the file ends inside its packed data; it is truncated");
            const size_t size = size_t(std::min<uint64_t>(reader_.remaining(), kPieceBytes));
            const std::byte* bytes = reader_.take(size, "packed data");
            input_.assign(bytes, bytes + size);
            stream_.next_in = reinterpret_cast<Bytef*>(input_.data());
            stream_.avail_in = uInt(size);
        }
        stream_.next_out = reinterpret_cast<Bytef*>(to);
        stream_.avail_out = uInt(n);
        const int result = inflate(&stream_, Z_NO_FLUSH);
        ended_ = result == Z_STREAM_END;
        if (result == Z_MEM_ERROR) throw std::bad_alloc();
        if (result != Z_OK && result != Z_STREAM_END && result != Z_BUF_ERROR)
            reader_.fail(std::string("the packed data up to here is damaged (gzip: ") +
                         (stream_.msg ? stream_.msg : "no message") + ")");
        return n - stream_.avail_out;
    }

    std::vector<std::byte> input_;
    z_stream stream_{};
};

class PlainUnpacker final : public Unpacker {
  public:
    explicit PlainUnpacker(core::FileReader& reader) : Unpacker(reader) {}

  private:
    size_t advance(std::byte* to, size_t n) override {
        n = size_t(std::min<uint64_t>(n, std::min<uint64_t>(reader_.remaining(), kPieceBytes)));
        if (n == 0) reader_.fail("the file ends inside its data; it is truncated");
        const std::byte* bytes = reader_.take(n, "data");
        std::copy_n(bytes, n, to);
        ended_ = reader_.remaining() == 0;
        return n;
    }
};

class GzipPacker final : public Packer {
  public:
    explicit GzipPacker(Sink sink) : sink_(std::move(sink)), output_(kPieceBytes) {
        constexpr int kMemoryLevel = 9;
        if (deflateInit2(&stream_, Z_DEFAULT_COMPRESSION, Z_DEFLATED, kGzip + MAX_WBITS, kMemoryLevel,
                         Z_DEFAULT_STRATEGY) != Z_OK)
            throw std::bad_alloc();
    }
    ~GzipPacker() override { deflateEnd(&stream_); }

    void write(const std::byte* bytes, size_t n) override { run(bytes, n, Z_NO_FLUSH); }
    void finish() override { run(nullptr, 0, Z_FINISH); }

  private:
    void run(const std::byte* bytes, size_t n, int flush) {
        // zlib's interface has no const; it does not write to its input.
        stream_.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(bytes));
        stream_.avail_in = uInt(n);  // zlib counts in 32 bits
        do {
            stream_.next_out = reinterpret_cast<Bytef*>(output_.data());
            stream_.avail_out = uInt(output_.size());
            deflate(&stream_, flush);
            sink_(output_.data(), output_.size() - stream_.avail_out);
        } while (stream_.avail_out == 0);
    }

    Sink sink_;
    std::vector<std::byte> output_;
    z_stream stream_{};
};

constexpr int kLevel = 12;  // as in the format's own library
constexpr unsigned kLeastWindowLog =
    24;  // the largest window of a level below "ultra" for data of unknown size

class ZstdUnpacker final : public Unpacker {
  public:
    ZstdUnpacker(core::FileReader& reader, uint64_t packed_bytes, uint64_t unpacked_bytes)
        : Unpacker(reader), left_(packed_bytes), context_(ZSTD_createDCtx(), ZSTD_freeDCtx) {
        if (!context_) throw std::bad_alloc();
        const unsigned log = std::clamp(unsigned(std::bit_width(unpacked_bytes)), kLeastWindowLog, 31u);
        ZSTD_DCtx_setParameter(context_.get(), ZSTD_d_windowLogMax, int(log));
    }

  private:
    size_t advance(std::byte* to, size_t n) override {
        if (input_.pos == input_.size && left_ > 0) {
            const size_t size = size_t(std::min<uint64_t>(left_, kPieceBytes));
            const std::byte* bytes = reader_.take(size, "packed data");
            buffer_.assign(bytes, bytes + size);
            input_ = {buffer_.data(), size, 0};
            left_ -= size;
        }
        ZSTD_outBuffer output{to, n, 0};
        const size_t before = input_.pos;
        const size_t result = ZSTD_decompressStream(context_.get(), &output, &input_);
        if (ZSTD_isError(result))
            reader_.fail(std::string("the packed data up to here is damaged (zstd: ") +
                         ZSTD_getErrorName(result) + ")");
        ended_ = result == 0;
        if (!ended_ && output.pos == 0 && input_.pos == before && left_ == 0)
            reader_.fail("the packed data ends inside its frame; it is truncated");
        return output.pos;
    }

    uint64_t left_;  // compressed bytes not yet taken from the reader
    std::unique_ptr<ZSTD_DCtx, size_t (*)(ZSTD_DCtx*)> context_;
    std::vector<std::byte> buffer_;
    ZSTD_inBuffer input_{nullptr, 0, 0};
};

class ZstdPacker final : public Packer {
  public:
    ZstdPacker(Sink sink, uint64_t unpacked_bytes)
        : sink_(std::move(sink)), context_(ZSTD_createCCtx(), ZSTD_freeCCtx), output_(kPieceBytes) {
        if (!context_) throw std::bad_alloc();
        ZSTD_CCtx_setParameter(context_.get(), ZSTD_c_compressionLevel, kLevel);
        ZSTD_CCtx_setPledgedSrcSize(context_.get(), unpacked_bytes);
    }
    void write(const std::byte* bytes, size_t n) override { run(bytes, n, ZSTD_e_continue); }
    void finish() override { run(nullptr, 0, ZSTD_e_end); }

  private:
    void run(const std::byte* bytes, size_t n, ZSTD_EndDirective end) {
        ZSTD_inBuffer input{bytes, n, 0};
        while (true) {
            ZSTD_outBuffer output{output_.data(), output_.size(), 0};
            const size_t left = ZSTD_compressStream2(context_.get(), &output, &input, end);
            if (ZSTD_isError(left))
                throw std::bad_alloc();  // sizes are checked, so memory is the only reason
            sink_(output_.data(), output.pos);
            if (end == ZSTD_e_end ? left == 0 : input.pos == input.size) return;
        }
    }

    Sink sink_;
    std::unique_ptr<ZSTD_CCtx, size_t (*)(ZSTD_CCtx*)> context_;
    std::vector<std::byte> output_;
};

}  // namespace

void Unpacker::read(std::byte* to, size_t n, std::string_view what) {
    while (n > 0) {
        if (ended_) reader_.fail("the packed data ends inside " + std::string(what));
        const size_t got = advance(to, n);
        to += got;
        n -= got;
    }
}

bool Unpacker::at_end() {
    std::byte rest;
    while (!ended_)
        if (advance(&rest, 1) > 0) return false;
    return true;
}

std::unique_ptr<Unpacker> open_plain(core::FileReader& reader) {
    return std::make_unique<PlainUnpacker>(reader);
}

std::unique_ptr<Unpacker> open_gzip(core::FileReader& reader) {
    return std::make_unique<GzipUnpacker>(reader);
}

std::unique_ptr<Packer> make_gzip(Packer::Sink sink) {
    return std::make_unique<GzipPacker>(std::move(sink));
}

std::unique_ptr<Unpacker> open_zstd(core::FileReader& reader, uint64_t packed_bytes,
                                    uint64_t unpacked_bytes) {
    return std::make_unique<ZstdUnpacker>(reader, packed_bytes, unpacked_bytes);
}

std::unique_ptr<Packer> make_zstd(Packer::Sink sink, uint64_t unpacked_bytes) {
    return std::make_unique<ZstdPacker>(std::move(sink), unpacked_bytes);
}

}  // namespace ewa::io
