// SPDX-License-Identifier: Apache-2.0
// Errors of libewa as Python's.
#pragma once
#include <nanobind/nanobind.h>

#include <filesystem>
#include <string>

#include "ewa/error.h"

namespace ewa::python {

/// A text of libewa with the names of Python's arguments: ewa._errors.spelled. Needs the interpreter.
std::string spelled(const char* text);

/// Issues a Python warning. Throws python_error if it is to be an error.
void warn(PyObject* category, const std::string& text);

/// Calls work without the interpreter. Its RunError, which is of the disk, becomes OSError.
template <class Work>
auto with_files(const Work& work) {
    try {
        const nanobind::gil_scoped_release released;
        return work();
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
