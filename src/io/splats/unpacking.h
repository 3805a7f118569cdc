// SPDX-License-Identifier: Apache-2.0
// Compressed streams: a file's bytes are decompressed while they are read, and compressed while they are
// written.
#pragma once
#include <cstddef>
#include <functional>
#include <memory>
#include <string_view>

#include "core/file_reader.h"

namespace ewa::io {

/// A stream of decompressed bytes. Damage is an InputError that names the byte of the compressed file.
class Unpacker {
  public:
    virtual ~Unpacker() = default;

    /// Reads exactly n bytes. `what` names them in the error.
    void read(std::byte* to, size_t n, std::string_view what);

    /// Whether the stream ends after the bytes that have been read.
    bool at_end();

  protected:
    explicit Unpacker(core::FileReader& reader) : reader_(reader) {}

    /// Decompresses at most n bytes and returns their number. 0 if the library only consumed input. Sets
    /// ended_ at the end of the stream.
    virtual size_t advance(std::byte* to, size_t n) = 0;

    core::FileReader& reader_;
    bool ended_ = false;
};

/// Bytes that are not compressed, from the reader's position to the end of the file.
std::unique_ptr<Unpacker> open_plain(core::FileReader& reader);

/// gzip (RFC 1952) from the reader's position to the end of the member.
std::unique_ptr<Unpacker> open_gzip(core::FileReader& reader);

/// A Zstandard frame (RFC 8878) of `packed_bytes` from the reader's position. Its window is limited to the
/// larger of 16 MiB and `unpacked_bytes`.
std::unique_ptr<Unpacker> open_zstd(core::FileReader& reader, uint64_t packed_bytes, uint64_t unpacked_bytes);

/// Compresses bytes and passes the result to its sink.
class Packer {
  public:
    using Sink = std::function<void(const void*, size_t)>;
    virtual ~Packer() = default;
    virtual void write(const std::byte* bytes, size_t n) = 0;  // n below 4 GiB
    /// Call once, last.
    virtual void finish() = 0;
};

std::unique_ptr<Packer> make_gzip(Packer::Sink sink);
std::unique_ptr<Packer> make_zstd(Packer::Sink sink, uint64_t unpacked_bytes);

}  // namespace ewa::io
