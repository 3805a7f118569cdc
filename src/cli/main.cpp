// SPDX-License-Identifier: Apache-2.0
#include "cli/program.h"
#include "core/messages.h"
#include "core/terminal.h"

int main(int argc, char** argv) {
    ewa::core::open_standard_streams();
    ewa::core::print_warnings();
    return ewa::cli::run_program(argc, argv);
}
