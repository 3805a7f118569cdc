// SPDX-License-Identifier: Apache-2.0
// Feeds every seed to its fuzz target: all past findings stay found. Without a sanitizer, operator new counts
// the memory that the targets bound.
#include <gtest/gtest.h>
#include <malloc.h>

#include <cstddef>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <new>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "targets.inc"

#ifndef EWA_SANITIZED
void* operator new(size_t size) {
    void* pointer = std::malloc(size);
    if (!pointer) throw std::bad_alloc();
    ewa::fuzz::on_malloc(pointer, malloc_usable_size(pointer));
    return pointer;
}
void operator delete(void* pointer) noexcept {
    ewa::fuzz::on_free(pointer);
    std::free(pointer);
}
void operator delete(void* pointer, size_t) noexcept {
    operator delete(pointer);
}
#endif

namespace {

namespace fs = std::filesystem;

const fs::path kSeeds = EWA_SEEDS;

std::vector<uint8_t> bytes_of(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

std::vector<fs::path> seeds_of(const std::string& target) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(kSeeds / target)) files.push_back(entry.path());
    return files;
}

class Seeds : public testing::TestWithParam<size_t> {};

/// A target that finds something ends the process.
TEST_P(Seeds, AreReadOrRefused) {
    const auto& [name, target] = kTargets[GetParam()];
    const std::vector<fs::path> files = seeds_of(name);
    EXPECT_FALSE(files.empty());
    for (const fs::path& file : files) {
        SCOPED_TRACE(file.string());
        const std::vector<uint8_t> bytes = bytes_of(file);
        printf("%s\n", file.filename().c_str());
        std::fflush(stdout);
        EXPECT_EQ(target(bytes.data(), bytes.size()), 0);
    }
}

INSTANTIATE_TEST_SUITE_P(All, Seeds, testing::Range(size_t(0), std::size(kTargets)),
                         [](const auto& tested) { return std::string(kTargets[tested.param].first); });

TEST(SeedFolders, BelongToATarget) {
    std::set<std::string> targets;
    for (const auto& [name, target] : kTargets) targets.insert(name);
    for (const auto& entry : fs::directory_iterator(kSeeds))
        EXPECT_TRUE(targets.contains(entry.path().filename().string())) << entry.path();
}

}  // namespace
