# SPDX-License-Identifier: Apache-2.0
# OpenImageIO by header and library. Debian's own CMake package also demands the command line tools and the headers of
# OpenCV, which nothing here uses.
find_path(OpenImageIO_INCLUDE_DIR OpenImageIO/imageio.h)
find_library(OpenImageIO_LIBRARY OpenImageIO)
find_library(OpenImageIO_UTIL_LIBRARY OpenImageIO_Util)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OpenImageIO REQUIRED_VARS OpenImageIO_LIBRARY OpenImageIO_UTIL_LIBRARY
                                                            OpenImageIO_INCLUDE_DIR)
if(OpenImageIO_FOUND AND NOT TARGET OpenImageIO::OpenImageIO)
    add_library(OpenImageIO::OpenImageIO UNKNOWN IMPORTED)
    set_target_properties(OpenImageIO::OpenImageIO PROPERTIES
        IMPORTED_LOCATION "${OpenImageIO_LIBRARY}"
        INTERFACE_INCLUDE_DIRECTORIES "${OpenImageIO_INCLUDE_DIR}"
        INTERFACE_LINK_LIBRARIES "${OpenImageIO_UTIL_LIBRARY}")
    if(OpenImageIO_LIBRARY MATCHES "\\.a$") # which brings none of the libraries that it calls
        find_package(OpenEXR CONFIG REQUIRED)
        find_package(TIFF REQUIRED)
        find_package(WebP CONFIG REQUIRED)
        target_compile_definitions(OpenImageIO::OpenImageIO INTERFACE OIIO_STATIC_DEFINE)
        target_link_libraries(OpenImageIO::OpenImageIO INTERFACE OpenEXR::OpenEXR OpenEXR::OpenEXRCore TIFF::TIFF WebP::webpdemux WebP::webp JPEG::JPEG
                                                                 ZLIB::ZLIB pugixml::pugixml ${CMAKE_DL_LIBS} $<$<PLATFORM_ID:Windows>:psapi>)
    endif()
endif()
mark_as_advanced(OpenImageIO_INCLUDE_DIR OpenImageIO_LIBRARY OpenImageIO_UTIL_LIBRARY)
