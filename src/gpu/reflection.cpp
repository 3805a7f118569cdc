// SPDX-License-Identifier: Apache-2.0
#include "gpu/reflection.h"

#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>

namespace ewa::gpu {
namespace {

// Numbers of the SPIR-V specification, section 3.
enum Op : uint32_t {
    kOpTypeInt = 21,
    kOpTypeFloat = 22,
    kOpTypeVector = 23,
    kOpTypeImage = 25,
    kOpTypeSampledImage = 27,
    kOpTypeArray = 28,
    kOpTypeStruct = 30,
    kOpTypePointer = 32,
    kOpConstant = 43,
    kOpVariable = 59,
    kOpDecorate = 71,
    kOpMemberDecorate = 72
};
enum Decoration : uint32_t {
    kSpecId = 1,
    kDecorationArrayStride = 6,
    kNonWritable = 24,
    kNonReadable = 25,
    kDecorationBinding = 33,
    kDecorationSet = 34,
    kDecorationOffset = 35
};
enum Storage : uint32_t { kUniformConstant = 0, kUniform = 2, kPushConstant = 9, kStorageBuffer = 12 };

struct Module {
    std::map<uint32_t, uint32_t> binding, set;  // variable -> number
    std::set<uint32_t> spec_ids;
    std::map<uint32_t, std::set<uint32_t>> read_only, write_only;  // struct -> members
    std::set<uint32_t> variable_read_only, variable_write_only;
    std::map<uint32_t, std::map<uint32_t, uint32_t>> offsets;   // struct -> member -> byte offset
    std::map<uint32_t, std::vector<uint32_t>> members;          // struct -> member types
    std::map<uint32_t, uint32_t> scalar_bytes;                  // int and float types
    std::map<uint32_t, std::pair<uint32_t, uint32_t>> vectors;  // type -> component type, count
    std::map<uint32_t, uint32_t> array_length;                  // type -> constant
    std::map<uint32_t, uint32_t> array_stride, constants;
    std::map<uint32_t, uint32_t> pointee;  // pointer type -> type
    std::map<uint32_t, bool> image;        // sampled image types
    struct Variable {
        uint32_t id, type, storage;
    };
    std::vector<Variable> variables;
};

void read_decoration(Module& module, uint32_t op, std::span<const uint32_t> words) {
    const uint32_t target = words[1];
    if (op == kOpDecorate) {
        if (words[2] == kSpecId) module.spec_ids.insert(words[3]);
        if (words[2] == kDecorationBinding) module.binding[target] = words[3];
        if (words[2] == kDecorationSet) module.set[target] = words[3];
        if (words[2] == kNonWritable) module.variable_read_only.insert(target);
        if (words[2] == kNonReadable) module.variable_write_only.insert(target);
        if (words[2] == kDecorationArrayStride) module.array_stride[target] = words[3];
    } else {
        const uint32_t member = words[2];
        if (words[3] == kNonWritable) module.read_only[target].insert(member);
        if (words[3] == kNonReadable) module.write_only[target].insert(member);
        if (words[3] == kDecorationOffset) module.offsets[target][member] = words[4];
    }
}

Module parse(std::span<const uint32_t> spirv) {
    if (spirv.size() < 5 || spirv[0] != 0x07230203) throw std::logic_error("not a SPIR-V module");
    Module module;
    for (size_t at = 5; at < spirv.size();) {
        const uint32_t length = spirv[at] >> 16, op = spirv[at] & 0xffff;
        if (length == 0 || at + length > spirv.size()) throw std::logic_error("damaged SPIR-V module");
        const auto words = spirv.subspan(at, length);
        if (op == kOpDecorate || op == kOpMemberDecorate) read_decoration(module, op, words);
        if (op == kOpTypeStruct) module.members[words[1]].assign(words.begin() + 2, words.end());
        if (op == kOpTypeInt || op == kOpTypeFloat) module.scalar_bytes[words[1]] = words[2] / 8;
        if (op == kOpTypeVector) module.vectors[words[1]] = {words[2], words[3]};
        if (op == kOpTypeArray) module.array_length[words[1]] = words[3];
        if (op == kOpConstant) module.constants[words[2]] = words[3];
        if (op == kOpTypePointer) module.pointee[words[1]] = words[3];
        if (op == kOpTypeImage || op == kOpTypeSampledImage) module.image[words[1]] = true;
        if (op == kOpVariable) module.variables.push_back({words[2], words[1], words[3]});
        at += length;
    }
    return module;
}

/// Bytes up to the end of a type's last member.
uint32_t size_of(const Module& module, uint32_t type) {
    if (const auto scalar = module.scalar_bytes.find(type); scalar != module.scalar_bytes.end())
        return scalar->second;
    if (const auto vector = module.vectors.find(type); vector != module.vectors.end())
        return vector->second.second * size_of(module, vector->second.first);
    if (const auto length = module.array_length.find(type); length != module.array_length.end())
        return module.constants.at(length->second) * module.array_stride.at(type);
    const auto members = module.members.find(type);
    if (members == module.members.end())
        throw std::logic_error("a push constant of a type this project does not use");
    uint32_t end = 0;
    for (uint32_t member = 0; member < members->second.size(); ++member)
        end = std::max(end, module.offsets.at(type).at(member) + size_of(module, members->second[member]));
    return end;
}

Access storage_access(const Module& module, uint32_t variable, uint32_t type) {
    const uint32_t count = uint32_t(module.members.at(type).size());
    const auto all = [&](const auto& table) {
        const auto found = table.find(type);
        return found != table.end() && found->second.size() == count;
    };
    if (all(module.read_only) || module.variable_read_only.count(variable)) return Access::read;
    if (all(module.write_only) || module.variable_write_only.count(variable)) return Access::write;
    return Access::read_write;
}

}  // namespace

Reflection reflect(std::span<const uint32_t> spirv) {
    const Module module = parse(spirv);
    Reflection result;
    for (const auto& variable : module.variables) {
        const auto pointee = module.pointee.find(variable.type);
        if (pointee == module.pointee.end()) continue;
        const uint32_t type = pointee->second;
        if (variable.storage == kPushConstant) {
            result.push_constant_bytes = size_of(module, type);
            continue;
        }
        const auto binding = module.binding.find(variable.id);
        if (binding == module.binding.end()) continue;
        const auto set = module.set.find(variable.id);
        if (set != module.set.end() && set->second != 0) throw std::logic_error("a binding outside set 0");
        if (variable.storage == kUniformConstant && module.image.count(type))
            result.bindings.push_back({binding->second, BindingKind::texel, Access::read});
        else if (variable.storage == kUniform)
            result.bindings.push_back({binding->second, BindingKind::uniform, Access::read});
        else if (variable.storage == kStorageBuffer)
            result.bindings.push_back(
                {binding->second, BindingKind::storage, storage_access(module, variable.id, type)});
        else
            throw std::logic_error("a binding of a kind this project does not use");
    }
    std::sort(result.bindings.begin(), result.bindings.end(),
              [](const Binding& a, const Binding& b) { return a.binding < b.binding; });
    for (uint32_t i = 0; i < result.bindings.size(); ++i)
        if (result.bindings[i].binding != i) throw std::logic_error("bindings are not numbered without gaps");
    result.constants.assign(module.spec_ids.begin(), module.spec_ids.end());
    return result;
}

}  // namespace ewa::gpu
