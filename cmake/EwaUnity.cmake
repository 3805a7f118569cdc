# SPDX-License-Identifier: Apache-2.0
# With EWA_UNITY, a target's files are compiled several at a time: what they include takes longer than what they hold.
# ewa_compile_together(TARGET [APART FILE...])
# Neighbours in the list, the parsers of two formats, say, have one name for two things: each goes into another group. The
# files that find no group without such a namesake, and those with options of their own, are compiled APART.
function(ewa_compile_together target)
    if(NOT EWA_UNITY)
        return()
    endif()
    cmake_parse_arguments(together "" "" APART ${ARGN})
    get_target_property(sources ${target} SOURCES)
    foreach(apart ${together_APART})
        list(FILTER sources EXCLUDE REGEX "(^|/)${apart}$")
    endforeach()
    list(LENGTH sources count)
    math(EXPR groups "(${count} + 6) / 7")
    set(group 0)
    foreach(source ${sources})
        set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${target}_${group})
        math(EXPR group "(${group} + 1) % ${groups}")
    endforeach()
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
endfunction()
