// SPDX-License-Identifier: Apache-2.0
#include "io/splats/zip_files.h"

#include <unzip.h>

#include <algorithm>
#include <map>
#include <optional>

#include "core/file_reader.h"
#include "core/folders.h"
#include "core/messages.h"
#include "core/sandboxed_path.h"
#include "core/text.h"
#include "ewa/error.h"
#include "folders/run_folder.h"
#include "platform/file.h"
#include "platform/file_facts.h"

namespace ewa::io {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMostEntries = 100'000;
constexpr uint64_t kMostTimes = 200, kAlwaysAllowed = uint64_t(16) << 20;
constexpr size_t kLongestEntry = 1024, kLongestPart = 255;
constexpr std::ptrdiff_t kMostFolders = 64;  // folders in folders
constexpr size_t kShownOfName = 200;         // of a wrong one
constexpr size_t kZipPiece = size_t(1) << 18;
constexpr uint64_t kEncryptedFlag = 1, kDeflated = 8;
constexpr unsigned kUnixKind = 0170000, kUnixFile = 0100000, kUnixFolder = 0040000;

/// minizip takes names in bytes alone.
unzFile open_zip(const fs::path& path) {
    zlib_filefunc64_def functions{};
    fill_fopen64_filefunc(&functions);
    functions.zopen64_file = [](void*, const void* file, int) -> void* {
        return platform::open_stream(*static_cast<const fs::path*>(file));
    };
    return unzOpen2_64(&path, &functions);
}

/// Files that desktops add, and the record by which ewa knows its own datasets.
bool is_left_out(const fs::path& name) {
    return core::is_of_desktop(name) || name.filename() == folders::kCaptureFile;
}

/// Why the name cannot be written; empty if it can.
std::string wrong_name(const std::string& name) {
    if (std::ranges::count_if(name, [](char c) { return c == '/' || c == '\\'; }) > kMostFolders)
        return "is more than " + std::to_string(kMostFolders) + " folders deep";
    if (std::ranges::any_of(name, [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }))
        return "has a control character";
    const std::optional<fs::path> inside = core::name_inside(name);
    if (!inside) return "leads out of the folder";
    for (const fs::path& part : *inside)
        if (part.string().size() > kLongestPart) return "is too long";
    return {};
}

/// A file that is being written, without the cost of a flush to disk for each.
class NewFile {
  public:
    explicit NewFile(const fs::path& path) : path_(path) { check(file_.open(path, platform::Open::create)); }
    void write(std::string_view text) { check(file_.write(text.data(), text.size())); }
    void close() { check(file_.close()); }

  private:
    void check(const std::error_code& error) const {
        if (error) throw RunError(core::one_line(path_.string()) + ": cannot be written: " + error.message());
    }
    fs::path path_;
    platform::File file_;
};

}  // namespace

struct ZipFiles::State {
    std::string name;
    unzFile zip = nullptr;
    std::vector<Entry> entries;
    std::vector<unz64_file_pos> places;  // by Entry::index
    uint64_t bytes = 0;

    ~State() {
        if (zip) unzClose(zip);
    }
    [[noreturn]] void fail(const std::string& entry, const std::string& what) const {
        throw InputError(name + ": \"" + core::one_line(entry) + "\" " + what);
    }
    void list(uint64_t file_bytes);
    void add(const std::string& entry, const unz_file_info64& info);
    void check_conflicts() const;
};

void ZipFiles::State::add(const std::string& entry, const unz_file_info64& info) {
    const bool folder = entry.ends_with('/') || entry.ends_with('\\');
    const std::string plain = entry.substr(0, entry.size() - (folder ? 1 : 0));
    if (const std::string wrong = wrong_name(plain); !wrong.empty())
        fail(entry.substr(0, kShownOfName), wrong);
    const unsigned kind = unsigned(info.external_fa >> 16) & kUnixKind;
    if (kind != 0 && kind != kUnixFile && kind != kUnixFolder)
        fail(entry, "is a link or a device, not a file");
    const fs::path inside = *core::name_inside(plain);
    if (folder || kind == kUnixFolder || is_left_out(inside)) return;
    if (info.flag & kEncryptedFlag) fail(entry, "is encrypted");
    if (info.compression_method != 0 && info.compression_method != kDeflated)
        fail(entry, "is packed with method " + std::to_string(info.compression_method) +
                        "; stored and deflated entries are supported");
    bytes += std::min<uint64_t>(info.uncompressed_size, uint64_t(1) << 62);
    entries.push_back({inside, info.uncompressed_size, places.size() - 1});
}

