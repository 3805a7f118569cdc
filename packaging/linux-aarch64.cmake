# SPDX-License-Identifier: Apache-2.0
set(EWA_TARGET linux-aarch64)
include(${CMAKE_CURRENT_LIST_DIR}/targets.cmake)
