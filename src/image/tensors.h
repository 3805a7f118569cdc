// SPDX-License-Identifier: Apache-2.0
// Arrays of numbers in a file of the format safetensors: eight bytes with the length of a JSON, the JSON, then the values.
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace ewa::image {

struct Tensor {
    std::vector<uint64_t> shape;
    std::vector<float> values;  // finite; as many as the product of `shape`
};

/// All tensors of the file, by name. Throws InputError, also for values that are not of type F32 or not finite.
std::map<std::string, Tensor> read_tensors(const std::filesystem::path& path);

}  // namespace ewa::image
