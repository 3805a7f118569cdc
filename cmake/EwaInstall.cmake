# SPDX-License-Identifier: Apache-2.0
# What `cmake --install` puts where, and the package that find_package(ewa) reads.
include(CMakePackageConfigHelpers)

# A umask can only take permissions away. Programs load a module from one of these folders.
set(CMAKE_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE
                                                WORLD_READ WORLD_EXECUTE)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS ${CMAKE_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS})

# libewa: the modules below the command line and the viewer, in one shared object. A program that links it needs none of the
# libraries behind it. ewa's own programs link the modules themselves and run without it.
set(ewa_library_modules platform core image scene folders io capture gpu passes pipeline operators pathtracer report ranks portions prepare train run)
set(ewa_objects $<TARGET_OBJECTS:ewa_shader_code> $<TARGET_OBJECTS:ewa_page>)
foreach(module ${ewa_library_modules})
    if(TARGET ewa_${module})
        list(APPEND ewa_objects $<TARGET_OBJECTS:ewa_${module}>)
    endif()
endforeach()
add_library(ewa_library SHARED ${ewa_objects})
set_target_properties(ewa_library PROPERTIES OUTPUT_NAME ewa EXPORT_NAME ewa LINKER_LANGUAGE CXX
    VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}
    LINK_DEPENDS ${PROJECT_SOURCE_DIR}/cmake/libewa.map)
target_link_options(ewa_library PRIVATE -Wl,--version-script=${PROJECT_SOURCE_DIR}/cmake/libewa.map -Wl,--as-needed
                                        -Wl,--no-undefined)
target_link_libraries(ewa_library PRIVATE PNG::PNG JPEG::JPEG spdlog::spdlog ZLIB::ZLIB zstd::libzstd_shared
                                          PkgConfig::WEBP PkgConfig::MINIZIP pugixml::pugixml SQLite::SQLite3
                                          ${ewa_system_libraries})
