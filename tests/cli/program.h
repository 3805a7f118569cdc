// SPDX-License-Identifier: Apache-2.0
// Runs the built program as a process, and makes small inputs for it.
#pragma once
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "support/temp_folder.h"

namespace ewa::test {

struct Outcome {
    int status = -1;  // exit status; 128 + the signal that ended it
    std::string out, err;
};

struct Circumstances {
    std::string program = {};         // runs instead of ewa
    std::string out_path = {};        // standard output goes here instead of Outcome::out
    std::string err_path = {};        // likewise Outcome::err
    bool nohup = false;               // SIGHUP is ignored when the program starts
    size_t file_limit = 0;            // bytes that no file may exceed, as on a full disk; 0: none
    size_t address_limit = 0;         // bytes of address space; 0: no limit
    std::string await_file = {};      // as soon as this file has a byte, `signal` is sent
    int signal = 0;                   // 0: none
    int times = 1;                    // that it is sent, each time after the one before has been taken
    std::function<void()> then = {};  // called in the place of sending a signal, or after it
    std::vector<std::pair<std::string, std::string>> environment = {};
};

/// $EWA_TESTED_PROGRAM runs in the place of the build's ewa, such as a script that starts a program for Windows.
Outcome run_ewa(const std::vector<std::string>& arguments, const Circumstances& circumstances = {});

/// A folder of its own, removed at the end; its paths as text, which arguments are.
class Folder {
  public:
    std::string operator/(const std::string& name) const { return (folder_ / name).string(); }

  private:
    TempFolder folder_;
};

/// Pictures of a coloured disc from a circle of cameras: folder/transforms.json and folder/images/<name>.
void make_dataset(const std::string& folder,
                  const std::vector<std::string>& names = {"0.png", "1.png", "2.png", "3.png"});

/// Splats in a ball at the origin.
void make_splats(const std::string& path, int count = 50, int sh_degree = 1);

void write_file(const std::string& path, const std::string& bytes);
std::string read_file(const std::string& path);
nlohmann::json read_json(const std::string& path);

/// Names of the files below a folder, sorted, with their folders.
std::vector<std::string> files_below(const std::string& folder);

}  // namespace ewa::test
