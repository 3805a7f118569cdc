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
#include "structure.h"
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

/// Feeds `usually` changed seeds to the target, or a share of EWA_TEST_DAMAGED. change(seed, bytes, other): what becomes of bytes.
template <class Change>
void feed(size_t index, int usually, int share, const Change& change) {
    const auto& [name, target] = kTargets[index];
    const char* wanted = std::getenv("EWA_TEST_DAMAGED");
    const int runs = wanted ? std::atoi(wanted) / share : usually;
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
        const std::string changed = change(uint32_t(run), seeds[size_t(run) % seeds.size()],
                                           seeds[size_t(run) * 7 / 3 % seeds.size()]);
        current.assign(changed.begin(), changed.end());
        ASSERT_EQ(target(current.data(), current.size()), 0);
    }
    // Also of what C libraries allocate. The seeds are small.
    EXPECT_LT(peak_kilobytes() - before, 300'000);
}

/// A few for every change; EWA_TEST_DAMAGED has another number.
TEST_P(Seeds, AreReadOrRefusedDamaged) {
    feed(GetParam(), 300, 1, [](uint32_t seed, const std::string& bytes, const std::string& other) {
        return ewa::fuzz::Damage(seed).of(bytes, other);
    });
}

/// A fifth of that number has another structure.
TEST_P(Seeds, AreReadOrRefusedWithDamagedStructure) {
    feed(GetParam(), 100, 5, [](uint32_t seed, const std::string& bytes, const std::string& other) {
        return ewa::fuzz::Structure(seed).of(bytes, other);
    });
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
