# Finds OpenImageIO by its header and libraries. Debian's own package configuration names iconvert, oiiotool and the
# OpenCV headers as files that must exist, which would pull Qt and OpenCV's development files in for nothing.
find_path(OpenImageIO_INCLUDE_DIR OpenImageIO/imageio.h)
find_library(OpenImageIO_LIBRARY OpenImageIO)
find_library(OpenImageIO_Util_LIBRARY OpenImageIO_Util)
mark_as_advanced(OpenImageIO_INCLUDE_DIR OpenImageIO_LIBRARY OpenImageIO_Util_LIBRARY)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OpenImageIO
    REQUIRED_VARS OpenImageIO_LIBRARY OpenImageIO_Util_LIBRARY OpenImageIO_INCLUDE_DIR)

if(OpenImageIO_FOUND AND NOT TARGET OpenImageIO::OpenImageIO)
    add_library(OpenImageIO::OpenImageIO UNKNOWN IMPORTED)
    set_target_properties(OpenImageIO::OpenImageIO PROPERTIES
        IMPORTED_LOCATION ${OpenImageIO_LIBRARY}
        INTERFACE_INCLUDE_DIRECTORIES ${OpenImageIO_INCLUDE_DIR}
        INTERFACE_LINK_LIBRARIES ${OpenImageIO_Util_LIBRARY})
endif()
