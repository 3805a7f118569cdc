// SPDX-License-Identifier: Apache-2.0
// Files for tests, and what is expected of readers that meet broken ones.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <string>

#include "ewa/error.h"
#include "platform/process.h"

namespace ewa::test {

/// A folder of its own, removed with everything in it.
class TempFolder {
  public:
    TempFolder() {
        static std::atomic<int> counter{0};
        path_ = std::filesystem::temp_directory_path() /
                ("ewa-test-" + std::to_string(platform::process_id()) + "-" + std::to_string(counter++));
        std::filesystem::create_directories(path_);
    }
    ~TempFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    TempFolder(const TempFolder&) = delete;
    TempFolder& operator=(const TempFolder&) = delete;

    const std::filesystem::path& path() const { return path_; }
    std::filesystem::path operator/(const std::filesystem::path& name) const { return path_ / name; }

    std::filesystem::path write(const std::filesystem::path& name, const std::string& bytes) const {
        const std::filesystem::path path = path_ / name;
        std::filesystem::create_directories(path.parent_path());
        std::ofstream(path, std::ios::binary) << bytes;
        return path;
    }

  private:
    std::filesystem::path path_;
};

inline std::string file_bytes(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

inline size_t files_in(const std::filesystem::path& folder) {
    size_t count = 0;
    for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder)) ++count;
    return count;
}

/// The value's bytes, little endian.
template <class T>
std::string bytes_of(T value) {
    std::string bytes(sizeof(T), '\0');
    std::memcpy(bytes.data(), &value, sizeof(T));
    return bytes;
}

/// The text with the separators of paths that all systems but Windows write.
inline std::string with_slashes(std::string text) {
    std::replace(text.begin(), text.end(), '\\', '/');
    return text;
}

/// The action throws Error with a text of one line that holds every part.
template <class Error, class Action>
void expect_error(const Action& action, std::initializer_list<std::string> parts) {
    try {
        action();
        ADD_FAILURE() << "nothing was thrown; expected an error with \"" << *parts.begin() << "\"";
    } catch (const Error& error) {
        const std::string text = error.what();
        EXPECT_EQ(text.find('\n'), std::string::npos) << text;
        for (const std::string& part : parts)
            EXPECT_NE(with_slashes(text).find(with_slashes(part)), std::string::npos)
                << part << " not in: " << text;
    }
}

/// Cuts the file at `path`, which holds `bytes`, at every byte and reads it: each cut is read or is an
/// InputError, never anything else. Returns how many were read. The whole is put back.
inline size_t read_every_cut(const std::filesystem::path& path, const std::string& bytes,
                             const std::function<void()>& read) {
    size_t succeeded = 0;
    for (size_t n = bytes.size(); n-- > 0;) {
        std::filesystem::resize_file(path, n);
        try {
            read();
            ++succeeded;
        } catch (const InputError& error) {
            EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
        } catch (const std::exception& error) {
            ADD_FAILURE() << "cut at byte " << n << ": " << error.what();
        }
    }
    std::ofstream(path, std::ios::binary) << bytes;
    return succeeded;
}

/// The folder of real inputs, where there is one: $EWA_SHARED/data, or shared/data beside the source tree.
inline std::optional<std::filesystem::path> shared_data() {
    const char* variable = std::getenv("EWA_SHARED");
    const std::filesystem::path path = (variable ? std::filesystem::path(variable)
                                                 : std::filesystem::path(EWA_SOURCE_DIR) / ".." / "shared") /
                                       "data";
    if (!std::filesystem::is_directory(path)) return std::nullopt;
    return path;
}

}  // namespace ewa::test
