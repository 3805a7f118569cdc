# SPDX-License-Identifier: Apache-2.0
# How packaging/dependencies builds each library: a function build_NAME, in the folder of its patched sources. Those without one are
# headers alone.
# shellcheck shell=bash disable=SC2154

build_zlib() {
    archive z -DHAVE_UNISTD_H=1 -D_LARGEFILE64_SOURCE=1 -- {adler32,compress,crc32,deflate,gzclose,gzlib,gzread,gzwrite,infback,inffast,inflate,inftrees,trees,uncompr,zutil}.c
    cp zlib.h zconf.h "$prefix/include/"
    describe zlib 1.2.13 -lz
}
build_libpng() { with_cmake -DPNG_SHARED=OFF -DPNG_TESTS=OFF -DPNG_EXECUTABLES=OFF; }
build_libjpeg_turbo() { with_cmake -DENABLE_SHARED=OFF -DWITH_TURBOJPEG=OFF -DWITH_SIMD=1 -DREQUIRE_SIMD=1 -DWITH_JAVA=0; }
build_zstd() {
    with_cmake build/cmake -DZSTD_BUILD_SHARED=OFF -DZSTD_BUILD_PROGRAMS=OFF -DZSTD_BUILD_TESTS=OFF \
        -DZSTD_LEGACY_SUPPORT=OFF -DZSTD_BUILD_DICTBUILDER=OFF
}
build_webp() {
    local off=() part
    for part in ANIM_UTILS CWEBP DWEBP GIF2WEBP IMG2WEBP VWEBP WEBPINFO WEBPMUX EXTRAS; do off+=("-DWEBP_BUILD_$part=OFF"); done
    with_cmake "${off[@]}"
}
build_minizip() {
    local io=ioapi.c
    if $windows; then io='ioapi.c iowin32.c'; fi
    archive minizip -- zip.c unzip.c mztools.c $io
    mkdir -p "$prefix/include/minizip"
    cp ./*.h "$prefix/include/minizip/"
    describe minizip 1.1 '-lminizip -lz' "-I$prefix/include/minizip"
}
build_pugixml() { with_cmake -DPUGIXML_BUILD_TESTS=OFF; }
build_sqlite3() {
    # The one large source file is made here, by programs of this machine.
    ./configure --disable-shared > /dev/null
    make sqlite3.c sqlite3.h
    archive sqlite3 -DSQLITE_THREADSAFE=1 -DSQLITE_OMIT_LOAD_EXTENSION -DSQLITE_MAX_VARIABLE_NUMBER=250000 -DSQLITE_SECURE_DELETE -- sqlite3.c
    cp sqlite3.h "$prefix/include/"
}
build_fmt() { with_cmake -DFMT_TEST=OFF -DFMT_DOC=OFF; }
build_spdlog() {
    rm -rf include/spdlog/fmt/bundled
    with_cmake -DSPDLOG_FMT_EXTERNAL=ON -DSPDLOG_BUILD_EXAMPLE=OFF -DSPDLOG_BUILD_TESTS=OFF -DSPDLOG_BUILD_SHARED=OFF
}
build_httplib() {
    local system='-pthread' options=(-DCPPHTTPLIB_USE_POLL)
    if $windows; then system='-lws2_32 -lcrypt32' options=(); fi
    python3 ./split.py --out split
    archive cpp-httplib -Isplit -DCPPHTTPLIB_ZLIB_SUPPORT "${options[@]}" -- split/httplib.cc
    cp split/httplib.h "$prefix/include/"
    describe cpp-httplib 0.11.4 "-lcpp-httplib -lz $system" -DCPPHTTPLIB_ZLIB_SUPPORT
}
build_stb() {
    printf '#define STB_RECT_PACK_IMPLEMENTATION\n#define STB_TRUETYPE_IMPLEMENTATION\n#include <stb/stb_rect_pack.h>\n#include <stb/stb_truetype.h>\n' > stb.c
    archive stb -- stb.c
}
build_glfw() {
    local sources=() protocol system='-lgdi32' options=(-D_GLFW_WIN32 -DUNICODE -D_UNICODE)
    if $windows; then sources=(src/win32_*.c src/wgl_context.c); else
        system='-lm -ldl -lrt' options=(-D_GLFW_X11 -D_GLFW_WAYLAND -D_DEFAULT_SOURCE -DHAVE_MEMFD_CREATE)
        for protocol in deps/wayland/*.xml; do
            wayland-scanner client-header "$protocol" "src/$(basename "$protocol" .xml)-client-protocol.h"
            wayland-scanner private-code "$protocol" "src/$(basename "$protocol" .xml)-client-protocol-code.h"
        done
        sources=(src/{x11,wl,posix,linux}_*.c src/{glx_context,xkb_unicode}.c)
    fi
    archive glfw3 -Isrc -Iinclude "${options[@]}" -- src/{context,egl_context,init,input,monitor,osmesa_context,platform,vulkan,window}.c src/null_*.c "${sources[@]}"
    cp -r include/GLFW "$prefix/include/"
    mkdir -p "$prefix/lib/cmake/glfw3"
    cat > "$prefix/lib/cmake/glfw3/glfw3Config.cmake" << CONFIG
add_library(glfw STATIC IMPORTED)
set_target_properties(glfw PROPERTIES IMPORTED_LOCATION $prefix/lib/libglfw3.a INTERFACE_INCLUDE_DIRECTORIES $prefix/include
                      INTERFACE_LINK_LIBRARIES "${system// /;}")
CONFIG
}
build_imgui() {
    archive imgui -I. -DGLFW_INCLUDE_NONE '-DIMGUI_STB_RECT_PACK_FILENAME=<stb/stb_rect_pack.h>' '-DIMGUI_STB_TRUETYPE_FILENAME=<stb/stb_truetype.h>' \
        -DIMGUI_DISABLE_STB_RECT_PACK_IMPLEMENTATION -DIMGUI_DISABLE_STB_TRUETYPE_IMPLEMENTATION -- \
        imgui.cpp imgui_draw.cpp imgui_tables.cpp imgui_widgets.cpp backends/imgui_impl_{glfw,vulkan}.cpp
    mkdir -p "$prefix/include/imgui/backends"
    cp ./*.h "$prefix/include/imgui/"
    cp backends/imgui_impl_{glfw,vulkan}.h "$prefix/include/imgui/backends/"
}
build_googletest() { with_cmake -DBUILD_GMOCK=ON; }
build_meshoptimizer() { with_cmake -DMESHOPT_BUILD_DEMO=OFF; }
build_imath() { with_cmake -DPYTHON=OFF; }
build_tbb() { with_cmake -DTBB_TEST=OFF -DTBBMALLOC_BUILD=OFF -DTBB_STRICT=OFF; }
build_openvdb() {
    with_cmake -DOPENVDB_CORE_SHARED=OFF -DOPENVDB_CORE_STATIC=ON -DOPENVDB_BUILD_BINARIES=OFF -DUSE_BLOSC=OFF -DUSE_ZLIB=OFF \
        -DUSE_IMATH_HALF=ON -DOPENVDB_USE_DELAYED_LOADING=OFF -DUSE_EXPLICIT_INSTANTIATION=OFF -DUSE_CCACHE=OFF -DUSE_PKGCONFIG=OFF \
        -DUSE_STATIC_DEPENDENCIES=ON -DOPENVDB_INSTALL_CMAKE_MODULES=OFF -DOPENVDB_DISABLE_BOOST_IMPLICIT_LINKING=OFF
}
build_openexr() { with_cmake -DOPENEXR_BUILD_TOOLS=OFF -DOPENEXR_INSTALL_EXAMPLES=OFF; }
build_tiff() {
    local off=() part
    for part in tools tests contrib docs; do off+=("-Dtiff-$part=OFF"); done
    for part in jbig lzma zstd webp lerc libdeflate; do off+=("-D$part=OFF"); done
    with_cmake "${off[@]}" -Dcxx=OFF
}
build_openimageio() {
    local off=() part
    for part in iff cineon dds dicom dpx ffmpeg fits gif heif ico jpeg2000 null openvdb psd ptex r3d raw rla sgi softimage targa term zfile png jpeg \
        iconvert idiff igrep iinfo iv maketx oiiotool testtex; do off+=("-DENABLE_$part=OFF"); done
    for part in Freetype OpenColorIO OpenCV TBB DCMTK FFmpeg GIF Libheif LibRaw OpenJPEG OpenVDB Ptex R3DSDK Nuke PYTHON QT; do off+=("-DUSE_$part=OFF"); done
    # Boost has libraries for two things: what a thread owns, which packaging/thread_owned.h replaces, and the number of cores.
    sed -i 's/set (Boost_COMPONENTS thread)/set (Boost_COMPONENTS)/' src/cmake/externalpackages.cmake
    sed -i 's/^#if BOOST_VERSION >= 105600.*/#if 0/; /boost\/thread.hpp/d' src/libutil/sysutil.cpp
    sed -i 's/^using boost::thread_specific_ptr;//; s/<boost\/thread\/tss.hpp>/"thread_owned.h"/' \
        src/libOpenImageIO/image{in,out}put.cpp src/libtexture/imagecache_pvt.h
    cp "$here/thread_owned.h" src/include/
    with_cmake "${off[@]}" -DCMAKE_CXX_STANDARD=17 -DUSE_STD_FILESYSTEM=ON -DOIIO_BUILD_TOOLS=OFF -DOIIO_BUILD_TESTS=OFF -DBUILD_DOCS=OFF -DINSTALL_DOCS=OFF \
        -DINSTALL_FONTS=OFF -DSTOP_ON_WARNING=OFF -DUSE_EXTERNAL_PUGIXML=ON -DBUILD_MISSING_FMT=OFF -DBUILD_MISSING_ROBINMAP=OFF \
        -DINTERNALIZE_FMT=OFF -DUSE_CCACHE=OFF -DUSE_SIMD=0 -DOIIO_DISABLE_BOOST_STACKTRACE=ON -DLINKSTATIC=ON
}
