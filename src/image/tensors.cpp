// SPDX-License-Identifier: Apache-2.0
#include "image/tensors.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string_view>

#include "core/file_reader.h"
#include "core/json.h"
#include "core/text.h"
#include "ewa/error.h"

namespace ewa::image {
namespace {

using TensorJson = nlohmann::json;

/// The name, which a damaged file may have made long.
std::string shown(const std::string& name) {
    return core::one_line(name.substr(0, 100));
}

/// The element of a list of whole numbers.
uint64_t whole(const TensorJson& list, size_t i, core::FileReader& file, const std::string& name) {
    if (!list.is_array() || i >= list.size() || !list[i].is_number_unsigned())
        file.fail("the JSON says no shape and place of \"" + shown(name) + "\"");
    return list[i].get<uint64_t>();
}

Tensor read_tensor(const TensorJson& entry, const std::string& name, uint64_t data, core::FileReader& file) {
    const auto member = [&](const char* key) -> const TensorJson& {
        static const TensorJson kNothing;
        return entry.is_object() && entry.contains(key) ? entry[key] : kNothing;
    };
    if (member("dtype") != "F32") file.fail("\"" + shown(name) + "\" has values of another type than F32");
    const TensorJson &shape = member("shape"), &place = member("data_offsets");
    const uint64_t begin = whole(place, 0, file, name), end = whole(place, 1, file, name);
    constexpr size_t kMostDimensions = 8;
    Tensor tensor;
    uint64_t values = 1;
    const uint64_t most = file.size() / sizeof(float);
    if (!shape.is_array() || shape.size() > kMostDimensions)
        file.fail("the JSON says no shape of \"" + shown(name) + "\"");
    for (size_t i = 0; i < shape.size(); ++i) {
        tensor.shape.push_back(whole(shape, i, file, name));
        if (tensor.shape.back() > most) values = most + 1;
        values = std::min(values * std::min(tensor.shape.back(), most), most + 1);
    }
    if (begin > file.size() || end > file.size() || end < begin || end - begin != values * sizeof(float))
        file.fail("the values of \"" + shown(name) + "\" do not fill the place that the JSON claims");
    file.go_to(data + begin, "the values of \"" + shown(name) + "\"");
    file.require_room(values, sizeof(float), "the values");
    tensor.values.resize(values);
    constexpr size_t kPiece = 1 << 14;
    for (size_t i = 0; i < values; i += kPiece) {
        const size_t count = std::min<size_t>(kPiece, values - i);
        std::memcpy(&tensor.values[i], file.take(count * sizeof(float), "the values"), count * sizeof(float));
    }
    if (!std::all_of(tensor.values.begin(), tensor.values.end(), [](float v) { return std::isfinite(v); }))
        file.fail("\"" + shown(name) + "\" has a value that is not finite");
    return tensor;
}

}  // namespace

std::map<std::string, Tensor> read_tensors(const std::filesystem::path& path) {
    constexpr uint64_t kMostJson = 1 << 20;
    core::FileReader file(path);
    const auto length = file.read<uint64_t>("the length of the JSON");
    if (length > kMostJson || length > file.remaining())
        file.fail("claims a JSON of " + std::to_string(length) + " bytes: this is no file of tensors");
    const auto* bytes = reinterpret_cast<const char*>(file.take(length, "the JSON"));
    core::JsonLimits limits;
    limits.begin = file.offset() - length;
    const auto json =
        core::parse_json<TensorJson>(std::string_view(bytes, size_t(length)), file.name(), limits);
    if (!json.is_object()) file.fail("the JSON is no object: this is no file of tensors");
    const uint64_t data = file.offset();
    uint64_t bytes_left =
        file.remaining();  // tensors do not overlap, so that memory stays within the file's size
    std::map<std::string, Tensor> tensors;
    for (const auto& [name, entry] : json.items()) {
        if (name == "__metadata__") continue;
        Tensor tensor = read_tensor(entry, name, data, file);
        if (tensor.values.size() * sizeof(float) > bytes_left)
            file.fail("the JSON claims more values than there are");
        bytes_left -= tensor.values.size() * sizeof(float);
        tensors.emplace(name, std::move(tensor));
    }
    return tensors;
}

}  // namespace ewa::image
