// SPDX-License-Identifier: Apache-2.0
// tinygltf's implementation. What it may do is set for this room as a whole, in CMakeLists.txt: its classes
// differ with these settings. tinygltf opens no file of its own here; what it parses is text that was looked
// at before.
#include <fstream>
#include <nlohmann/json.hpp>

#define TINYGLTF_IMPLEMENTATION
#define TINYGLTF_NO_INCLUDE_JSON
#include <tiny_gltf.h>
