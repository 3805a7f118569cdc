// SPDX-License-Identifier: Apache-2.0
#include "io/splats/rad_head.h"

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/json.h"
#include "core/sandboxed_path.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/gaussians.h"
#include "io/splats/rad.h"

namespace ewa::io {

namespace {

using nlohmann::json;
using enum RadEncoding;

constexpr core::JsonLimits kFileLimits = {.bytes = uint64_t(64) << 20},
                           kChunkLimits = {.bytes = uint64_t(1) << 20, .objects = 256, .values = 4096};
constexpr uint64_t kMostSplats = uint64_t(1) << 32;

constexpr uint32_t bits(std::initializer_list<RadEncoding> encodings) {
    uint32_t all = 0;
    for (const RadEncoding encoding : encodings) all |= 1u << uint32_t(encoding);
    return all;
}
constexpr uint32_t kFloats = bits({f32, f16, f32_lebytes, f16_lebytes}),
                   kSteps = kFloats | bits({r8, r8_delta, s8, s8_delta}), kIntegers = bits({u16, u32});

struct PropertyKind {
    std::string_view name;
    size_t numbers;  // of each splat
    uint32_t encodings;
};
constexpr std::array<PropertyKind, 14> kProperties = {{{"center", 3, kSteps},
                                                       {"alpha", 1, kSteps},
                                                       {"rgb", 3, kSteps},
                                                       {"scales", 3, kFloats | bits({ln_f16, ln_0r8})},
                                                       {"orientation", 3, kFloats | bits({oct88r8})},
                                                       {"sh1", 9, kSteps},
                                                       {"sh2", 15, kSteps},
                                                       {"sh3", 21, kSteps},
                                                       {"sh1_code", 9, kSteps},
                                                       {"sh2_code", 15, kSteps},
                                                       {"sh3_code", 21, kSteps},
                                                       {"sh_label", 1, kIntegers},
                                                       {"child_count", 1, kIntegers},
                                                       {"child_start", 1, kIntegers}}};

/// A JSON object of the file. Errors name the byte up to which the file is read.
class Object {
  public:
    Object(const core::FileReader& reader, const json& value, const std::string& what)
        : reader_(reader), value_(value) {
        if (!value.is_object()) reader.fail("the JSON of " + what + " is not an object");
    }

    /// Null if it is absent.
    const json* find(const char* key) const {
        const auto found = value_.find(key);
        return found == value_.end() || found->is_null() ? nullptr : &*found;
    }

    uint64_t whole(const char* key, uint64_t most, std::optional<uint64_t> otherwise = std::nullopt) const {
        const json* value = find(key);
        if (!value && otherwise) return *otherwise;
        if (!value || !value->is_number_unsigned() || value->get<uint64_t>() > most)
            reader_.fail("\"" + std::string(key) + "\" is not a whole number of 0 to " +
                         std::to_string(most));
        return value->get<uint64_t>();
    }

    double number(const char* key) const {
        const json* value = find(key);
        if (!value || !value->is_number() || !std::isfinite(float(value->get<double>())))
            reader_.fail("\"" + std::string(key) + "\" of a property is not a number");
        return value->get<double>();
    }

    std::string text(const char* key) const {
        const json* value = find(key);
        if (!value || !value->is_string()) reader_.fail("\"" + std::string(key) + "\" is not a text");
        return value->get<std::string>();
    }

    const json& list(const char* key) const {
        const json* value = find(key);
        if (!value || !value->is_array()) reader_.fail("\"" + std::string(key) + "\" is not a list");
        return *value;
    }

