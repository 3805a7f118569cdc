# SPDX-License-Identifier: Apache-2.0
# OpenVDB by header and library, with Threading Building Blocks and Imath, whose functions its headers call. OpenVDB's own module
# also wants parts of Boost.
find_path(OpenVDB_INCLUDE_DIR openvdb/openvdb.h)
find_path(OpenVDB_BOOST_INCLUDE_DIR boost/numeric/conversion/conversion_traits.hpp)
find_library(OpenVDB_LIBRARY NAMES openvdb libopenvdb)
find_library(OpenVDB_TBB_LIBRARY NAMES tbb tbb12)
find_library(OpenVDB_IMATH_LIBRARY NAMES Imath Imath-3_1)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OpenVDB REQUIRED_VARS OpenVDB_LIBRARY OpenVDB_TBB_LIBRARY OpenVDB_IMATH_LIBRARY
                                                        OpenVDB_INCLUDE_DIR OpenVDB_BOOST_INCLUDE_DIR)
if(OpenVDB_FOUND AND NOT TARGET OpenVDB::openvdb)
    add_library(OpenVDB::openvdb UNKNOWN IMPORTED)
    set_target_properties(OpenVDB::openvdb PROPERTIES
        IMPORTED_LOCATION "${OpenVDB_LIBRARY}"
        INTERFACE_INCLUDE_DIRECTORIES "${OpenVDB_INCLUDE_DIR}"
        INTERFACE_LINK_LIBRARIES "${OpenVDB_TBB_LIBRARY};${OpenVDB_IMATH_LIBRARY}")
    if(OpenVDB_LIBRARY MATCHES "\\.a$")
        target_compile_definitions(OpenVDB::openvdb INTERFACE OPENVDB_STATICLIB)
        target_link_libraries(OpenVDB::openvdb INTERFACE ${CMAKE_DL_LIBS})
    endif()
endif()
mark_as_advanced(OpenVDB_INCLUDE_DIR OpenVDB_BOOST_INCLUDE_DIR OpenVDB_LIBRARY OpenVDB_TBB_LIBRARY OpenVDB_IMATH_LIBRARY)
