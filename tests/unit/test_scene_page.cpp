// SPDX-License-Identifier: Apache-2.0
// The page that shows a scene in a browser.
#include <gtest/gtest.h>

#include "ewa/splat_files.h"
#include "io/splats/scene_page.h"
#include "support/splat_scenes.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using io::ScenePage;

TEST(ScenePage, HoldsTheSceneAndItsViews) {
    ScenePage page;
    page.title = "a <b> & @SCENE@";
    page.sog = "PK\3\4 scene";
    page.start = {4, 3, 5, 6, 2, 1.5};
    page.views = {{"</script>.jpg", page.start}};
    page.film = {{page.start, 0}, {page.start, 2.5}};
    const std::string html = io::scene_page_html(page);
    EXPECT_NE(html.find("<title>a &lt;b&gt; &amp; @SCENE@</title>"), std::string::npos);
    EXPECT_NE(html.find(R"(id="scene">UEsDBCBzY2VuZQ==</script>)"), std::string::npos);
    EXPECT_NE(html.find(R"("name":"\u003c/script>.jpg")"), std::string::npos);
    EXPECT_NE(html.find(R"("fx":5.0,"fy":6.0)"), std::string::npos);
    for (const char* part : {R"("film":[{)", R"("time":2.5)"}) EXPECT_NE(html.find(part), std::string::npos);
    for (const char* mark : {"@TITLE@", "@SETTINGS@", "@STYLE@", "@SCRIPT@"})
        EXPECT_EQ(html.find(mark), std::string::npos) << mark;
}

TEST(ScenePage, IsAFormatOfSplatFiles) {
    const test::TempFolder folder;
    const SaveOptions options{.page = {.title = "A scene", .background = {1, 0, 0.5f}}};
    save_splats(folder / "a.HTM", test::storable_splats(1, 50, 1), options);
    const std::string page = test::file_bytes(folder / "a.HTM");
    for (const char* part : {"<title>A scene</title>", "id=\"scene\">UEsDB", "\"background\":[1.0,0.0,0.5]"})
        EXPECT_NE(page.find(part), std::string::npos) << part;
    test::expect_error<InputError>([&] { load_splats(folder / "a.HTM"); },
                                   {"a.HTM", "ewa writes pages and does not read them"});
}

}  // namespace
