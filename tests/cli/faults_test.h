// SPDX-License-Identifier: Apache-2.0
// A small dataset to train on, and what holds of a training that has met a fault.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "cli/expect.h"
#include "cli/faulty.h"

namespace ewa::test {

using Names = std::vector<std::string>;

class FaultsTest : public testing::Test {
  protected:
    void SetUp() override {
        make_dataset(folder / "data");
        make_splats(folder / "s.ply");
    }
    Outcome train(const std::string& out, const Names& more = {}, const Circumstances& circumstances = {}) {
        Names arguments{"train",  folder / "data",  "-o",      folder / out,
                        "--init", folder / "s.ply", "--quiet", "--resume"};
        const Names defaults{"--steps", "60", "--seed", "4", "--strategy", "none", "--save-every", "5"};
        for (size_t i = 0; i < defaults.size(); i += 2)
            if (std::find(more.begin(), more.end(), defaults[i]) == more.end())
                arguments.insert(arguments.end(), {defaults[i], defaults[i + 1]});
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_ewa(arguments, circumstances);
    }
    /// Nothing that was half written.
    void expect_no_traces(const std::string& name) {
        for (const std::string& file : files_below(folder / name))
            EXPECT_EQ(file.find(".tmp"), std::string::npos) << file;
    }
    /// Once the fault is gone the run goes on, and ends as one that met none.
    void expect_goes_on(const std::string& out, const Names& more = {}) {
        expect_success(train(out, more));
        if (!std::filesystem::exists(folder / "whole")) expect_success(train("whole", more));
        EXPECT_EQ(read_file(folder / (out + "/splats.ply")), read_file(folder / "whole/splats.ply"));
        EXPECT_EQ(files_below(folder / out), files_below(folder / "whole"));
    }
    Folder folder;
};

}  // namespace ewa::test
