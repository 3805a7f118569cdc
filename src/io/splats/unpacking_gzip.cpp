// SPDX-License-Identifier: Apache-2.0
#include <zlib.h>

#include <algorithm>
#include <new>

#include "io/splats/unpacking.h"

namespace ewa::io {

namespace {

constexpr size_t kPieceBytes = size_t(1) << 16;
constexpr int kGzip = 16;  // added to the window's bits: a gzip header and trailer

class GzipUnpacker final : public Unpacker {
  public:
    explicit GzipUnpacker(core::FileReader& reader) : reader_(reader) {
        if (inflateInit2(&stream_, kGzip + MAX_WBITS) != Z_OK) throw std::bad_alloc();
    }
    ~GzipUnpacker() override { inflateEnd(&stream_); }

    void read(std::byte* to, size_t n, std::string_view what) override {
        while (n > 0) {
            if (ended_) reader_.fail("the packed data ends inside " + std::string(what));
            const size_t piece = std::min(n, kPieceBytes);
            const size_t got = advance(to, piece);
            to += got;
            n -= got;
        }
    }

    bool at_end() override {
        std::byte rest;
        while (!ended_)
            if (advance(&rest, 1) > 0) return false;
        return true;
    }

  private:
    /// Unpacks at most n bytes; 0 where zlib only took input.
    size_t advance(std::byte* to, size_t n) {
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

    core::FileReader& reader_;
    std::vector<std::byte> input_;
    z_stream stream_{};
    bool ended_ = false;
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

    void write(const std::byte* bytes, size_t n) override {
        while (n > 0) {
            const size_t piece = std::min(n, size_t(1) << 30);
            run(bytes, piece, Z_NO_FLUSH);
            bytes += piece;
            n -= piece;
        }
    }
    void finish() override { run(nullptr, 0, Z_FINISH); }

  private:
    void run(const std::byte* bytes, size_t n, int flush) {
        // zlib's interface has no const; it does not write to its input.
        stream_.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(bytes));
        stream_.avail_in = uInt(n);
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

}  // namespace

std::unique_ptr<Unpacker> open_gzip(core::FileReader& reader) {
    return std::make_unique<GzipUnpacker>(reader);
}

std::unique_ptr<Packer> make_gzip(Packer::Sink sink) {
    return std::make_unique<GzipPacker>(std::move(sink));
}

}  // namespace ewa::io
