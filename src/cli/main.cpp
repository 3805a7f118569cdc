// SPDX-License-Identifier: Apache-2.0
#include "cli/program.h"
#include "core/messages.h"
#include "platform/terminal.h"

int main(int argc, char** argv) {
    ewa::platform::begin_program(argc, argv);
    ewa::core::print_warnings();
    return ewa::cli::run_program(argc, argv);
}
