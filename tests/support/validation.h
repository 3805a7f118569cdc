// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdlib>
#include <string_view>

namespace ewa::test {

/// Whether the tests listen to the validation layer. EWA_TEST_VALIDATION=off: no, as for Wine, whose Vulkan has no layers.
inline bool with_validation() {
    const char* wanted = std::getenv("EWA_TEST_VALIDATION");
    return !wanted || std::string_view(wanted) != "off";
}

}  // namespace ewa::test
