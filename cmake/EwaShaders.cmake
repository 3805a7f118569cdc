# SPDX-License-Identifier: Apache-2.0
# Compiles shaders/passes/*.comp to SPIR-V and embeds every module in one library. Each shader is compiled twice, with
# texel buffers and with storage buffers in their place (shaders/lib/fetch.glsl).
# Where lenses are most of a shader, there is a third and fourth build for pinholes. spirv-opt takes out what they never reach, and
# leaves the rest as it is: a driver reads such a module three times as fast.
# A CPU's driver compiles in each process again. So spirv-opt also inlines functions, and unrolls loops and resolves variables, in
# modules with texel buffers whose results stay the same to the bit (KernelChoices.ChangeNoByteOfAFrame).
# One shader that does not compile fails the build; a changed include rebuilds what includes it (depfiles).
find_program(GLSLANG glslangValidator REQUIRED)
find_program(SPIRV_OPT spirv-opt REQUIRED)
set(ewa_pinhole_shaders project project_views project_views_backward update update_views)
set(ewa_optimised_shaders blend blend_backward loss_backward_columns loss_backward_rows loss_columns loss_rows radix_scatter)
set(ewa_resolving_passes --eliminate-local-single-block --eliminate-local-single-store --ssa-rewrite --ccp
    --eliminate-dead-branches --merge-blocks --eliminate-dead-code-aggressive)
set(ewa_inlining_passes --eliminate-dead-branches --merge-blocks --merge-return --inline-entry-points-exhaustive
    --eliminate-dead-functions --private-to-local ${ewa_resolving_passes})
set(ewa_splitting_passes --scalar-replacement=100 --convert-local-access-chains ${ewa_resolving_passes})
set(ewa_optimising_passes ${ewa_inlining_passes} --loop-unroll ${ewa_splitting_passes} ${ewa_splitting_passes})
set(ewa_pinhole_passes --eliminate-dead-branches --merge-blocks --eliminate-dead-functions)

# Adds a build of the shader `name` with `fetches`, from which spirv-opt makes another module.
function(ewa_add_module name fetches kind define)
    set(module ${ewa_spirv_dir}/${name}.${fetches}.${kind}.spv)
    add_custom_command(
        OUTPUT ${module} ${module}.h # the depfile names the first
        COMMAND ${CMAKE_COMMAND} -E make_directory ${ewa_spirv_dir}
        COMMAND ${GLSLANG} --quiet --target-env vulkan1.2 -I${PROJECT_SOURCE_DIR}/shaders ${define}
                --depfile ${module}.d -V -o ${module} ${shader}
        COMMAND ${SPIRV_OPT} --target-env=vulkan1.2 --scalar-block-layout --preserve-bindings ${ARGN} ${module} -o ${module}
        COMMAND ${CMAKE_COMMAND} -DMODULE=${module} -DNAME=${name}_${fetches}_${kind} -DOUT=${module}.h
                -P ${PROJECT_SOURCE_DIR}/cmake/embed_module.cmake
        DEPENDS ${shader} ${PROJECT_SOURCE_DIR}/cmake/embed_module.cmake
        DEPFILE ${module}.d
        COMMENT "Compiling shader ${name} (${fetches}, ${kind})" VERBATIM)
    set(ewa_spirv ${ewa_spirv} ${module}.h PARENT_SCOPE)
    set(ewa_shader_declarations "${ewa_shader_declarations}#include \"${name}.${fetches}.${kind}.spv.h\"\n" PARENT_SCOPE)
endfunction()

