# SPDX-License-Identifier: Apache-2.0
# What every translation unit is compiled with.
add_library(ewa_compiler INTERFACE)
target_compile_features(ewa_compiler INTERFACE cxx_std_20)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
target_compile_options(ewa_compiler INTERFACE -Wall -Wextra -Werror -Wshadow -Wnon-virtual-dtor
    # The float64 twin and the host must round as written: no fused multiply-add behind the formulas.
    -ffp-contract=off
    # GCC 12's SLP vectoriser takes double(float(x)) for x at -O3: the low half of a split double came out zero
    # (CameraBlock.PairsOfFloatsHoldTheDoubles).
    $<$<CXX_COMPILER_ID:GNU>:-fno-tree-slp-vectorize>)
target_compile_definitions(ewa_compiler INTERFACE EWA_VERSION="${PROJECT_VERSION}")
if(EWA_SANITIZE)
    target_compile_options(ewa_compiler INTERFACE -fsanitize=address,undefined -fno-omit-frame-pointer)
    target_link_options(ewa_compiler INTERFACE -fsanitize=address,undefined)
endif()
if(EWA_COVERAGE)
    # Counters by thread would lose what they count together.
    target_compile_options(ewa_compiler INTERFACE --coverage -fprofile-update=atomic)
    target_link_options(ewa_compiler INTERFACE --coverage)
endif()
if(EWA_FUZZ)
    target_compile_options(ewa_compiler INTERFACE -fsanitize=address,undefined,fuzzer-no-link -fno-omit-frame-pointer
                                                  -fno-sanitize-recover=all)
    target_link_options(ewa_compiler INTERFACE -fsanitize=address,undefined)
endif()
find_program(CCACHE ccache)
if(CCACHE)
    set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
endif()
