# SPDX-License-Identifier: Apache-2.0
# Writes OUT, a C++ header with the words of MODULE, a SPIR-V file, as an array NAME.
cmake_minimum_required(VERSION 3.25)
file(READ ${MODULE} words HEX)
string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1," words "${words}")
file(WRITE ${OUT} "#pragma once
const std::uint32_t ${NAME}[] = {${words}};
")