file(GLOB ewa_shaders CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/shaders/passes/*.comp)
set(ewa_spirv_dir ${PROJECT_BINARY_DIR}/shaders)
set(ewa_spirv "")
set(ewa_shader_declarations "")
set(ewa_shader_table "")
foreach(shader ${ewa_shaders})
    cmake_path(GET shader STEM name)
    foreach(fetches texels storage)
        set(header ${ewa_spirv_dir}/${name}.${fetches}.spv.h)
        set(define "")
        if("${fetches}" STREQUAL "texels")
            set(define -DEWA_TEXEL_BUFFERS)
        endif()
        add_custom_command(
            OUTPUT ${header}
            COMMAND ${CMAKE_COMMAND} -E make_directory ${ewa_spirv_dir}
            COMMAND ${GLSLANG} --quiet --target-env vulkan1.2 -I${PROJECT_SOURCE_DIR}/shaders ${define}
                    --depfile ${header}.d --vn ${name}_${fetches} -o ${header} ${shader}
            DEPENDS ${shader}
            DEPFILE ${header}.d
            COMMENT "Compiling shader ${name} (${fetches})" VERBATIM)
        if(name IN_LIST ewa_pinhole_shaders)
            set(passes ${ewa_pinhole_passes})
            if("${name}.${fetches}" STREQUAL "project.texels")
                set(passes ${ewa_inlining_passes})
            endif()
            ewa_add_module(${name} ${fetches} pinhole "${define};-DEWA_PINHOLE" ${passes})
        endif()
        if(name IN_LIST ewa_optimised_shaders AND "${fetches}" STREQUAL "texels")
            ewa_add_module(${name} ${fetches} optimised "${define}" ${ewa_optimising_passes})
        endif()
        list(APPEND ewa_spirv ${header})
        string(APPEND ewa_shader_declarations "#include \"${name}.${fetches}.spv.h\"\n")
    endforeach()
    set(others "{}, {}, {}")
    if(name IN_LIST ewa_pinhole_shaders)
        set(others "{}, ${name}_texels_pinhole, ${name}_storage_pinhole")
    elseif(name IN_LIST ewa_optimised_shaders)
        set(others "${name}_texels_optimised, {}, {}")
    endif()
    string(APPEND ewa_shader_table "    {\"${name}\", ${name}_texels, ${name}_storage, ${others}},\n")
endforeach()

set(ewa_shader_table_cpp ${ewa_spirv_dir}/shader_table.cpp)
file(CONFIGURE OUTPUT ${ewa_shader_table_cpp} @ONLY CONTENT [[
// Generated by cmake/EwaShaders.cmake.
#include "passes/shader_code.h"

#include <cstdint>
#include <stdexcept>
namespace {
@ewa_shader_declarations@
struct Entry {
    std::string_view name;
    std::span<const std::uint32_t> texels, storage, optimised, pinhole_texels, pinhole_storage;
};
const Entry table[] = {
@ewa_shader_table@};
}  // namespace

std::span<const std::uint32_t> ewa::passes::shader_code(std::string_view name, bool texel_buffers) {
    for (const Entry& entry : table)
        if (entry.name == name) return texel_buffers ? entry.texels : entry.storage;
    throw std::logic_error("no shader of the name " + std::string(name));
}
std::span<const std::uint32_t> ewa::passes::optimised_code(std::string_view name) {
    for (const Entry& entry : table)
        if (entry.name == name) return entry.optimised;
    return {};
}
std::span<const std::uint32_t> ewa::passes::pinhole_code(std::string_view name, bool texel_buffers) {
    for (const Entry& entry : table)
        if (entry.name == name) return texel_buffers ? entry.pinhole_texels : entry.pinhole_storage;
    return {};
}
std::vector<std::string_view> ewa::passes::shader_names() {
    std::vector<std::string_view> names;
    for (const Entry& entry : table) names.push_back(entry.name);
    return names;
}
]])
if(ewa_shaders)
    add_library(ewa_shader_code STATIC ${ewa_shader_table_cpp} ${ewa_spirv})
    target_include_directories(ewa_shader_code PRIVATE ${ewa_spirv_dir} ${PROJECT_SOURCE_DIR}/src)
    target_link_libraries(ewa_shader_code PUBLIC ewa_compiler)
    set_target_properties(ewa_shader_code PROPERTIES POSITION_INDEPENDENT_CODE ON)
endif()
