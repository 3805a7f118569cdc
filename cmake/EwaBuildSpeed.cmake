# SPDX-License-Identifier: Apache-2.0
# What files include takes longer to compile than what they hold. A unity build shares the includes between the files of a
# target: a whole build is fastest, a changed file compiles with its group. Without EWA_UNITY, precompiled headers hold the
# includes: one changed file compiles fastest. Both together gain little, and GCC 12 then gives false warnings in the tests.

# ewa_compile_together(TARGET [APART FILE...])
# Files of a group share one unnamed namespace, so a name stands for one thing within a target. Neighbours in the list, which
# resemble each other most, go into different groups. APART are the files with options of their own, and those that need a library
# which not every program of the target links.
function(ewa_compile_together target)
    if(NOT EWA_UNITY)
        return()
    endif()
    cmake_parse_arguments(together "" "" APART ${ARGN})
    get_target_property(sources ${target} SOURCES)
    foreach(apart ${together_APART})
        list(FILTER sources EXCLUDE REGEX "(^|/)${apart}$")
    endforeach()
    # A test file is mostly the includes that the group shares; a source file has more of its own.
    get_target_property(is_test ${target} EWA_IS_TEST)
    set(files_in_group 12)
    if(is_test)
        set(files_in_group 16)
    endif()
    list(LENGTH sources count)
    math(EXPR groups "(${count} + ${files_in_group} - 1) / ${files_in_group}")
    set(group 0)
    foreach(source ${sources})
        set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${target}_${group})
        math(EXPR group "(${group} + 1) % ${groups}")
    endforeach()
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
endfunction()

# ewa_compile_with(OPTION FILE...): compiles these files with OPTION where the build is optimised, without the target's
# precompiled header: GCC 12 crashes on one of another -O.
function(ewa_compile_with option)
    set_source_files_properties(${ARGN} PROPERTIES COMPILE_OPTIONS $<$<CONFIG:Release>:${option}>
                                                   SKIP_PRECOMPILE_HEADERS ON)
endfunction()

# ewa_precompile(OWNER HEADER... [FOR TARGET...]): OWNER and the targets share one precompiled header. All have the same
# compiler options.
function(ewa_precompile owner)
    if(EWA_UNITY)
        return()
    endif()
    cmake_parse_arguments(shared "" "" "FOR" ${ARGN})
    target_precompile_headers(${owner} PRIVATE ${shared_UNPARSED_ARGUMENTS} <algorithm> <array> <cmath> <cstdint> <filesystem>
                              <functional> <memory> <optional> <span> <string> <string_view> <vector>)
    foreach(target ${shared_FOR})
        target_precompile_headers(${target} REUSE_FROM ${owner})
    endforeach()
    # ccache wants to know of the precompiled header; GCC writes it into the preprocessed text.
    if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
        foreach(target ${owner} ${shared_FOR})
            target_compile_options(${target} PRIVATE -fpch-preprocess)
        endforeach()
    endif()
endfunction()
