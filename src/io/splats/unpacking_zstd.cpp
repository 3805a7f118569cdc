// SPDX-License-Identifier: Apache-2.0
#include <zstd.h>

#include <algorithm>
#include <bit>
#include <new>

#include "io/splats/unpacking.h"

namespace ewa::io {

namespace {

constexpr size_t kPieceBytes = size_t(1) << 16;
constexpr int kLevel = 12;                // that of the format's own library
constexpr unsigned kLeastWindowLog = 24;  // what a level below "ultra" may use for data of unknown size

class ZstdUnpacker final : public Unpacker {
  public:
    ZstdUnpacker(core::FileReader& reader, uint64_t packed_bytes, uint64_t unpacked_bytes)
        : reader_(reader), left_(packed_bytes), context_(ZSTD_createDCtx(), ZSTD_freeDCtx) {
        if (!context_) throw std::bad_alloc();
        const unsigned log = std::clamp(unsigned(std::bit_width(unpacked_bytes)), kLeastWindowLog, 31u);
        ZSTD_DCtx_setParameter(context_.get(), ZSTD_d_windowLogMax, int(log));
    }

    void read(std::byte* to, size_t n, std::string_view what) override {
        while (n > 0) {
            if (ended_) reader_.fail("the packed data ends inside " + std::string(what));
            const size_t got = advance(to, n);
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
    size_t advance(std::byte* to, size_t n) {
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

    core::FileReader& reader_;
    uint64_t left_;  // packed bytes not yet taken from the reader
    std::unique_ptr<ZSTD_DCtx, size_t (*)(ZSTD_DCtx*)> context_;
    std::vector<std::byte> buffer_;
    ZSTD_inBuffer input_{nullptr, 0, 0};
    bool ended_ = false;
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
            if (ZSTD_isError(left)) throw std::bad_alloc();  // with checked sizes there is no other reason
            sink_(output_.data(), output.pos);
            if (end == ZSTD_e_end ? left == 0 : input.pos == input.size) return;
        }
    }

    Sink sink_;
    std::unique_ptr<ZSTD_CCtx, size_t (*)(ZSTD_CCtx*)> context_;
    std::vector<std::byte> output_;
};

}  // namespace

std::unique_ptr<Unpacker> open_zstd(core::FileReader& reader, uint64_t packed_bytes,
                                    uint64_t unpacked_bytes) {
    return std::make_unique<ZstdUnpacker>(reader, packed_bytes, unpacked_bytes);
}

std::unique_ptr<Packer> make_zstd(Packer::Sink sink, uint64_t unpacked_bytes) {
    return std::make_unique<ZstdPacker>(std::move(sink), unpacked_bytes);
}

}  // namespace ewa::io
