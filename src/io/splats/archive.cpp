// SPDX-License-Identifier: Apache-2.0
#include "io/splats/archive.h"

#include <zip.h>

#include <algorithm>
#include <cstring>
#include <new>

namespace ewa::io {

/// The archive as minizip sees it: a file in memory.
struct MemoryFile {
    std::string bytes;
    uint64_t at = 0;
};

namespace {

// minizip is C, so none of these may throw.

MemoryFile& file_of(voidpf opaque) {
    return *static_cast<MemoryFile*>(opaque);
}

voidpf open_memory(voidpf opaque, const void*, int) {
    return opaque;
}
uLong read_memory(voidpf opaque, voidpf, void* to, uLong size) {
    MemoryFile& file = file_of(opaque);
    const uint64_t left = file.at < file.bytes.size() ? file.bytes.size() - file.at : 0;
    const uLong n = uLong(std::min<uint64_t>(left, size));
    if (n > 0) std::memcpy(to, file.bytes.data() + file.at, n);
    file.at += n;
    return n;
}
uLong write_memory(voidpf opaque, voidpf, const void* from, uLong size) try {
    MemoryFile& file = file_of(opaque);
    if (file.bytes.size() < file.at + size) file.bytes.resize(file.at + size);
    std::memcpy(file.bytes.data() + file.at, from, size);
    file.at += size;
    return size;
} catch (const std::bad_alloc&) {
    return 0;
}
ZPOS64_T tell_memory(voidpf opaque, voidpf) {
    return file_of(opaque).at;
}
long seek_memory(voidpf opaque, voidpf, ZPOS64_T offset, int origin) {
    MemoryFile& file = file_of(opaque);
    const uint64_t from = origin == ZLIB_FILEFUNC_SEEK_CUR   ? file.at
                          : origin == ZLIB_FILEFUNC_SEEK_END ? file.bytes.size()
                                                             : 0;
    if (offset > file.bytes.size() || from > file.bytes.size() - offset) return -1;
    file.at = from + offset;
    return 0;
}
int close_memory(voidpf, voidpf) {
    return 0;
}
int no_error(voidpf, voidpf) {
    return 0;
}

zlib_filefunc64_def functions_of(MemoryFile& file) {
    return {open_memory, read_memory, write_memory, tell_memory, seek_memory, close_memory, no_error, &file};
}

/// Entries are added in memory, so nothing else can fail.
void require_added(int result) {
    if (result != ZIP_OK) throw std::bad_alloc();
}

}  // namespace

struct ArchiveWriter::State {
    MemoryFile file;
    zipFile zip = nullptr;
};

ArchiveWriter::ArchiveWriter() : state_(std::make_unique<State>()) {
    zlib_filefunc64_def functions = functions_of(state_->file);
    state_->zip = zipOpen2_64("", APPEND_STATUS_CREATE, nullptr, &functions);
    if (!state_->zip) throw std::bad_alloc();
}

ArchiveWriter::~ArchiveWriter() {
    if (state_->zip) zipClose(state_->zip, nullptr);
}

void ArchiveWriter::add(const std::string& entry, const std::string& bytes, size_t alignment) {
    constexpr int kStored = 0;
    zip_fileinfo info{};
    info.dosDate = 1 << 21 | 1 << 16;  // the first day that the format knows
    const bool large = bytes.size() > 0xffffffff;
    // The content follows a header of 30 bytes, the name, and an extra field of at least its own header.
    constexpr size_t kHeader = 30, kExtraHeader = 4;
    constexpr uint16_t kPadding = 0x1986;  // what OpenUSD calls its padding
    std::string extra;
    if (const size_t past = (state_->file.bytes.size() + kHeader + entry.size()) % alignment; past != 0) {
        size_t missing = alignment - past;
        if (missing < kExtraHeader) missing += alignment;
        const uint16_t head[2] = {kPadding, uint16_t(missing - kExtraHeader)};
        extra.assign(reinterpret_cast<const char*>(head), sizeof(head));
        extra.resize(missing, '\0');
    }
    require_added(zipOpenNewFileInZip64(state_->zip, entry.c_str(), &info, extra.data(),
                                        unsigned(extra.size()), nullptr, 0, nullptr, kStored, 0, large));
    constexpr size_t kPiece = size_t(1) << 30;  // minizip counts in 32 bits
    for (size_t at = 0; at < bytes.size(); at += kPiece)
        require_added(
            zipWriteInFileInZip(state_->zip, &bytes[at], unsigned(std::min(kPiece, bytes.size() - at))));
    require_added(zipCloseFileInZip(state_->zip));
}

std::string ArchiveWriter::finish() {
    const zipFile zip = state_->zip;
    state_->zip = nullptr;
    require_added(zipClose(zip, nullptr));
    return std::move(state_->file.bytes);
}

}  // namespace ewa::io
