# SPDX-License-Identifier: Apache-2.0
set(EWA_TARGET linux-aarch64)
include(${CMAKE_CURRENT_LIST_DIR}/targets.cmake)
# Those of this machine know no other processor.
foreach(tool ar ranlib strip objdump)
    string(TOUPPER ${tool} variable)
    set(CMAKE_${variable} /usr/bin/aarch64-linux-gnu-${tool})
endforeach()
