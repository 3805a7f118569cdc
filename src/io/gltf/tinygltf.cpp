// SPDX-License-Identifier: Apache-2.0
// The implementation of tinygltf. CMakeLists.txt sets its options for the whole library, because they change
// its classes. It opens no files here: GltfDocument checks the text and passes it on.
#include <fstream>
#include <nlohmann/json.hpp>

#define TINYGLTF_IMPLEMENTATION
#define TINYGLTF_NO_INCLUDE_JSON
#include <tiny_gltf.h>