  private:
    const core::FileReader& reader_;
    const json& value_;
};

/// The JSON after a magic number, up to the multiple of 8 bytes where the next part begins.
json read_json(core::FileReader& reader, uint32_t magic, core::JsonLimits limits, const std::string& what) {
    if (reader.read<uint32_t>(what) != magic)
        reader.fail(what + " does not begin with \"" + (magic == kRadMagic ? "RAD0\"" : "RADC\""));
    const uint64_t length = reader.read<uint32_t>(what);
    if (length > limits.bytes)
        reader.fail(what + " claims " + std::to_string(length) + " bytes of JSON, more than " +
                    std::to_string(limits.bytes));
    limits.begin = reader.offset();
    const auto* text = reinterpret_cast<const char*>(reader.take(size_t(length), what));
    json value = core::parse_json<json>(std::string_view(text, size_t(length)), reader.name(), limits);
    reader.skip(std::min((8 - length % 8) % 8, reader.remaining()), what);
    if (Object(reader, value, what).whole("version", UINT32_MAX) != 1)
        reader.fail("the \"version\" of " + what + " is unknown; 1 is supported");
    return value;
}

RadChunkPlace place_of(const core::FileReader& reader, const json& value,
                       const std::filesystem::path& folder) {
    const Object object(reader, value, "\"chunks\"");
    RadChunkPlace place;
    place.offset = object.whole("offset", UINT64_MAX / 4);
    place.bytes = object.whole("bytes", UINT64_MAX - 1, UINT64_MAX);
    if (!object.find("filename")) {
        place.offset += reader.offset();
        return place;
    }
    const std::string name = object.text("filename");
    place.file = core::name_inside(name);
    if (!place.file || !core::links_stay_inside(folder, *place.file))
        reader.fail("\"chunks\" names the file \"" + core::one_line(name) + "\", which is not in its folder");
    return place;
}

std::pair<std::string, RadProperty> property_of(const core::FileReader& reader, const json& value,
                                                uint64_t payload) {
    const Object object(reader, value, "\"properties\"");
    const std::string name = object.text("property"), encoding_name = object.text("encoding");
    const auto* kind = std::ranges::find(kProperties, name, &PropertyKind::name);
    const std::optional<RadEncoding> encoding = rad_encoding(encoding_name);
    if (kind == kProperties.end() || !encoding || !(kind->encodings & bits({*encoding})))
        reader.fail("the property \"" + core::one_line(name) + "\" in the encoding \"" +
                    core::one_line(encoding_name) + "\" is unknown");
    RadProperty property;
    property.encoding = *encoding;
    property.numbers = kind->numbers;
    property.deflated = object.find("compression") != nullptr;
    if (property.deflated && object.text("compression") != "gz")
        reader.fail("the \"compression\" of a property is unknown; \"gz\" is supported");
    const uint64_t offset = object.whole("offset", payload);
    property.bytes = object.whole("bytes", payload - offset);
    property.offset = reader.offset() + offset;
    if (needs_min(*encoding)) property.min = object.number("min");
    if (needs_max(*encoding)) property.max = object.number("max");
    return {name, property};
}

}  // namespace

RadHead read_rad_head(core::FileReader& reader, const std::filesystem::path& folder) {
    const json meta = read_json(reader, kRadMagic, kFileLimits, "the header");
    const Object object(reader, meta, "the header");
    if (object.text("type") != "gsplat")
        reader.fail("the \"type\" of its contents is unknown; \"gsplat\" is supported");
    RadHead head;
    head.count = object.whole("count", kMostSplats);
    head.chunk_size = object.whole("chunkSize", kMostSplats, head.count);
    head.codes = object.whole("shCodeCount", kMostSplats, 0);
    head.sh_degree = int(object.whole("maxSh", kMaxShDegree, 0));
    const json* tree = object.find("lodTree");
    head.tree = tree && *tree == true;
    if (object.find("comment")) head.comment = object.text("comment");
    const json& chunks = object.list("chunks");
    const uint64_t needed = head.count == 0        ? 0
                            : head.chunk_size == 0 ? UINT64_MAX
                                                   : (head.count - 1) / head.chunk_size + 1;
    if (chunks.size() != needed)
        reader.fail("\"chunks\" has " + core::counted(chunks.size(), "chunk") + " of " +
                    std::to_string(head.chunk_size) + " for " + core::counted(head.count, "splat"));
    for (const json& chunk : chunks) head.chunks.push_back(place_of(reader, chunk, folder));
    return head;
}

RadProperties read_rad_chunk_head(core::FileReader& reader, uint64_t base, uint64_t count) {
    const json meta = read_json(reader, kRadChunkMagic, kChunkLimits, "a chunk");
    const Object object(reader, meta, "a chunk");
    if (object.whole("base", kMostSplats) != base || object.whole("count", kMostSplats) != count)
        reader.fail("a chunk does not have the splats " + std::to_string(base) + " to " +
                    std::to_string(base + count - 1));
    const auto payload = reader.read<uint64_t>("a chunk");
    if (payload > reader.remaining())
        reader.fail("a chunk claims " + std::to_string(payload) + " bytes, and " +
                    std::to_string(reader.remaining()) + " are left");
    RadProperties properties;
    for (const json& value : object.list("properties")) {
        const auto [name, property] = property_of(reader, value, payload);
        if (!properties.emplace(name, property).second)
            reader.fail("the property \"" + name + "\" comes twice in a chunk");
    }
    return properties;
}

}  // namespace ewa::io