void ZipFiles::State::list(uint64_t file_bytes) {
    std::string last;
    uint64_t packed = 0;
    int result = unzGoToFirstFile(zip);
    for (; result == UNZ_OK; result = unzGoToNextFile(zip)) {
        if (places.size() >= kMostEntries)
            throw InputError(name + ": claims to hold more than " + std::to_string(kMostEntries) +
                             " entries");
        char text[kLongestEntry + 1] = {};
        unz_file_info64 info{};
        places.emplace_back();
        if (unzGetCurrentFileInfo64(zip, &info, text, sizeof(text), nullptr, 0, nullptr, 0) != UNZ_OK ||
            unzGetFilePos64(zip, &places.back()) != UNZ_OK)
            fail(last, "is the last entry before the archive's directory is damaged");
        const std::string entry(text, std::min<size_t>(info.size_filename, kLongestEntry));
        if (info.size_filename > kLongestEntry) fail(entry, "is too long");
        last = entry;
        // Entries that share their bytes could unpack to any size.
        packed += std::min<uint64_t>(info.compressed_size, uint64_t(1) << 62);
        if (packed > file_bytes)
            throw InputError(name + ": \"" + core::one_line(entry) +
                             "\" claims bytes that the archive does not have");
        add(entry, info);
        if (bytes > file_bytes * kMostTimes + kAlwaysAllowed)
            throw InputError(name + ": claims to unpack from " + core::bytes_text(file_bytes) + " to " +
                             core::bytes_text(bytes) + " and more; unzip it yourself if that is right");
    }
    if (result != UNZ_END_OF_LIST_OF_FILE)
        fail(last, "is the last entry before the archive's directory is damaged");
    check_conflicts();
}

/// Throws if two entries would be written to one place.
void ZipFiles::State::check_conflicts() const {
    std::map<fs::path::string_type, std::string> files;  // names, by what the system takes for one
    for (const Entry& entry : entries) {
        const std::string file = entry.name.string();
        if (!files.emplace(platform::folded(entry.name), file).second) fail(file, "is there twice");
    }
    for (const auto& [key, file] : files) {
        const auto folder = key + fs::path::preferred_separator;
        const auto below = files.lower_bound(folder);
        if (below != files.end() && below->first.starts_with(folder))
            fail(file, "is both a file and a folder");
    }
}

bool is_zip(const fs::path& path) try {
    core::FileReader reader(path);
    constexpr std::string_view kLocal = "PK\3\4", kEmpty = "PK\5\6";
    if (reader.size() < kLocal.size()) return false;
    const std::string_view head(reinterpret_cast<const char*>(reader.take(kLocal.size(), "the header")),
                                kLocal.size());
    return head == kLocal || head == kEmpty;
} catch (const InputError&) {
    return false;
}

ZipFiles::ZipFiles(const fs::path& path) : state_(std::make_unique<State>()) {
    state_->name = core::one_line(path.string());
    const uint64_t bytes = core::FileReader(path).size();
    state_->zip = open_zip(path);
    // Releases of minizip differ in whether they open an archive without entries.
    unz_global_info64 directory{};
    if (!state_->zip || unzGetGlobalInfo64(state_->zip, &directory) != UNZ_OK || directory.number_entry == 0)
        throw InputError(state_->name + ": not a zip archive, or its directory at byte " +
                         std::to_string(bytes) + " is damaged or cut off");
    state_->list(bytes);
}

ZipFiles::~ZipFiles() = default;

