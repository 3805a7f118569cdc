// SPDX-License-Identifier: Apache-2.0
#include "io/splats/zipped_splats.h"

#include <algorithm>
#include <vector>

#include "core/folders.h"
#include "core/text.h"
#include "ewa/error.h"
#include "io/splats/format_table.h"
#include "io/splats/gltf_splats.h"
#include "io/splats/levels.h"
#include "io/splats/sog.h"

namespace ewa::io {

namespace {

constexpr size_t kPlyHead = 1 << 16, kGltfHead = 1 << 20;  // bytes that tell splats from points and meshes

/// By name, and by the first bytes where the name does not tell.
bool is_splats(const ZipFiles& zip, const ZipFiles::Entry& entry) {
    const std::string name = core::lower(entry.name.filename().string());
    const auto mentions = [&](size_t bytes, std::initializer_list<std::string_view> words) {
        const std::string head = zip.head(entry, bytes);
        return std::ranges::any_of(
            words, [&](std::string_view word) { return head.find(word) != std::string::npos; });
    };
    if (name.ends_with(".ply")) return mentions(kPlyHead, {" opacity", " packed_position"});
    if (name.ends_with(".glb") || name.ends_with(".gltf"))
        return mentions(kGltfHead, {kSplatExtension, kSpzExtensions[2], kSpzExtensions[3]});
    if (name == kSogMeta) return mentions(kPlyHead, {"\"means\""});
    const FormatRow* row = row_of_name(entry.name);
    return row && row->read;
}

std::vector<ZipFiles::Entry> all_splats(const ZipFiles& zip) {
    std::vector<ZipFiles::Entry> found;
    std::ranges::copy_if(zip.entries(), std::back_inserter(found),
                         [&](const ZipFiles::Entry& entry) { return is_splats(zip, entry); });
    return found;
}

std::string without_splats(const ZipFiles& zip) {
    const auto named = [&](std::string_view end) {
        const auto entry = std::ranges::find_if(zip.entries(), [&](const ZipFiles::Entry& each) {
            return core::lower(each.name.filename().string()).ends_with(end);
        });
        return entry == zip.entries().end() ? std::string() : core::one_line(entry->name.string());
    };
    if (!named("data.pkl").empty())
        return "a checkpoint of PyTorch, which ewa does not read; export a PLY with the program that wrote "
               "it, as "
               "ns-export gaussian-splat does";
    if (const std::string inner = named(".zip"); !inner.empty())
        return "an archive with another one, " + inner + "; unpack it, and name that";
    return "an archive without splats; if they are in a file inside of it, unpack that";
}

}  // namespace

bool has_splats(const ZipFiles& zip) {
    return std::ranges::any_of(zip.entries(),
                               [&](const ZipFiles::Entry& entry) { return is_splats(zip, entry); });
}

ZipFiles::Entry zipped_splats(const std::filesystem::path& path, const ZipFiles& zip) {
    const std::vector<ZipFiles::Entry> found = all_splats(zip);
    const auto fail = [&](const std::string& text) {
        throw InputError(core::one_line(path.string()) + ": " + text);
    };
    if (found.empty()) fail(without_splats(zip));
    for (const ZipFiles::Entry& entry : found)
        if (entry.name.filename() == kLevelsName)
            fail("a streamed SOG is read from its folder; unpack the archive, and name the " +
                 std::string(kLevelsName));
    if (found.size() > 1)
        fail("the archive has several files of splats, such as " + core::one_line(found[0].name.string()) +
             " and " + core::one_line(found[1].name.string()) + "; unpack it, and name one");
    return found.front();
}

SplatScene read_zipped(const std::filesystem::path& path, SplatScene (*read)(const std::filesystem::path&)) {
    const ZipFiles zip(path);
    const ZipFiles::Entry splats = zipped_splats(path, zip);
    const core::TemporaryFolder folder("ewa-zip-");
    // Formats of several files have them beside or below the one that names them.
    const std::string beside = splats.name.parent_path().string();
    zip.unpack(
        folder.path(), [](int) { return true; },
        [&](const ZipFiles::Entry& entry) {
            const bool several = splats.name.extension() != ".ply" && splats.name.extension() != ".spz";
            return entry.index == splats.index ||
                   (several && (beside.empty() || entry.name.string().starts_with(beside + "/")));
        });
    try {
        SplatScene scene = read(folder.path() / splats.name);
        scene.variant += scene.variant.empty() ? "zipped" : ", zipped";
        return scene;
    } catch (const InputError& error) {
        throw InputError(named_in_archive(error.what(), folder.path(), path));
    }
}

}  // namespace ewa::io
