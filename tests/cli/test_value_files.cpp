// SPDX-License-Identifier: Apache-2.0
// The files beside a .gltf and the meta.json of a SOG that hold their values.
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <future>
#include <memory>

#include "cli/expect.h"
#include "cli/faulty.h"
#include "core/folders.h"
#include "ewa/splat_files.h"
#include "platform/file.h"

namespace {

using namespace ewa::test;
namespace fs = std::filesystem;
using Names = std::vector<std::string>;

TEST(ValueFiles, KeepsTheBinOfAGltfThatItReads) {
    const Folder folder;
    make_splats(folder / "s.ply");
    expect_success(run_ewa({"convert", folder / "s.ply", folder / "g.gltf"}));
    const std::string good = read_file(folder / "g.bin");
    expect_failure(run_ewa({"convert", folder / "g.gltf", folder / "o.ply", "--json", folder / "g.bin"}), 2,
                   "values of an input");
    EXPECT_EQ(read_file(folder / "g.bin"), good);
}

TEST(ValueFiles, NamesTheBinOfAGltfAndLeavesOthersAlone) {
    const Folder folder;
    make_splats(folder / "s.ply");
    const std::vector<std::string> convert{"convert", folder / "s.ply", folder / "g.gltf", "--json",
                                           folder / "g.json"};
    const char* turns[] = {"g.bin", "g-2.bin", "g.bin"};  // its own it replaces
    for (const char* name : turns) {
        SCOPED_TRACE(name);
        const Outcome outcome = run_ewa(convert);
        expect_success(outcome);
        EXPECT_EQ(files_below(folder / ""), (Names{name, "g.gltf", "g.json", "s.ply"}));
        const auto bytes = fs::file_size(folder / name);
        EXPECT_EQ(bytes, 50u * (12 + 8 + 16 + 12 + 4 + 4 * 12));
        EXPECT_NE(outcome.out.find((folder / name) + ": the values of this glTF, 5 kB"), std::string::npos)
            << outcome.out;
        EXPECT_EQ(read_json(folder / "g.json")["output"]["values"]["bytes"], bytes);
    }
    // Somebody's, or what a kill left: free names are taken, and nothing of others is touched.
    write_file(folder / "g-2.bin", "somebody's");
    expect_success(run_ewa(convert));
    EXPECT_EQ(files_below(folder / ""), (Names{"g-2.bin", "g-3.bin", "g.gltf", "g.json", "s.ply"}));
    EXPECT_EQ(read_file(folder / "g-2.bin"), "somebody's");
    for (const char* before : {R"({"asset": {"version": "2.0"}})", "damaged"}) {
        write_file(folder / "g.gltf", before);
        expect_success(run_ewa(convert));
        EXPECT_EQ(read_file(folder / "g-2.bin"), "somebody's");
        EXPECT_EQ(ewa::load_splats(folder / "g.gltf").size(), 50u);
    }
}

/// Each file of a .gltf whose stem looks like another's values.
TEST(ValueFiles, AGltfLeavesTheValuesOfOthersAlone) {
    const Folder folder;
    make_splats(folder / "a.ply", 10);
    make_splats(folder / "b.ply", 20);
    const auto convert = [&](const std::string& in, const std::string& out) {
        expect_success(run_ewa({"convert", folder / in, folder / out, "--quiet"}));
    };
    const auto splats = [&](const char* name) { return ewa::load_splats(folder / name).size(); };
    convert("a.ply", "x.gltf");
    convert("b.ply", "x-2.gltf");
    convert("b.ply", "x-3.gltf");
    for (int again = 0; again < 2; ++again) {
        convert("a.ply", "x.gltf");
        EXPECT_EQ(splats("x.gltf"), 10u);
        EXPECT_EQ(splats("x-2.gltf"), 20u);
        EXPECT_EQ(splats("x-3.gltf"), 20u);
    }
    convert("x-2.gltf", "x.gltf");
    EXPECT_EQ(splats("x.gltf"), 20u);
    EXPECT_EQ(splats("x-2.gltf"), 20u);

    // An input that is no .bin at all: formats go by their content.
    fs::copy_file(folder / "a.ply", folder / "y-2.bin");
    convert("a.ply", "y.gltf");
    convert("y-2.bin", "y.gltf");
    EXPECT_EQ(splats("y-2.bin"), 10u);
    EXPECT_EQ(splats("y.gltf"), 10u);

    // A .gltf that names a file which ewa would not have named so; and a copy that shares its values.
    std::string text = read_file(folder / "y.gltf");
    const std::string values = text.substr(text.find("y-"), 7);
    fs::copy_file(folder / "y.gltf", folder / "copy.gltf");
    convert("b.ply", "y.gltf");
    EXPECT_EQ(splats("copy.gltf"), 10u);
    fs::copy_file(folder / values, folder / "notes.txt");
    text.replace(text.find(values), values.size(), "notes.txt");
    write_file(folder / "z.gltf", text);
    write_file(folder / "z-2.bin", "somebody's");
    convert("b.ply", "z.gltf");
    EXPECT_TRUE(fs::exists(folder / "notes.txt"));
    EXPECT_EQ(read_file(folder / "z-2.bin"), "somebody's");
    EXPECT_EQ(splats("z.gltf"), 20u);
}

TEST(ValueFiles, ProtectsTheValuesOfAGltfUnderAnyName) {
    const Folder folder;
    make_splats(folder / "s.ply");
    expect_success(run_ewa({"convert", folder / "s.ply", folder / "g.gltf"}));
    fs::rename(folder / "g.bin", folder / "v.ply");
    std::string text = read_file(folder / "g.gltf");
    text.replace(text.find("g.bin"), 5, "v.ply");
    write_file(folder / "g.gltf", text);
    const std::string values = read_file(folder / "v.ply");
    expect_failure(run_ewa({"convert", folder / "g.gltf", folder / "v.ply"}), 2, "values of an input");
    EXPECT_EQ(read_file(folder / "v.ply"), values);
}

TEST(ValueFiles, UnpacksASogAndLeavesOtherImagesAlone) {
    const Folder folder;
    make_splats(folder / "s.ply", 50, 1);
    fs::create_directory(folder / "sog");
    const Names convert{"convert", folder / "s.ply", folder / "sog/meta.json",
                        "--check", "--json",         folder / "g.json"};
    for (const char* first : {"means_l", "means_l-2", "means_l"}) {  // its own it replaces
        const Outcome outcome = run_ewa(convert);
        expect_success(outcome);
        EXPECT_TRUE(fs::exists(folder / (std::string("sog/") + first + ".webp")));
        EXPECT_NE(outcome.out.find(std::string(first) + ".webp and 6 other images: the values of this SOG"),
                  std::string::npos)
            << outcome.out;
        EXPECT_EQ(files_below(folder / "sog").size(), 8u);
    }
    const auto json = read_json(folder / "g.json");
    EXPECT_EQ(json["output"]["values"]["files"].size(), 7u);
    // Compared in the order in which it is written.
    EXPECT_LT(json["check"]["position"]["largest"].get<double>(), 0.001);
    expect_failure(
        run_ewa({"convert", folder / "sog/meta.json", folder / "o.ply", "--json", folder / "sog/quats.webp"}),
        2, "values of an input");
    for (const char* name : {"sog/means_l-2.webp", "sog/sh0-3.webp"}) write_file(folder / name, "somebody's");
    for (int again = 0; again < 3; ++again) {
        expect_success(run_ewa(convert));
        for (const char* name : {"sog/means_l-2.webp", "sog/sh0-3.webp"})
            EXPECT_EQ(read_file(folder / name), "somebody's");
        EXPECT_EQ(files_below(folder / "sog").size(), 10u);
    }
    fs::rename(folder / "sog/meta.json", folder / "sog/other.json");
    const Outcome info = run_ewa({"info", folder / "sog/other.json", "--json"});
    expect_success(info);
    EXPECT_EQ(nlohmann::json::parse(info.out)["variant"], "version 2, unpacked");
}

/// Several programs write one file. Each result is that of one of them, and nothing else is left.
TEST(ValueFiles, SeveralWritersAtOnce) {
    const Folder folder;
    for (int i = 0; i < 4; ++i) make_splats(folder / (std::to_string(i) + ".ply"), 1000 + 500 * i);
    for (const std::string name : {"g.gltf", "meta.json", "lod-meta.json", "tileset.json"})
        for (int round = 0; round < 3; ++round) {
            SCOPED_TRACE(name);
            const std::string out = folder / ("out-" + name + "/" + name);
            std::vector<std::future<Outcome>> writers;
            for (int i = 0; i < 4; ++i)
                writers.push_back(std::async(std::launch::async, [&, i] {
                    return run_ewa({"convert", folder / (std::to_string(i) + ".ply"), out, "--quiet"});
                }));
            for (auto& writer : writers) expect_success(writer.get());
            if (name == "tileset.json") continue;
            const size_t splats = ewa::load_splats(out).size();
            EXPECT_TRUE(splats >= 1000 && splats <= 2500 && splats % 500 == 0) << splats;
        }
}

/// Who replaces a file has it locked until its older values are gone.
TEST(ValueFiles, AWriterWaitsForAnother) {
    const Folder folder;
    make_splats(folder / "s.ply");
    for (const std::string name : {"g.gltf", "meta.json", "lod-meta.json", "tileset.json"}) {
        SCOPED_TRACE(name);
        const std::string out = folder / ("out-" + name + "/" + name);
        const Names convert{"convert", folder / "s.ply", out, "--quiet"};
        expect_success(run_ewa(convert));
        const auto before = ewa::platform::file_id(out);
        auto lock = std::make_unique<ewa::core::FileLock>(out);
        ewa::platform::File second;
        if (ewa::platform::lock_path(out, second) != ewa::platform::Lock::taken)
            GTEST_SKIP() << "no locks in the folder for temporary files";
        auto writer = std::async(std::launch::async, [&] { return run_ewa(convert); });
        EXPECT_EQ(writer.wait_for(std::chrono::milliseconds(400)), std::future_status::timeout);
        EXPECT_EQ(ewa::platform::file_id(out), before);
        // The lock is that of a file, not of its name.
        fs::copy_file(out, out + "-new");
        EXPECT_FALSE(ewa::platform::replace(out + "-new", out));
        lock.reset();
        expect_success(writer.get());
        const size_t files = files_below(out.substr(0, out.rfind('/'))).size();
        expect_success(run_ewa(convert));
        EXPECT_EQ(files_below(out.substr(0, out.rfind('/'))).size(), files);
    }
}

/// A .gltf of another program keeps its values, which others may use.
TEST(ValueFiles, LeavesTheValuesOfOtherPrograms) {
    const Folder folder;
    make_splats(folder / "s.ply");
    const std::vector<std::string> convert{"convert", folder / "s.ply", folder / "g.gltf", "--quiet"};
    expect_success(run_ewa(convert));
    std::string text = read_file(folder / "g.gltf");
    text.replace(text.find("ewa "), 4, "Blender ");
    write_file(folder / "g.gltf", text);
    expect_success(run_ewa(convert));
    EXPECT_EQ(files_below(folder / ""), (Names{"g-2.bin", "g.bin", "g.gltf", "s.ply"}));
}

/// A kill between two renames leaves values that nobody names. The next conversion takes other names.
TEST(ValueFiles, AKillIsNoObstacle) {
    const Folder folder;
    make_splats(folder / "s.ply");
    for (const char* name : {"g.gltf", "meta.json"}) {
        SCOPED_TRACE(name);
        fs::create_directory(folder / "out");
        const std::string out = folder / (std::string("out/") + name);
        const Names convert{"convert", folder / "s.ply", out, "--quiet"};
        int kills = 0;
        for (int moment = 1; moment < 400; ++moment) {
            SCOPED_TRACE(moment);
            fs::remove(out);
            const Outcome outcome = run_ewa(convert, with_fault("EWA_FAULT_KILL", std::to_string(moment)));
            if (outcome.status == 0) break;
            ASSERT_EQ(outcome.status, 128 + SIGKILL) << outcome.err;
            ++kills;
            fs::remove(out);
            expect_success(run_ewa(convert));
            EXPECT_EQ(ewa::load_splats(out).size(), 50u);
        }
        EXPECT_GE(kills, 3);
        fs::remove_all(folder / "out");
    }
}

}  // namespace
