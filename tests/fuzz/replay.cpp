// SPDX-License-Identifier: Apache-2.0
// Feeds every seed to its fuzz target: all past findings stay found. Then feeds damaged seeds. Without a
// sanitizer, operator new counts the memory that the targets bound.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <new>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "damage.h"
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

/// The bytes that a target reads now. Where it ends the process, they are kept.
std::vector<uint8_t> current;

void keep_current(int signal) {
    constexpr const char* kPath = "finding";
    const int file = open(kPath, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    if (write(file, current.data(), current.size()) >= 0)
        std::fprintf(stderr, "its input is in the file %s\n", kPath);
    std::signal(signal, SIG_DFL);
    std::raise(signal);
}

long long peak_kilobytes() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss;
}

/// A few for every change; EWA_TEST_DAMAGED has another number.
TEST_P(Seeds, AreReadOrRefusedDamaged) {
    const auto& [name, target] = kTargets[GetParam()];
    const char* wanted = std::getenv("EWA_TEST_DAMAGED");
    constexpr int kUsually = 300;
    const int runs = wanted ? std::atoi(wanted) : kUsually;
    std::vector<std::string> seeds;
    for (const fs::path& file : seeds_of(name)) {
        const std::vector<uint8_t> bytes = bytes_of(file);
        seeds.emplace_back(bytes.begin(), bytes.end());
    }
    std::sort(seeds.begin(), seeds.end());
    for (const int signal : {SIGABRT, SIGSEGV, SIGFPE, SIGBUS}) std::signal(signal, keep_current);
    const long long before = peak_kilobytes();
    for (int run = 0; run < runs; ++run) {
        SCOPED_TRACE(run);
        const std::string damaged =
            ewa::fuzz::Damage(uint32_t(run))
                .of(seeds[size_t(run) % seeds.size()], seeds[size_t(run) * 7 / 3 % seeds.size()]);
        current.assign(damaged.begin(), damaged.end());
        ASSERT_EQ(target(current.data(), current.size()), 0);
    }
    // Also of what C libraries allocate. The seeds are small.
    EXPECT_LT(peak_kilobytes() - before, 300'000);
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
