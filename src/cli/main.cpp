// SPDX-License-Identifier: Apache-2.0
#include "cli/program.h"
#include "core/terminal.h"

int main(int argc, char** argv) {
    ewa::core::open_standard_streams();
    return ewa::cli::run_program(argc, argv);
}
