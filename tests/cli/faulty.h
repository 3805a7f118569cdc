// SPDX-License-Identifier: Apache-2.0
// Circumstances in which the program meets a fault (faults/faults.cpp), or stands still while something
// happens.
#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <utility>

#include "cli/program.h"

namespace ewa::test {

inline Circumstances with_fault(const std::string& variable, const std::string& value) {
    Circumstances circumstances;
    circumstances.environment = {{"LD_PRELOAD", EWA_FAULTS_LIBRARY}, {variable, value}};
    return circumstances;
}

/// The program stands still before its `submission`-th work for the device, with the file `held` as the sign
/// of it, until it has got `signal`, where that is not 0, and `meanwhile` has happened: no test has to hope
/// for the moment.
inline Circumstances held_at(
    int submission, const std::string& held, int signal, std::function<void()> meanwhile = [] {}) {
    Circumstances circumstances = with_fault("EWA_FAULT_HOLD", std::to_string(submission) + ":" + held);
    circumstances.await_file = held;
    circumstances.signal = signal;
    circumstances.then = [held, meanwhile = std::move(meanwhile)] {
        meanwhile();
        std::filesystem::remove(held);
    };
    return circumstances;
}

}  // namespace ewa::test
