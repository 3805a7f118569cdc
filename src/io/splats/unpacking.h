// SPDX-License-Identifier: Apache-2.0
// Bytes that a file holds packed, unpacked as they are read, and packed as they are written.
#pragma once
#include <cstddef>
#include <functional>
#include <memory>
#include <string_view>
#include <vector>

#include "core/file_reader.h"

namespace ewa::io {

/// A stream of unpacked bytes. What is damaged is an InputError that names the byte of the packed file.
class Unpacker {
  public:
    virtual ~Unpacker() = default;
    /// Exactly n bytes. `what` names them in the error.
    virtual void read(std::byte* to, size_t n, std::string_view what) = 0;
    /// Whether the stream has ended where the bytes read so far do.
    virtual bool at_end() = 0;
};

/// gzip (RFC 1952) from where the reader stands to its member's end.
std::unique_ptr<Unpacker> open_gzip(core::FileReader& reader);

/// A Zstandard frame (RFC 8878) of `packed_bytes` from where the reader stands; its window is at most the
/// larger of 16 MiB and `unpacked_bytes`.
std::unique_ptr<Unpacker> open_zstd(core::FileReader& reader, uint64_t packed_bytes, uint64_t unpacked_bytes);

/// Takes unpacked bytes; packed ones go to the sink it was made with.
class Packer {
  public:
    using Sink = std::function<void(const void*, size_t)>;
    virtual ~Packer() = default;
    virtual void write(const std::byte* bytes, size_t n) = 0;
    /// Call once, last.
    virtual void finish() = 0;
};

std::unique_ptr<Packer> make_gzip(Packer::Sink sink);
std::unique_ptr<Packer> make_zstd(Packer::Sink sink, uint64_t unpacked_bytes);

}  // namespace ewa::io
