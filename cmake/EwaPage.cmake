# SPDX-License-Identifier: Apache-2.0
# Bundles web/ into the one page that src/io/splats/scene_page.cpp completes, and embeds it in a library.
find_program(ESBUILD esbuild REQUIRED)

file(GLOB page_sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/web/src/*.js)
set(page_dir ${PROJECT_BINARY_DIR}/page)
add_custom_command(
    OUTPUT ${page_dir}/page.js
    COMMAND ${ESBUILD} ${PROJECT_SOURCE_DIR}/web/src/main.js --bundle --format=iife --minify --target=es2020 --charset=utf8
            --log-level=warning --outfile=${page_dir}/page.js
    DEPENDS ${page_sources}
    COMMENT "Bundling the page" VERBATIM)
add_custom_command(
    OUTPUT ${page_dir}/page_text.cpp
    COMMAND ${CMAKE_COMMAND} -DPAGE=${PROJECT_SOURCE_DIR}/web/index.html -DSTYLE=${PROJECT_SOURCE_DIR}/web/style.css
            -DSCRIPT=${page_dir}/page.js -DOUT=${page_dir}/page_text.cpp -P ${PROJECT_SOURCE_DIR}/cmake/embed_page.cmake
    DEPENDS ${page_dir}/page.js ${PROJECT_SOURCE_DIR}/web/index.html ${PROJECT_SOURCE_DIR}/web/style.css
            ${PROJECT_SOURCE_DIR}/cmake/embed_page.cmake
    VERBATIM)
add_library(ewa_page STATIC ${page_dir}/page_text.cpp)
set_target_properties(ewa_page PROPERTIES POSITION_INDEPENDENT_CODE ON)
