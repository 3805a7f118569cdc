#include "gpu/reflection.h"

#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>

namespace ewa::gpu {
namespace {

// Numbers of the SPIR-V specification, section 3.
enum Op : uint32_t {
    kOpTypeImage = 25,
    kOpTypeSampledImage = 27,
    kOpTypeStruct = 30,
    kOpTypePointer = 32,
    kOpVariable = 59,
    kOpDecorate = 71,
    kOpMemberDecorate = 72
};
enum Decoration : uint32_t {
    kDecorationBlock = 2,
    kNonWritable = 24,
    kNonReadable = 25,
    kDecorationBinding = 33,
    kDecorationSet = 34,
    kDecorationOffset = 35
};
enum Storage : uint32_t { kUniformConstant = 0, kUniform = 2, kPushConstant = 9, kStorageBuffer = 12 };

struct Module {
    std::map<uint32_t, uint32_t> binding, set;                     // variable -> number
    std::map<uint32_t, std::set<uint32_t>> read_only, write_only;  // struct -> members
    std::set<uint32_t> variable_read_only, variable_write_only;
    std::map<uint32_t, uint32_t> last_offset;  // struct -> largest member offset
    std::map<uint32_t, uint32_t> members;      // struct -> count
    std::map<uint32_t, uint32_t> pointee;      // pointer type -> type
    std::map<uint32_t, bool> image;            // sampled image types
    struct Variable {
        uint32_t id, type, storage;
    };
    std::vector<Variable> variables;
};

void read_decoration(Module& module, uint32_t op, std::span<const uint32_t> words) {
    const uint32_t target = words[1];
    if (op == kOpDecorate) {
        if (words[2] == kDecorationBinding) module.binding[target] = words[3];
        if (words[2] == kDecorationSet) module.set[target] = words[3];
        if (words[2] == kNonWritable) module.variable_read_only.insert(target);
        if (words[2] == kNonReadable) module.variable_write_only.insert(target);
    } else {
        const uint32_t member = words[2];
        if (words[3] == kNonWritable) module.read_only[target].insert(member);
        if (words[3] == kNonReadable) module.write_only[target].insert(member);
        if (words[3] == kDecorationOffset)
            module.last_offset[target] = std::max(module.last_offset[target], words[4]);
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
        if (op == kOpTypeStruct) module.members[words[1]] = length - 2;
        if (op == kOpTypePointer) module.pointee[words[1]] = words[3];
        if (op == kOpTypeImage || op == kOpTypeSampledImage) module.image[words[1]] = true;
        if (op == kOpVariable) module.variables.push_back({words[2], words[1], words[3]});
        at += length;
    }
    return module;
}

Access storage_access(const Module& module, uint32_t variable, uint32_t type) {
    const uint32_t count = module.members.at(type);
    const auto all = [&](const auto& table) {
        const auto found = table.find(type);
        return found != table.end() && found->second.size() == count;
    };
    if (all(module.read_only) || module.variable_read_only.count(variable)) return Access::read;
    if (all(module.write_only) || module.variable_write_only.count(variable)) return Access::write;
    return Access::read_write;
}

}  // namespace

std::string to_string(Access access) {
    return access == Access::read ? "read" : access == Access::write ? "write" : "read and write";
}

Reflection reflect(std::span<const uint32_t> spirv) {
    const Module module = parse(spirv);
    Reflection result;
    for (const auto& variable : module.variables) {
        const auto pointee = module.pointee.find(variable.type);
        if (pointee == module.pointee.end()) continue;
        const uint32_t type = pointee->second;
        if (variable.storage == kPushConstant) {
            const auto offset = module.last_offset.find(type);
            result.push_constant_bytes = (offset == module.last_offset.end() ? 0 : offset->second) + 4;
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
    return result;
}

}  // namespace ewa::gpu
