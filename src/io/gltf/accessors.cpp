// SPDX-License-Identifier: Apache-2.0
// The values that accessors of glTF documents have.
#include <algorithm>
#include <cstring>
#include <iterator>
#include <limits>
#include <type_traits>

#include "core/file_reader.h"
#include "io/gltf/document.h"

namespace ewa::io {

namespace {

size_t components(const tinygltf::Accessor& accessor) {
    if (accessor.type == TINYGLTF_TYPE_SCALAR) return 1;
    return accessor.type >= TINYGLTF_TYPE_VEC2 && accessor.type <= TINYGLTF_TYPE_VEC4 ? size_t(accessor.type)
                                                                                      : 0;
}

template <class T>
double value_of(const std::byte* bytes, bool normalized) {
    T value;
    std::memcpy(&value, bytes, sizeof(T));
    if (std::is_floating_point_v<T> || !normalized) return double(value);
    return std::max(double(value) / double(std::numeric_limits<T>::max()), -1.0);
}

struct Component {
    int type;
    size_t bytes;
    double (*value)(const std::byte*, bool normalized);
};
constexpr Component kComponents[] = {
    {TINYGLTF_COMPONENT_TYPE_BYTE, 1, value_of<int8_t>},
    {TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE, 1, value_of<uint8_t>},
    {TINYGLTF_COMPONENT_TYPE_SHORT, 2, value_of<int16_t>},
    {TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT, 2, value_of<uint16_t>},
    {TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT, 4, value_of<uint32_t>},
    {TINYGLTF_COMPONENT_TYPE_FLOAT, 4, value_of<float>},
};

/// Null for a type that glTF's accessors do not have.
const Component* component_of(const tinygltf::Accessor& accessor) {
    const auto* found = std::ranges::find(kComponents, accessor.componentType, &Component::type);
    return found == std::end(kComponents) ? nullptr : found;
}

}  // namespace

const tinygltf::Accessor& GltfDocument::accessor(int index, const std::string& what, bool indices) const {
    const std::string where = what + ": accessor " + std::to_string(index) + ": ";
    const auto refuse = [&](const std::string& text) { fail(where + text); };
    if (index < 0 || size_t(index) >= model_.accessors.size()) refuse("there is none of this number");
    const tinygltf::Accessor& a = model_.accessors[size_t(index)];
    if (a.sparse.isSparse) refuse("\"sparse\" is not supported");
    const Component* component = component_of(a);
    const uint64_t element = component ? component->bytes * components(a) : 0;
    if (element == 0 || (a.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT && !indices))
        refuse("\"componentType\" or \"type\" is none that such an attribute has");
    const tinygltf::BufferView& view = buffer_view(a.bufferView, where);
    const uint64_t stride = view.byteStride == 0 ? element : view.byteStride;
    if (stride < element) refuse("its buffer view's \"byteStride\" is smaller than an element");
    const uint64_t space = view.byteLength < a.byteOffset ? 0 : view.byteLength - a.byteOffset;
    if (a.count > 0 && (space < element || (space - element) / stride < a.count - 1))
        refuse("its " + std::to_string(a.count) + " elements do not fit its buffer view of " +
               std::to_string(view.byteLength) + " bytes");
    return a;
}

const tinygltf::Accessor* GltfDocument::attribute(const tinygltf::Primitive& primitive,
                                                  const std::string& name, std::initializer_list<int> types,
                                                  size_t count, const std::string& where) const {
    const auto found = primitive.attributes.find(name);
    if (found == primitive.attributes.end()) return nullptr;
    const std::string what = where + ", attribute " + name;
    const tinygltf::Accessor& a = accessor(found->second, what);
    if (std::ranges::find(types, a.type) == types.end())
        fail(what + ": \"type\" is wrong for this attribute");
    if (name != "POSITION" && a.count != count)
        fail(what + ": has " + std::to_string(a.count) + " elements for " + std::to_string(count) +
             " positions");
    return &a;
}

void GltfDocument::read(const tinygltf::Accessor& accessor, const std::string& what,
                        const std::function<void(size_t, const double*)>& element) const {
    const tinygltf::BufferView& view = model_.bufferViews[size_t(accessor.bufferView)];
    const Buffer& buffer = buffers_[size_t(view.buffer)];
    const Component& component = *component_of(accessor);
    const size_t width = component.bytes, count = components(accessor);
    const size_t stride = view.byteStride == 0 ? width * count : view.byteStride;
    const uint64_t begin = view.byteOffset + accessor.byteOffset;
    const auto each = [&](size_t i, const std::byte* bytes) {
        double values[4] = {};
        for (size_t k = 0; k < count; ++k)
            values[k] = component.value(bytes + k * width, accessor.normalized);
        element(i, values);
    };
    if (buffer.file.empty()) {
        const auto* data = reinterpret_cast<const std::byte*>(buffer.data.data()) + begin;
        for (size_t i = 0; i < accessor.count; ++i) each(i, data + i * stride);
        return;
    }
    core::FileReader reader(buffer.file);
    reader.skip(buffer.begin + begin, what);
    for (size_t i = 0; i < accessor.count; ++i) {
        each(i, reader.take(width * count, what));
        if (i + 1 < accessor.count) reader.skip(stride - width * count, what);
    }
}

}  // namespace ewa::io
