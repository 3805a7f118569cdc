// SPDX-License-Identifier: Apache-2.0
// Errors of libewa as Python's.
#pragma once
#include <nanobind/nanobind.h>

#include <filesystem>
#include <string>
#include <type_traits>

#include "ewa/error.h"

namespace ewa::python {

/// A text of libewa with the names of Python's arguments: ewa._errors.spelled. Needs the interpreter.
std::string spelled(const char* text);

/// Issues a Python warning. Throws python_error if it is to be an error.
void warn(PyObject* category, const std::string& text);

/// Keeps what libewa says (ewa/log.h) for say_log.
void keep_log();
/// Issues as Python's warnings what libewa has said since. Its threads may say it where the interpreter is not free, and where nothing
/// may throw. Throws python_error if a warning is to be an error.
void say_log();

/// Calls work without the interpreter. Then says what it had to say. Its RunError, which is of the disk, becomes OSError.
template <class Work>
auto with_files(const Work& work) {
    const auto run = [&] {
        const nanobind::gil_scoped_release released;
        return work();
    };
    try {
        if constexpr (std::is_void_v<decltype(work())>) {
            run();
            say_log();
        } else {
            auto result = run();
            say_log();
            return result;
        }
    } catch (const RunError& error) {
        PyErr_SetString(PyExc_OSError, spelled(error.what()).c_str());
        throw nanobind::python_error();
    }
}

/// Creates the folder that a file will be in. Throws RunError.
void make_folder_of(const std::filesystem::path& file);

/// with_files, for work that writes a file whose folder may be missing.
template <class Work>
auto with_new_file(const std::filesystem::path& path, const Work& work) {
    return with_files([&] {
        make_folder_of(path);
        return work();
    });
}

}  // namespace ewa::python
