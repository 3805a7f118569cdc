// SPDX-License-Identifier: Apache-2.0
#include "core/sandboxed_path.h"

#include "support/temp_folder.h"

namespace {

namespace core = ewa::core;
using ewa::test::TempFolder;
namespace fs = std::filesystem;

TEST(Inside, Names) {
    const std::pair<std::string, std::string> good[] = {
        {"a.png", "a.png"},      {"./images/a.png", "images/a.png"}, {"images\\a.png", "images/a.png"},
        {"a/../b.png", "b.png"}, {"a/..b/...", "a/..b/..."},         {"images//r_0", "images/r_0"},
        {"..png", "..png"}};
    for (const auto& [name, inside] : good) EXPECT_EQ(core::name_inside(name), fs::path(inside)) << name;
    for (const std::string& name :
         {std::string(), std::string("."), std::string("./"), std::string("a/.."), std::string("images/"),
          std::string(".."), std::string("../a.png"), std::string("a/../../b.png"), std::string("..\\a.png"),
          std::string("a\\..\\..\\b.png"), std::string("/etc/passwd"), std::string("\\\\server\\a.png"),
          std::string("C:\\a.png"), std::string("c:a.png"), std::string("a.png\0.png", 10)})
        EXPECT_EQ(core::name_inside(name), std::nullopt) << name;
}

TEST(Inside, Links) {
    const TempFolder elsewhere, folder;
    elsewhere.write("deep/secret.png", "x");
    folder.write("images/a.png", "x");
    folder.write("raw/b.png", "x");
    fs::create_symlink(elsewhere.path(), folder / "photos");
    fs::create_symlink(elsewhere.path(), folder / "images/out");
    fs::create_symlink(elsewhere / "deep/secret.png", folder / "images/out.png");
    fs::create_symlink("../raw/b.png", folder / "images/b.png");
    fs::create_symlink("nowhere", folder / "images/dangling.png");
    fs::create_symlink(folder.path(), elsewhere / "root");
    fs::create_symlink(elsewhere / "deep/secret.png", folder / "top.png");
    for (const fs::path& root : {folder.path(), elsewhere / "root"}) {
        for (const char* name : {"images/a.png", "images/none.png", "images/b.png", "images/dangling.png"}) {
            EXPECT_TRUE(core::links_stay_inside(root, name)) << name;
            EXPECT_TRUE(core::links_stay_with_images(root, name)) << name;
        }
        for (const char* name :
             {"images/out/deep/secret.png", "images/out.png", "top.png", "images/out/none.png"}) {
            EXPECT_FALSE(core::links_stay_inside(root, name)) << name;
            EXPECT_FALSE(core::links_stay_with_images(root, name)) << name;
        }
        EXPECT_FALSE(core::links_stay_inside(root, "photos/deep/secret.png"));
        EXPECT_TRUE(core::links_stay_with_images(root, "photos/deep/secret.png"));
    }
    const fs::path before = fs::current_path();
    fs::current_path(folder.path());
    EXPECT_TRUE(core::links_stay_inside("", "images/b.png"));
    EXPECT_FALSE(core::links_stay_inside("", "images/out.png"));
    EXPECT_TRUE(core::links_stay_with_images("", "photos/deep/secret.png"));
    fs::current_path(before);
}

}  // namespace
