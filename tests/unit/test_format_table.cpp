// SPDX-License-Identifier: Apache-2.0
// The table of the splat formats: each row is whole, and names find it.
#include <gtest/gtest.h>

#include "core/text.h"
#include "ewa/splat_edit.h"
#include "ewa/splat_files.h"
#include "io/splats/prepare.h"
#include "support/splat_scenes.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using io::FormatRow;

TEST(FormatTable, RowsAreWhole) {
    for (const FormatRow& row : io::format_rows()) {
        SCOPED_TRACE(row.extension);
        EXPECT_EQ(&io::row_of(row.format), &row);
        EXPECT_FALSE(row.name.empty() || row.readers.empty());
        EXPECT_TRUE(row.read || row.writable());
        EXPECT_FALSE(row.write && row.consume);
        EXPECT_EQ(row.purpose.empty(), !row.writable());
        EXPECT_EQ(row.splat_bytes[0] > 0, row.writable());
        EXPECT_EQ(row.splat_bytes[1] > 0, row.writable() && !row.no_sh);
        EXPECT_EQ(row.unread.empty(), row.read != nullptr);
        EXPECT_FALSE(row.writable() && !row.read && row.unchecked.empty());
        EXPECT_FALSE(row.beside && !row.values);
        const std::string name(row.extension), file = name.starts_with('.') ? "dir/a" + name : "dir/" + name;
        EXPECT_EQ(io::row_of_name(file), &row);
        std::string upper = file;
        for (char& c : upper) c = char(std::toupper(static_cast<unsigned char>(c)));
        EXPECT_EQ(io::row_of_name(upper), &row);
    }
    EXPECT_EQ(io::row_of_name("a.htm"), &io::row_of(SplatFormat::page));
    for (const char* name : {"a", "ply", "xmeta.json", "a.obj", ""})
        EXPECT_EQ(io::row_of_name(name), nullptr);
}

TEST(FormatTable, ListsOfExtensions) {
    EXPECT_EQ(io::extension_list(io::Uses::read),
              ".ply .compressed.ply .splat .ksplat .spz .sog meta.json lod-meta.json .glb .gltf");
    EXPECT_EQ(io::extension_list(io::Uses::only_read), ".ksplat");
    EXPECT_EQ(io::extension_text(io::Uses::only_written), ".usda, .usdz, tileset.json, .html (a page)");
    EXPECT_EQ(io::extension_text(io::Uses::both),
              ".ply, .compressed.ply, .splat, .spz, .sog, meta.json of a SOG, lod-meta.json, .glb, .gltf");
}

/// Each format gets what it can hold, and says what it does not keep.
TEST(FormatTable, PreparesWhatAFormatDoesNotKeep) {
    Gaussians scene = test::storable_splats(1, 20, 1);
    scene.origin = {1e6, 0, 0};
    scene.density = true;
    scene.opacity_logits[3] = NAN;
    for (const FormatRow& row : io::format_rows()) {
        SCOPED_TRACE(row.extension);
        Gaussians prepared = scene;
        const std::vector<std::string> remarks = io::prepare(prepared, row);
        EXPECT_EQ(remarks.size(), size_t(!row.world) + size_t(!row.density) + size_t(!row.undrawable));
        EXPECT_EQ(prepared.origin == scene.origin, row.world);
        EXPECT_EQ(prepared.density, row.density);
        EXPECT_EQ(prepared.size(), row.undrawable ? 20u : 19u);
        EXPECT_TRUE(io::is_prepared(prepared, row));
        EXPECT_EQ(io::is_prepared(scene, row), row.world && row.density && row.undrawable);
        Gaussians matched = scene;
        EXPECT_EQ(io::match_file(matched, row).size(), size_t(!row.undrawable));
        EXPECT_EQ(matched.origin, scene.origin);
        EXPECT_EQ(matched.size(), prepared.size());
    }
}

TEST(FormatTable, CommentsAndMarksThatAreDroppedAreSaid) {
    const SaveOptions options{.comments = {"ewa place 1 2 3"}, .antialiased = true};
    for (const FormatRow& row : io::format_rows()) {
        const bool comments = row.comments || row.place;
        EXPECT_EQ(io::dropped_remarks(options, row).size(), size_t(!comments) + size_t(!row.mark))
            << row.extension;
        EXPECT_EQ(io::dropped_remarks({.comments = {"x"}}, row).size(), size_t(!row.comments))
            << row.extension;
        EXPECT_TRUE(io::dropped_remarks({}, row).empty());
    }
}

}  // namespace
