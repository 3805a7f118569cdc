// SPDX-License-Identifier: Apache-2.0
// The files of the editor without its window: recent files, what Save as offers and refuses, and publishing.
#include <sys/stat.h>

#include <algorithm>
#include <memory>

#include "cli/program.h"
#include "core/messages.h"
#include "edit/edited_splats.h"
#include "ewa/splat_files.h"
#include "support/soon.h"
#include "viewer/editor/dialogs.h"
#include "viewer/editor/publish.h"
#include "viewer/editor/save_choices.h"
#include "viewer/variable.h"

namespace ewa::test {
namespace {

namespace fs = std::filesystem;
using viewer::Publisher;
using viewer::PublishOrder;

class RecentFiles : public testing::Test {
  protected:
    void damage(const std::string& text) {
        fs::create_directories(folder_ / "ewa");
        write_file(json_, text);
    }
    Folder folder_;
    const Variable config_{"XDG_CONFIG_HOME", folder_ / "."};
    const std::string json_ = folder_ / "ewa/recent.json";
};

TEST_F(RecentFiles, AreTheLastTenNewestFirst) {
    EXPECT_TRUE(viewer::recent_files().empty());
    for (int i = 0; i < 12; ++i) viewer::remember_file("/scenes/" + std::to_string(i) + ".ply");
    std::vector<fs::path> files = viewer::recent_files();
    ASSERT_EQ(files.size(), 10u);
    EXPECT_EQ(files.front(), "/scenes/11.ply");
    EXPECT_EQ(files.back(), "/scenes/2.ply");
    viewer::remember_file("/scenes/x/../5.ply");
    files = viewer::recent_files();
    ASSERT_EQ(files.size(), 10u);
    EXPECT_EQ(files[0], "/scenes/5.ply");
    EXPECT_EQ(std::count(files.begin(), files.end(), "/scenes/5.ply"), 1);
    viewer::remember_file("here.ply");
    EXPECT_EQ(viewer::recent_files().front(), fs::absolute("here.ply"));
}

TEST_F(RecentFiles, OfADamagedFileAreNone) {
    for (const std::string& text :
         {std::string(), std::string("{"), std::string("[1]"), std::string("{\"recent\": 7}"),
          std::string("{}"), std::string(70000, ' ') + "{}", std::string(300, '['),
          std::string("\xff\xfe")}) {
        damage(text);
        EXPECT_TRUE(viewer::recent_files().empty()) << text.substr(0, 60);
    }
    damage(R"({"recent": [1, null, "relative.ply", "", "/a.ply", {}, "/a.ply", "/b.ply"], "other": 2})");
    EXPECT_EQ(viewer::recent_files(), (std::vector<fs::path>{"/a.ply", "/b.ply"}));
    damage("{");
    viewer::remember_file("/c.ply");
    EXPECT_EQ(viewer::recent_files(), std::vector<fs::path>{"/c.ply"});
}

TEST_F(RecentFiles, NeedAFolderOfTheUser) {
    const Variable none("XDG_CONFIG_HOME", ""), homeless("HOME", "");
    viewer::remember_file("/a.ply");
    EXPECT_TRUE(viewer::recent_files().empty());
}

TEST(SaveChoices, NamesGetTheExtensionOfTheFormat) {
    const auto renamed = [](const std::string& path, SplatFormat format) {
        return viewer::with_format(path, io::row_of(format)).string();
    };
    EXPECT_EQ(renamed("/a/b", SplatFormat::spz), "/a/b.spz");
    EXPECT_EQ(renamed("/a/b.ply", SplatFormat::spz), "/a/b.spz");
    EXPECT_EQ(renamed("/a/b.COMPRESSED.ply", SplatFormat::ply), "/a/b.ply");
    EXPECT_EQ(renamed("/a/b.ply", SplatFormat::compressed_ply), "/a/b.compressed.ply");
    EXPECT_EQ(renamed("/a/b.htm", SplatFormat::page), "/a/b.htm");
    EXPECT_EQ(renamed("/a/b.htm", SplatFormat::sog), "/a/b.sog");
    EXPECT_EQ(renamed("/a/b.txt", SplatFormat::sog), "/a/b.txt.sog");
    EXPECT_EQ(renamed("/a/b.ply", SplatFormat::sog_levels), "/a/b/lod-meta.json");
    EXPECT_EQ(renamed("/a/b/lod-meta.json", SplatFormat::page), "/a/b.html");
    EXPECT_EQ(renamed("/a/b/lod-meta.json", SplatFormat::sog_meta), "/a/b/meta.json");
    EXPECT_EQ(renamed("", SplatFormat::ply), "scene.ply");
}

TEST(SaveChoices, ProposeANameBesideTheOriginal) {
    const auto proposed = [](const std::string& file, const std::string& name, SplatFormat format) {
        return viewer::proposed_file(file, name, io::row_of(format)).string();
    };
    EXPECT_EQ(proposed("/a/b.ply", "b", SplatFormat::ply), "/a/b-edited.ply");
    EXPECT_EQ(proposed("/a/b-edited.sog", "b", SplatFormat::ply), "/a/b-edited-2.ply");
    EXPECT_EQ(proposed("/a/b-edited-9.sog", "b", SplatFormat::ply), "/a/b-edited-10.ply");
    EXPECT_EQ(proposed("/a/b-edited-x.ply", "b", SplatFormat::ply), "/a/b-edited-x-edited.ply");
    EXPECT_EQ(proposed("/a/b-edited7.ply", "b", SplatFormat::ply), "/a/b-edited7-edited.ply");
    EXPECT_EQ(proposed("/a/b.ply", "b", SplatFormat::sog_levels), "/a/b-edited/lod-meta.json");
    EXPECT_EQ(proposed("/a/b/meta.json", "b", SplatFormat::page), "/a/b-edited.html");
    EXPECT_EQ(proposed("/a/run/", "run", SplatFormat::sog), "/a/run-edited.sog");
    EXPECT_EQ(proposed("", "part", SplatFormat::sog), "part.sog");
    EXPECT_EQ(proposed("", "", SplatFormat::sog), "scene.sog");
    EXPECT_EQ(viewer::proposed_file("/a/b.compressed.ply", "b 2", io::row_of(SplatFormat::sog), 2),
              "/a/b-2.sog");
}

TEST(SaveChoices, SayWhatAFormatDoesNotKeep) {
    Gaussians splats;
    splats.sh_degree = 1;
    for (const io::FormatRow& row : io::format_rows()) {
        if (!row.writable()) continue;
        EXPECT_EQ(viewer::losses(row, splats).empty(), row.format == SplatFormat::ply) << row.extension;
    }
    const io::FormatRow& flat = io::row_of(SplatFormat::splat);
    const size_t all = viewer::losses(flat, splats).size();
    splats.sh_degree = 0;
    EXPECT_EQ(viewer::losses(flat, splats).size() + 1, all) << "there is no view dependence to lose";
    splats.density = true;
    splats.origin = {1e6, 0, 0};
    EXPECT_EQ(viewer::losses(flat, splats).size(), all + 1);
    EXPECT_TRUE(viewer::losses(io::row_of(SplatFormat::ply), splats).empty());
}

TEST(SaveChoices, EstimateTheSizeOfAFile) {
    const Folder folder;
    make_splats(folder / "a.ply", 2000, 2);
    const auto usual = double(viewer::usual_bytes(io::row_of(SplatFormat::ply), 2000, 2));
    EXPECT_NEAR(usual / double(fs::file_size(folder / "a.ply")), 1, 0.1);
    EXPECT_EQ(viewer::usual_bytes(io::row_of(SplatFormat::splat), 2000, 3), 64000u);
}

TEST(SaveChoices, TellWhatWasWritten) {
    const Folder folder;
    write_file(folder / "room.html", std::string(1360, ' '));
    EXPECT_EQ(viewer::wrote_text(folder / "room.html", 73777), "Wrote room.html, 1.36 kB, 73,777 splats");
    make_splats(folder / "a.ply", 40);
    fs::create_directories(folder / "levels");
    const std::string naming = folder / "levels/lod-meta.json";
    save_splats(naming, load_splats(folder / "a.ply"));
    uint64_t bytes = 0;
    for (const std::string& file : files_below(folder / "levels"))
        bytes += fs::file_size(folder / ("levels/" + file));
    EXPECT_EQ(viewer::wrote_text(naming, 40), "Wrote levels, " + core::bytes_text(bytes) + ", 40 splats");
    EXPECT_NE(viewer::wrote_text(folder / "none.ply", 0).find("0 B, 0 splats"), std::string::npos);
    EXPECT_EQ(viewer::stem_of("guitar.compressed.ply"), "guitar");
    EXPECT_EQ(viewer::stem_of("a room"), "a room");
}

TEST(SaveChoices, NeverReplaceTheOriginal) {
    const Folder folder;
    make_splats(folder / "a.ply");
    fs::create_symlink(folder / "a.ply", folder / "link.ply");
    fs::create_directories(folder / "run");
    const std::vector<fs::path> originals{folder / "a.ply", "", folder / "run"};
    for (const char* same : {"a.ply", "link.ply", "./a.ply", "run/../a.ply"})
        EXPECT_NE(viewer::refusal(folder / same, originals).find("never touched"), std::string::npos) << same;
    EXPECT_EQ(viewer::refusal(folder / "b.ply", originals), "");
    EXPECT_EQ(viewer::refusal(folder / "new/b.sog", originals), "");
    EXPECT_FALSE(fs::exists(folder / "new"));
    for (const char* wrong : {"run", "run/splats.ply", "b.ksplat", "b.obj", "a.ply/b.ply"})
        EXPECT_NE(viewer::refusal(folder / wrong, originals), "") << wrong;
    EXPECT_EQ(files_below(folder / ".").size(), 2u);  // the file and its link
}

TEST(SaveChoices, NeverReplaceTheValuesOfTheOriginal) {
    const Folder folder;
    make_splats(folder / "a.ply");
    fs::create_directories(folder / "b");
    save_splats(folder / "b/meta.json", load_splats(folder / "a.ply"));
    EXPECT_NE(viewer::refusal(folder / "b/meta.json", {folder / "b/meta.json"}), "");
    EXPECT_EQ(viewer::refusal(folder / "c.sog", {folder / "b/meta.json"}), "");
    fs::create_directories(folder / "c");
    save_splats(folder / "c/lod-meta.json", load_splats(folder / "a.ply"));
    size_t chunks = 0;
    for (const std::string& part : files_below(folder / "c"))
        if (part.ends_with("/meta.json")) {
            ++chunks;
            EXPECT_NE(viewer::refusal(folder / "c/lod-meta.json", {folder / "c/" + part}), "") << part;
        }
    EXPECT_GT(chunks, 0u);
}

PublishOrder order_of(const Folder& folder, const std::string& out) {
    PublishOrder order;
    order.scene = folder / "a.ply";
    order.out = folder / out;
    return order;
}

Publisher::Result published(Publisher& publisher, PublishOrder order) {
    publisher.start(std::move(order));
    EXPECT_TRUE(publisher.running());
    std::optional<Publisher::Result> result;
    EXPECT_TRUE(soon([&] {
        result = publisher.take();
        return result.has_value();
    }));
    EXPECT_FALSE(publisher.running());
    return result.value_or(Publisher::Result());
}

TEST(Publishing, IsALineOfConvert) {
    PublishOrder order;
    order.scene = "/a b/-x.ply";
    order.out = "/c/d.html";
    EXPECT_EQ(viewer::publish_arguments(order),
              (std::vector<std::string>{"convert", "/a b/-x.ply", "/c/d.html"}));
    order.edits = "/a b/-x.ply.edits";
    order.title = "-t";
    order.views = "/v.json";
    order.levels = 3;
    EXPECT_EQ(viewer::publish_arguments(order),
              (std::vector<std::string>{"convert", "/a b/-x.ply", "/c/d.html", "--edits", "/a b/-x.ply.edits",
                                        "--title=-t", "--views", "/v.json", "--levels", "3"}));
    order.scene = "-x.ply";
    EXPECT_EQ(viewer::publish_arguments(order)[1], fs::absolute("-x.ply").string());
}

TEST(Publishing, ReadsTheShareOfTheWork) {
    EXPECT_EQ(viewer::share_of_line("written 250/1000 splats, 3e4 splats/s, 12 s left"), 0.25f);
    EXPECT_EQ(viewer::share_of_line("written 9/3 splats"), 1);
    for (const char* none : {"", "/", "a/b", "1/0", "/x/y.ply: PLY, 3 splats", "1/2x"})
        EXPECT_FALSE(viewer::share_of_line(none)) << none;
}

TEST(Publishing, WritesAFileInAProcess) {
    const Folder folder;
    make_splats(folder / "a.ply", 40);
    Publisher publisher(EWA_PROGRAM, [] {});
    const Publisher::Result result = published(publisher, order_of(folder, "new/a.html"));
    EXPECT_TRUE(result.done) << result.text;
    EXPECT_NE(result.text.find("40 splats"), std::string::npos) << result.text;
    EXPECT_TRUE(fs::exists(folder / "new/a.html"));
    const Publisher::Result wrong = published(publisher, order_of(folder, "a.ply"));
    EXPECT_FALSE(wrong.done || wrong.stopped);
    EXPECT_NE(wrong.text.find("same file"), std::string::npos) << wrong.text;
}

TEST(Publishing, WritesTheSplatsThatAreLeft) {
    const Folder folder;
    make_splats(folder / "a.ply", 40);
    PublishOrder order = order_of(folder, "a.sog");
    order.scene.clear();
    order.splats = std::make_shared<const Gaussians>(load_splats(folder / "a.ply"));
    auto states = std::make_shared<std::vector<uint8_t>>(40);
    (*states)[3] = edit::kDeleted | edit::kSelected;
    (*states)[4] = edit::kHidden;
    order.states = states;
    Publisher publisher(EWA_PROGRAM, [] {});
    const Publisher::Result result = published(publisher, order);
    ASSERT_TRUE(result.done) << result.text;
    EXPECT_EQ(load_splats(folder / "a.sog").size(), 39u);
}

TEST(Publishing, CanBeStoppedAndShowsWhatItDoes) {
    const Folder folder;
    const std::string program = folder / "ewa";
    write_file(program, "#!/bin/sh\necho begun\necho 'written 1/4 splats'\nexec sleep 1000\n");
    chmod(program.c_str(), 0755);
    Publisher publisher(program, [] {});
    publisher.start(order_of(folder, "a.html"));
    EXPECT_TRUE(soon([&] { return publisher.progress().share == 0.25f; }));
    EXPECT_EQ(publisher.progress().text, "written 1/4 splats");
    publisher.start(order_of(folder, "b.html"));  // one runs
    publisher.stop();
    std::optional<Publisher::Result> result;
    EXPECT_TRUE(soon([&] {
        result = publisher.take();
        return result.has_value();
    }));
    EXPECT_TRUE(result && result->stopped && !result->done);
    Publisher missing(folder / "none", [] {});
    EXPECT_NE(published(missing, order_of(folder, "a.html")).text.find("cannot start"), std::string::npos);
}

}  // namespace
}  // namespace ewa::test
