// SPDX-License-Identifier: Apache-2.0
// Shared libraries that are loaded while the program runs.
#pragma once
#include <filesystem>
#include <string>
#include <system_error>

namespace ewa::platform {

/// A shared library. It stays loaded until the process ends, because threads and destructors of it run until then.
class Library {
  public:
    /// Loads the library. A name without folders is looked up where the system has its libraries.
    explicit Library(const std::filesystem::path& file);

    explicit operator bool() const { return handle_ != nullptr; }
    /// Returns the address of a function or variable that the library exports. Null if there is none.
    void* find(const char* name);
    /// The system's reason why the constructor or the last find() failed.
    const std::string& error() const { return error_; }

  private:
    void* handle_ = nullptr;
    std::string error_;
};

/// What the names of shared libraries end with here: ".so" or ".dll".
extern const char* const kLibrarySuffix;

/// The file of the system's Vulkan loader.
extern const char* const kVulkanLoader;

/// The file of the program that runs. Linux: without symbolic links, and without /proc, which a bare chroot does not have.
std::filesystem::path own_program(std::error_code& error);

/// The shared library that contains this module, or else the program. Linux: without symbolic links.
std::filesystem::path own_file(std::error_code& error);

}  // namespace ewa::platform
