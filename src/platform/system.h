// SPDX-License-Identifier: Apache-2.0
// What the machine has, and what it lets this process use.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace ewa::platform {

/// The bytes of address space that this process may use (ulimit -v), and of address space or private memory (also ulimit -d),
/// whichever is less. UINT64_MAX without a limit. Windows: the limit of memory of the process's job, for both.
uint64_t address_limit();
uint64_t memory_limit();

/// Address space that is taken until the object ends.
class Reservation {
  public:
    explicit Reservation(uint64_t bytes);
    ~Reservation();
    Reservation(const Reservation&) = delete;
    Reservation& operator=(const Reservation&) = delete;
    explicit operator bool() const { return place_ != nullptr; }  // whether there was room

  private:
    void* place_ = nullptr;
    uint64_t bytes_;
};

/// The bytes of memory that the machine has.
uint64_t installed_memory();
/// The bytes that new work could take. Empty where the system does not say.
std::optional<uint64_t> free_memory();
/// The most bytes of memory that this process has used so far.
uint64_t peak_memory();

/// A text that tells this machine from others. Containers on one machine have names of their own, but share it.
std::string machine_name();

/// The text of the file os-release, which says what system this is (os-release(5)). Windows has none: "ID=windows".
std::string system_release();

/// A bit for each processor that this process may use; `words` numbers of 64. Windows: the 64 of the process's group.
std::vector<uint64_t> usable_cores(size_t words);

/// Fills the bytes with random numbers for secrets. False if the system gives none.
bool random_bytes(void* bytes, size_t size);

/// The value of an environment variable, in UTF-8. Empty if it is not set, or empty.
std::string variable(const char* name);
/// Sets an environment variable, or one that is not set, for libraries and for programs that are started.
void set_variable(const char* name, const std::string& value);
void set_if_absent(const char* name, const std::string& value);

}  // namespace ewa::platform
