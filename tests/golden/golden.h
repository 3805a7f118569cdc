// SPDX-License-Identifier: Apache-2.0
// Pictures under test against references that are kept in tests/golden/references.
//
// References are 16-bit PNGs of what the float64 CPU reference, or a formula in the test, says; never of what the code
// under test made. scripts/golden-accept writes new ones. What fails leaves candidate, reference and
// difference in build/release/golden, and index.html there shows them side by side.
#pragma once
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <string>

#include "ewa/image.h"

namespace ewa::test {

/// A candidate passes where no value is further from the reference than max_error, and at most `over` pixels
/// have one that is further than `typical`. Both include the reference's rounding, 8e-6.
struct Tolerance {
    double max_error = 0;
    double typical = 0;
    uint64_t over = 0;  // px
};

/// The source tree: $EWA_TEST_SOURCE, for tests that run on another machine, or where the tests were built from.
std::filesystem::path source_folder();

struct GoldenFolders {
    GoldenFolders();  // those of the source tree and the build folder
    GoldenFolders(std::filesystem::path references_, std::filesystem::path failures_)
        : references(std::move(references_)), failures(std::move(failures_)) {}

    std::filesystem::path references, failures;
};

/// values in [0, 1], RGB or one channel. maker: who made the candidate, e.g. the device's name.
testing::AssertionResult matches_golden(const std::string& name, const Image& candidate,
                                        const Tolerance& tolerance, const std::string& maker,
                                        const GoldenFolders& folders = {});

/// The reference is what `truth` rounds to. With EWA_GOLDEN_ACCEPT in the environment it becomes so.
testing::AssertionResult is_reference(const std::string& name, const Image& truth,
                                      const GoldenFolders& folders = {});

}  // namespace ewa::test
