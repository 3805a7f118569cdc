# SPDX-License-Identifier: Apache-2.0
# What every translation unit is compiled with.
# For continuous integration and developers. A newer compiler knows of more warnings, and whoever builds a release has it.
option(EWA_WERROR "Fail at a warning of the compiler" OFF)
add_library(ewa_compiler INTERFACE)
target_compile_features(ewa_compiler INTERFACE cxx_std_20)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
target_compile_options(ewa_compiler INTERFACE -Wall -Wextra $<$<BOOL:${EWA_WERROR}>:-Werror> -Wshadow -Wnon-virtual-dtor
    # The float64 CPU reference and the host must round as written: no fused multiply-add behind the formulas.
    -ffp-contract=off
    # GCC 12's SLP vectoriser takes double(float(x)) for x at -O3: the low half of a split double came out zero
    # (CameraBlock.PairsOfFloatsHoldTheDoubles).
    $<$<CXX_COMPILER_ID:GNU>:-fno-tree-slp-vectorize>)
if(EWA_UNITY)
    # GCC collects its garbage from 0.5 GB on: 7 to 10 % less time for 30 % more memory, 0.9 GB for the largest group.
    target_compile_options(ewa_compiler INTERFACE "$<$<CXX_COMPILER_ID:GNU>:SHELL:--param ggc-min-heapsize=500000>")
endif()
target_compile_definitions(ewa_compiler INTERFACE EWA_VERSION="${PROJECT_VERSION}")
# Optimising costs much of the time of these targets' compilation and gains little when they run: the tests' own code, and
# targets whose property EWA_COLD says that no loop over splats or pixels is in them. Tests that compute
# little themselves (EWA_WAITS) are not optimised at all.
set(ewa_is_test $<BOOL:$<TARGET_PROPERTY:EWA_IS_TEST>>)
set(ewa_is_cold $<BOOL:$<TARGET_PROPERTY:EWA_COLD>>)
set(ewa_waits $<BOOL:$<TARGET_PROPERTY:EWA_WAITS>>)
target_compile_options(ewa_compiler INTERFACE
    $<$<AND:$<CONFIG:Release>,$<OR:${ewa_is_test},${ewa_is_cold}>>:$<IF:${ewa_waits},-O0,-O1>>)
if(NOT EWA_SANITIZE AND NOT EWA_COVERAGE AND NOT EWA_FUZZ)
    # Targets with EWA_READS read what strangers sent: there, an overrun that no check found ends the program. The loops that
    # record and wait for a training step are in other targets. A distribution may define the macro itself.
    set(ewa_hardened $<AND:$<CONFIG:Release>,$<BOOL:$<TARGET_PROPERTY:EWA_READS>>>)
    target_compile_options(ewa_compiler INTERFACE
        "$<${ewa_hardened}:-U_FORTIFY_SOURCE;-D_FORTIFY_SOURCE=2;-fstack-protector-strong>")
    # Functions of libraries are bound at the start, and their table is read-only from then on.
    add_link_options($<$<AND:$<CONFIG:Release>,$<NOT:$<PLATFORM_ID:Windows>>>:-Wl,-z,relro,-z,now>)
endif()
if(EWA_SANITIZE)
    # The tests too: if a test and a module both have an inline function, the linker takes the test's.
    target_compile_options(ewa_compiler INTERFACE -fsanitize=address,undefined -fno-omit-frame-pointer)
    target_link_options(ewa_compiler INTERFACE -fsanitize=address,undefined)
endif()
if(EWA_COVERAGE)
    # Threads that run one line at the same time lose counts, unless the counters are atomic. Atomic counters slow short loops
    # down most. Modules of short loops have plain counters, which still tell whether a line ran.
    set(ewa_update $<IF:$<BOOL:$<TARGET_PROPERTY:EWA_PLAIN_COUNTERS>>,single,atomic>)
    target_compile_options(ewa_compiler INTERFACE "$<$<NOT:${ewa_is_test}>:--coverage;-fprofile-update=${ewa_update}>")
    target_link_options(ewa_compiler INTERFACE --coverage)
endif()
if(EWA_FUZZ)
    target_compile_options(ewa_compiler INTERFACE -fsanitize=address,undefined,fuzzer-no-link -fno-omit-frame-pointer
                                                  -fno-sanitize-recover=all)
    target_link_options(ewa_compiler INTERFACE -fsanitize=address,undefined)
endif()
find_program(CCACHE ccache)
if(CCACHE)
    # Without the first it would not cache what a precompiled header takes part in. The others let clones in other folders share.
    set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros
                                    CCACHE_BASEDIR=${PROJECT_SOURCE_DIR} CCACHE_NOHASHDIR=1 ${CCACHE})
endif()
