// SPDX-License-Identifier: Apache-2.0
#include "cli/status.h"

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <new>

#include "cli/interrupt.h"
#include "core/text.h"
#include "ewa/error.h"

namespace ewa::cli {

int fail(const std::string& who, const std::string& what, int status) {
    std::fflush(stdout);
    std::fprintf(stderr, "%s: %s\n", who.c_str(), core::one_line(what).c_str());
    return status;
}

int fail_to_print(const std::string& who) {
    return fail(who, std::string("cannot write to standard output: ") + std::strerror(errno), kFailed);
}

int status_of(const std::string& who, const Action& action) {
    int status = kDone;
    try {
        status = action();
    } catch (const Interrupted&) {
        status = kInterruptedStatus;
    } catch (const InputError& error) {
        return fail(who, error.what(), kWrongUse);
    } catch (const CLI::Error& error) {  // an invalid value in --config
        return fail(who, error.what(), kWrongUse);
    } catch (const RunError& error) {
        return fail(who, error.what(), kFailed);
    } catch (const std::bad_alloc&) {
        return fail(who, "out of host memory; try a smaller scene, or --downscale where the command has it",
                    kFailed);
    } catch (const std::exception& error) {
        return fail(who, std::string("unexpected failure: ") + error.what(), kFailed);
    }
    // If output is redirected to a full disk, only this flush fails.
    if (std::fflush(stdout) != 0) return fail_to_print(who);
    if (std::ferror(stdout)) return fail(who, "cannot write all of standard output", kFailed);
    return status;
}

}  // namespace ewa::cli