target_compile_features(ewa_library INTERFACE cxx_std_20)
target_include_directories(ewa_library INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
if(EWA_SANITIZE)
    target_link_options(ewa_library PRIVATE -fsanitize=address,undefined)
endif()
if(EWA_COVERAGE)
    target_link_options(ewa_library PRIVATE --coverage)
endif()

# Manual pages and shell completions, made from what the programs' --help says.
find_program(HELP2MAN help2man)
if(NOT HELP2MAN)
    message(STATUS "There is no help2man: manual pages are not built")
    set(HELP2MAN "")
endif()
set(ewa_manual_folder ${PROJECT_BINARY_DIR}/manual)
set(ewa_manual_stamps "")
foreach(program ewa ewa-view)
    if(TARGET ${program} AND NOT CMAKE_CROSSCOMPILING) # they are the same for every system
        add_custom_command(OUTPUT ${PROJECT_BINARY_DIR}/${program}.manual
            COMMAND ${PROJECT_SOURCE_DIR}/cmake/write-manual $<TARGET_FILE:${program}> ${ewa_manual_folder} ${HELP2MAN}
            COMMAND ${CMAKE_COMMAND} -E touch ${PROJECT_BINARY_DIR}/${program}.manual
            DEPENDS ${program} ${PROJECT_SOURCE_DIR}/cmake/write-manual ${PROJECT_SOURCE_DIR}/cmake/completion.awk
                    ${PROJECT_SOURCE_DIR}/cmake/manual.h2m ${PROJECT_SOURCE_DIR}/cmake/manual_commands.h2m
            WORKING_DIRECTORY ${PROJECT_SOURCE_DIR} COMMENT "Writing the manual of ${program}" VERBATIM)
        list(APPEND ewa_manual_stamps ${PROJECT_BINARY_DIR}/${program}.manual)
    endif()
endforeach()
add_custom_target(manual ALL DEPENDS ${ewa_manual_stamps})

set(ewa_programs ewa)
foreach(program ewa-view ewa-bench)
    if(TARGET ${program})
        list(APPEND ewa_programs ${program})
    endif()
endforeach()
if(TARGET ewa_openimageio)
    add_dependencies(ewa_library ewa_openimageio)
    # Beside libewa, and where EWA_MODULES_FROM_PROGRAMS says for the programs.
    install(TARGETS ewa_openimageio LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/ewa)
endif()
if(TARGET ewa_meshing)
    add_dependencies(ewa_library ewa_meshing)
    install(TARGETS ewa_meshing LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/ewa)
endif()
if(TARGET ewa_mpi)
    add_dependencies(ewa_library ewa_mpi)
    # A package of its own, so that ewa's needs no MPI.
    install(TARGETS ewa_mpi LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/ewa COMPONENT mpi)
endif()
# All that an installation needs, and no test: scripts/build makes it.
add_custom_target(product DEPENDS ${ewa_programs} ewa_library manual)
install(TARGETS ${ewa_programs} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(TARGETS ewa_library EXPORT ewaTargets LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(DIRECTORY include/ewa DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.h")
install(DIRECTORY ${ewa_manual_folder}/ DESTINATION ${CMAKE_INSTALL_DATADIR} OPTIONAL)
install(FILES README.md CHANGELOG.md CONTRIBUTING.md LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} RENAME copyright) # where Debian looks for it
install(DIRECTORY docs examples DESTINATION ${CMAKE_INSTALL_DOCDIR})
foreach(folder bench scenes) # to which README.md points
    install(FILES ${folder}/README.md DESTINATION ${CMAKE_INSTALL_DOCDIR}/${folder})
endforeach()
install(FILES shaders/shared/constants.h DESTINATION ${CMAKE_INSTALL_DOCDIR}/shaders/shared)

if(TARGET ewa-view)
    install(FILES desktop/ewa-view.desktop DESTINATION ${CMAKE_INSTALL_DATADIR}/applications)
    install(FILES desktop/ewa-view.xml DESTINATION ${CMAKE_INSTALL_DATADIR}/mime/packages) # so that a double click opens a file
    install(FILES desktop/ewa-view.svg DESTINATION ${CMAKE_INSTALL_DATADIR}/icons/hicolor/scalable/apps)
endif()

set(ewa_package ${CMAKE_INSTALL_LIBDIR}/cmake/ewa)
install(EXPORT ewaTargets NAMESPACE ewa:: DESTINATION ${ewa_package})
file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/ewaConfig.cmake @ONLY CONTENT [[
# The public headers speak of GLM's vectors and of nothing else that is not the standard's. Only ewa/gpu_interop.h speaks of Vulkan,
# which its users find themselves.
include(CMakeFindDependencyMacro)
find_dependency(glm)
include(${CMAKE_CURRENT_LIST_DIR}/ewaTargets.cmake)
set_property(TARGET ewa::ewa APPEND PROPERTY INTERFACE_LINK_LIBRARIES glm::glm)
]])
write_basic_package_version_file(${PROJECT_BINARY_DIR}/ewaConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/ewaConfig.cmake ${PROJECT_BINARY_DIR}/ewaConfigVersion.cmake
        DESTINATION ${ewa_package})

# cpack --config build/release/CPackConfig.cmake: a .deb whose dependencies are read from what was linked. It has the files of the packages
# of debian/ but for ewa-mpi, and replaces them (docs/packaging.md).
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME ewa)
set(CPACK_PACKAGE_CONTACT "The authors of ewa <ewa@ewa.invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "trains, renders and inspects 3D Gaussian splats on any Vulkan device")
set(CPACK_PACKAGE_DESCRIPTION "Programs ewa, ewa-view and ewa-bench, and libewa with its headers. Images with cameras
become a 3D Gaussian splat scene, on any Vulkan device, a plain CPU included.")
set(CPACK_STRIP_FILES ON)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR})
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL Unspecified)
set(CPACK_DEBIAN_UNSPECIFIED_PACKAGE_NAME ewa)
set(CPACK_COMPONENT_UNSPECIFIED_DESCRIPTION ${CPACK_PACKAGE_DESCRIPTION})
if(TARGET ewa_mpi)
    list(APPEND CPACK_COMPONENTS_ALL mpi)
    set(CPACK_DEBIAN_MPI_PACKAGE_NAME ewa-mpi)
    set(CPACK_COMPONENT_MPI_DESCRIPTION "The module libewa_mpi.so, with which the processes that mpirun or srun starts train one scene together.")
    set(CPACK_DEBIAN_MPI_PACKAGE_DEPENDS "ewa (= ${PROJECT_VERSION}), openmpi-bin")
    set(CPACK_DEBIAN_MPI_PACKAGE_RECOMMENDS "")
    set(CPACK_DEBIAN_MPI_PACKAGE_SUGGESTS "")
    set(CPACK_DEBIAN_MPI_PACKAGE_CONFLICTS "")
    set(CPACK_DEBIAN_MPI_PACKAGE_REPLACES "")
endif()
# The loader is opened at run time, so no program names it.
set(CPACK_DEBIAN_PACKAGE_DEPENDS libvulkan1)
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "colmap, ffmpeg, fonts-dejavu-core, mesa-vulkan-drivers | vulkan-icd")
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "ewa-mpi, libglm-dev, vulkan-validationlayers, xdg-desktop-portal | zenity | kdialog")
set(CPACK_DEBIAN_PACKAGE_CONFLICTS "ewa-modules, libewa0.1, libewa-dev")
set(CPACK_DEBIAN_PACKAGE_REPLACES "ewa-modules, libewa0.1, libewa-dev")
include(CPack)
