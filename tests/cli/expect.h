// SPDX-License-Identifier: Apache-2.0
// What every failure of the program looks like.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "cli/program.h"

namespace ewa::test {

/// The exit status, and one line on standard error that begins with the program's name and holds `text`.
inline void expect_failure(const Outcome& outcome, int status, const std::string& text) {
    EXPECT_EQ(outcome.status, status) << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_EQ(outcome.err.rfind("ewa", 0), 0u) << outcome.err;
    EXPECT_NE(outcome.err.find(text), std::string::npos) << "'" << text << "' is not in: " << outcome.err;
}

inline void expect_success(const Outcome& outcome) {
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
}

}  // namespace ewa::test