const std::vector<ZipFiles::Entry>& ZipFiles::entries() const {
    return state_->entries;
}

uint64_t ZipFiles::bytes() const {
    return state_->bytes;
}

void ZipFiles::read(const Entry& entry, const std::function<void(std::string_view)>& piece) const {
    const unzFile zip = state_->zip;
    std::string buffer(kZipPiece, '\0');
    bool whole = unzGoToFilePos64(zip, &state_->places[size_t(entry.index)]) == UNZ_OK &&
                 unzOpenCurrentFile(zip) == UNZ_OK;
    for (uint64_t left = entry.bytes; whole && left > 0;) {
        const int got = unzReadCurrentFile(zip, buffer.data(), unsigned(std::min<uint64_t>(kZipPiece, left)));
        whole = got > 0;
        if (!whole) break;
        piece(std::string_view(buffer).substr(0, size_t(got)));
        left -= uint64_t(got);
    }
    // Closing compares the checksum.
    whole = unzCloseCurrentFile(zip) == UNZ_OK && whole;
    if (!whole) state_->fail(entry.name.string(), "is damaged or cut off");
}

std::string ZipFiles::text(const Entry& entry) const {
    std::string whole;
    read(entry, [&](std::string_view piece) { whole += piece; });
    return whole;
}

std::string ZipFiles::head(const Entry& entry, size_t bytes) const {
    const unzFile zip = state_->zip;
    std::string text(size_t(std::min<uint64_t>(bytes, entry.bytes)), '\0');
    bool whole = unzGoToFilePos64(zip, &state_->places[size_t(entry.index)]) == UNZ_OK &&
                 unzOpenCurrentFile(zip) == UNZ_OK;
    for (size_t done = 0; whole && done < text.size();) {
        const int got = unzReadCurrentFile(zip, text.data() + done, unsigned(text.size() - done));
        whole = got > 0;
        if (whole) done += size_t(got);
    }
    unzCloseCurrentFile(zip);  // which says that the checksum differs, since the rest is not read
    if (!whole) state_->fail(entry.name.string(), "is damaged or cut off");
    return text;
}

bool ZipFiles::unpack(const fs::path& folder, const std::function<bool(int)>& progress,
                      const std::function<bool(const Entry&)>& wanted) const {
    core::make_folder(folder);
    uint64_t needed = 0;
    for (const Entry& entry : entries()) needed += !wanted || wanted(entry) ? entry.bytes : 0;
    std::error_code unknown;
    const fs::space_info space = fs::space(folder, unknown);
    if (!unknown && space.available < needed)
        throw RunError(core::one_line(folder.string()) + ": unpacking " + state_->name + " takes " +
                       core::bytes_text(needed) + ", and " + core::bytes_text(space.available) + " are free");
    for (size_t i = 0; i < entries().size(); ++i) {
        const Entry& entry = entries()[i];
        if (wanted && !wanted(entry)) continue;
        core::make_folder((folder / entry.name).parent_path());
        NewFile file(folder / entry.name);
        read(entry, [&](std::string_view piece) { file.write(piece); });
        file.close();
        if (!progress(int(i + 1))) return false;
    }
    return true;
}

std::string named_in_archive(std::string text, const fs::path& unpacked, const fs::path& archive) {
    const std::string folder = unpacked.string();
    for (size_t at = 0; (at = text.find(folder, at)) != text.npos;) {
        const size_t after = at + folder.size();
        const bool entry = text.find_first_of("/\\", after) == after;
        const std::string name = core::one_line(archive.string()) + (entry ? ": " : "");
        text.replace(at, folder.size() + (entry ? 1 : 0), name);
        at += name.size();
    }
    return text;
}

uint64_t check_zip(const fs::path& path) {
    const ZipFiles zip(path);
    uint64_t bytes = 0;
    for (const ZipFiles::Entry& entry : zip.entries())
        zip.read(entry, [&](std::string_view text) { bytes += text.size(); });
    return bytes;
}

}  // namespace ewa::io
