// SPDX-License-Identifier: Apache-2.0
// ewa-bench: the benchmark as a program of its own, for a machine that has only a Vulkan device.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <new>

#include "bench/bench.h"
#include "core/exclusion.h"
#include "core/text.h"
#include "ewa/error.h"
#include "platform/terminal.h"

namespace {

int fail(const std::string& what, int status) {
    std::fflush(stdout);
    std::fprintf(stderr, "ewa-bench: %s\n", ewa::core::one_line(what).c_str());
    return status;
}

}  // namespace

int main(int argc, char** argv) {
    ewa::platform::begin_program(argc, argv);
    CLI::App app{
        "Measures the time of each pass of ewa on a Vulkan device, and its error against the CPU reference."};
    app.name("ewa-bench");
    app.allow_windows_style_options(false);  // paths may begin with a slash
    ewa::core::use_help_text<CLI::Formatter>(app);
    app.set_version_flag("--version", "ewa " EWA_VERSION);
    ewa::bench::Options options;
    ewa::bench::add_options(app, options);
    ewa::core::refuse_empty_values<CLI::Validator>(app);
    try {
        app.parse(argc, argv);
        const int status = ewa::bench::run(options);
        if (std::fflush(stdout) != 0) return fail("cannot write to standard output", 1);
        return status;
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) return app.exit(error);
        return fail(std::string(error.what()) + " (see ewa-bench --help)", 2);
    } catch (const ewa::InputError& error) {
        return fail(error.what(), 2);
    } catch (const std::bad_alloc&) {
        return fail("out of host memory", 1);
    } catch (const std::exception& error) {
        return fail(error.what(), 1);
    }
}
