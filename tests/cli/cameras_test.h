// SPDX-License-Identifier: Apache-2.0
// Tests of ewa cameras, and of ewa train of photos, with programs in the place of COLMAP and others.
#pragma once
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "cli/expect.h"
#include "cli/program.h"

namespace ewa::test {

/// A program of the shell in a folder that PATH begins with.
inline void make_program(const std::string& path, const std::string& script) {
    write_file(path, "#!/bin/sh\n" + script);
    chmod(path.c_str(), 0755);
}

class CamerasTest : public testing::Test {
  protected:
    /// Photos with their model, as COLMAP's text; colmap writes its binary form.
    void SetUp() override {
        make_dataset(folder_ / "source");
        std::filesystem::copy(folder_ / "source/images", folder_ / "photos");
        std::filesystem::create_directories(folder_ / "bin");
        SetUpColmap();
    }

    void SetUpColmap() {
        // The stand-in says what it was called with, prints what COLMAP prints, and its mapper copies models.
        make_program(folder_ / "bin/colmap", R"sh(
case "$*" in *--help*) echo "  --SiftExtraction.use_gpu arg (=1)"; exit 0;; esac
echo "$1" >> "$CALLS"
previous=
for word; do
    if [ "$previous" = --output_path ]; then output=$word; fi
    previous=$word
done
if [ "$FAIL" = "$1" ]; then echo "the reason" >&2; exit 1; fi
if [ "$HANG" = "$1" ]; then echo $$ > "$CALLS.hangs"; exec sleep 1000; fi
case $1 in
feature_extractor) if [ "$DATABASE" ]; then cp "$DATABASE" "$3"; else touch "$3"; fi; for i in 1 2 3 4; do echo "Processed file [$i/4]"; done;;
matches_importer) echo "Matching block [1/1] in 0.1s";;
mapper) cp -r "$MODELS"/. "$output"; echo "Registering image #4 (4)";;
esac
)sh");
    }

    template <class T>
    static std::string bytes_of(T value) {
        return {reinterpret_cast<const char*>(&value), sizeof(value)};
    }

    /// A model of these photos, as COLMAP writes it.
    void make_model(const std::string& name, const std::vector<std::string>& photos) {
        const std::string model = folder_ / ("models/" + name);
        std::filesystem::create_directories(model);
        const ImageDimensions size{};
        std::string cameras = bytes_of(uint64_t(1)) + bytes_of(uint32_t(1)) + bytes_of(int32_t(1)) +
                              bytes_of(size.width) + bytes_of(size.height);
        for (const double value : lens_) cameras += bytes_of(value);
        std::string images = bytes_of(uint64_t(photos.size()));
        for (size_t i = 0; i < photos.size(); ++i) {
            images += bytes_of(uint32_t(i + 1));
            for (const double value : {1.0, 0.0, 0.0, 0.0, 0.1 * double(i), 0.0, 3.0})
                images += bytes_of(value);
            images += bytes_of(uint32_t(1)) + photos[i] + '\0' + bytes_of(uint64_t(0));
        }
        std::string points = bytes_of(uint64_t(8));
        for (int i = 0; i < 8; ++i) {
            points += bytes_of(uint64_t(i + 1));
            for (const int bit : {1, 2, 4}) points += bytes_of(i & bit ? 0.5 : -0.5);
            points += std::string(3, '\x80') + bytes_of(0.5) + bytes_of(uint64_t(0));
        }
        write_file(model + "/cameras.bin", cameras);
        write_file(model + "/images.bin", images);
        write_file(model + "/points3D.bin", points);
    }

    struct ImageDimensions {
        uint64_t width = 48, height = 32;
    };

    Outcome run(const std::vector<std::string>& arguments, Circumstances circumstances = {}) {
        for (const auto& [name, value] :
             std::vector<std::pair<std::string, std::string>>{{"PATH", folder_ / "bin" + ":/usr/bin:/bin"},
                                                              {"CALLS", folder_ / "calls"},
                                                              {"MODELS", folder_ / "models"}})
            circumstances.environment.emplace_back(name, value);
        return run_ewa(arguments, circumstances);
    }

    Outcome cameras(Circumstances circumstances = {}) {
        return run({"cameras", folder_ / "photos", "-o", folder_ / "dataset"}, std::move(circumstances));
    }

    std::string calls() {
        return std::filesystem::exists(folder_ / "calls") ? read_file(folder_ / "calls") : "";
    }

    Folder folder_;
    std::vector<double> lens_{40, 40, 24, 16};  // of the models: fx, fy, cx, cy
};

}  // namespace ewa::test
