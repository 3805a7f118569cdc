// SPDX-License-Identifier: Apache-2.0
#include "gpu/pipeline.h"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <stdexcept>
#include <thread>

#include "ewa/error.h"

namespace ewa::gpu {
namespace {

// Numbers of the SPIR-V specification, section 3.
enum Op : uint32_t {
    kOpEntryPoint = 15,
    kOpExecutionMode = 16,
    kOpCapability = 17,
    kOpTypeInt = 21,
    kOpTypeFloat = 22,
    kOpTypeVector = 23,
    kOpTypeImage = 25,
    kOpTypeSampledImage = 27,
    kOpTypeArray = 28,
    kOpTypeStruct = 30,
    kOpTypePointer = 32,
    kOpConstant = 43,
    kOpSpecConstant = 50,
    kOpVariable = 59,
    kOpDecorate = 71,
    kOpMemberDecorate = 72
};
enum Decoration : uint32_t {
    kSpecId = 1,
    kArrayStride = 6,
    kNonWritable = 24,
    kNonReadable = 25,
    kBinding = 33,
    kDescriptorSet = 34,
    kOffset = 35
};
enum Storage : uint32_t { kUniformConstant = 0, kUniform = 2, kPushConstant = 9, kStorageBuffer = 12 };
struct FloatMode {
    uint32_t capability, execution_mode;
};
constexpr FloatMode kDenormPreserve{4464, 4459}, kSignedZeroInfNanPreserve{4466, 4461};
constexpr uint32_t kGroupNonUniform = 61;  // the capability of all subgroup operations
constexpr uint32_t kWhole = ~0u;           // in place of a member's number

using Words = std::span<const uint32_t>;  // of an instruction; the first holds its op

struct Module {
    std::map<uint32_t, Words> declared;  // types and constants, by id
    std::vector<Words> variables;
    bool uses_subgroups = false;
    std::map<std::array<uint32_t, 3>, uint32_t> decorations;  // id, member, decoration -> operand, or 0
};

Module parse(Words spirv) {
    if (spirv.size() < 5 || spirv[0] != 0x07230203) throw std::logic_error("not a SPIR-V module");
    Module module;
    for (size_t at = 5; at < spirv.size();) {
        const uint32_t length = spirv[at] >> 16, op = spirv[at] & 0xffff;
        if (length == 0 || at + length > spirv.size()) throw std::logic_error("damaged SPIR-V module");
        const Words words = spirv.subspan(at, length);
        if (op == kOpDecorate) module.decorations[{words[1], kWhole, words[2]}] = length > 3 ? words[3] : 0;
        if (op == kOpMemberDecorate)
            module.decorations[{words[1], words[2], words[3]}] = length > 4 ? words[4] : 0;
        if (op >= kOpTypeInt && op <= kOpTypePointer) module.declared[words[1]] = words;
        if (op == kOpConstant) module.declared[words[2]] = words;
        if (op == kOpCapability && words[1] == kGroupNonUniform) module.uses_subgroups = true;
        if (op == kOpVariable) module.variables.push_back(words);
        at += length;
    }
    return module;
}

/// Bytes up to the end of a type's last member.
uint32_t size_of(const Module& module, uint32_t type) {
    const Words words = module.declared.at(type);
    uint32_t end = 0;
    switch (words[0] & 0xffff) {
        case kOpTypeInt:
        case kOpTypeFloat:
            return words[2] / 8;
        case kOpTypeVector:
            return words[3] * size_of(module, words[2]);
        case kOpTypeArray:
            return module.declared.at(words[3])[3] * module.decorations.at({type, kWhole, kArrayStride});
        case kOpTypeStruct:
            for (uint32_t member = 0; member + 2 < words.size(); ++member)
                end = std::max(
                    end, module.decorations.at({type, member, kOffset}) + size_of(module, words[member + 2]));
            return end;
        default:
            throw std::logic_error("a push constant of a type this project does not use");
    }
}

Access storage_access(const Module& module, uint32_t variable, uint32_t type) {
    const auto members = uint32_t(module.declared.at(type).size() - 2);
    const auto decorated = [&](uint32_t decoration) {
        uint32_t count = 0;
        for (uint32_t member = 0; member < members; ++member)
            count += uint32_t(module.decorations.count({type, member, decoration}));
        return (members > 0 && count == members) || module.decorations.count({variable, kWhole, decoration});
    };
    return decorated(kNonWritable)   ? Access::read
           : decorated(kNonReadable) ? Access::write
                                     : Access::read_write;
}

}  // namespace

Reflection reflect(std::span<const uint32_t> spirv) {
    const Module module = parse(spirv);
    Reflection result;
    for (const Words variable : module.variables) {
        const uint32_t type = module.declared.at(variable[1])[3], id = variable[2], storage = variable[3];
        if (storage == kPushConstant) result.push_constant_bytes = size_of(module, type);
        const auto binding = module.decorations.find({id, kWhole, kBinding});
        if (binding == module.decorations.end()) continue;
        const auto set = module.decorations.find({id, kWhole, kDescriptorSet});
        if (set != module.decorations.end() && set->second != 0)
            throw std::logic_error("a binding outside set 0");
        const uint32_t op = module.declared.at(type)[0] & 0xffff;
        if (storage == kUniformConstant && (op == kOpTypeImage || op == kOpTypeSampledImage))
            result.bindings.push_back({binding->second, BindingKind::texel, Access::read});
        else if (storage == kUniform)
            result.bindings.push_back({binding->second, BindingKind::uniform, Access::read});
        else if (storage == kStorageBuffer)
            result.bindings.push_back(
                {binding->second, BindingKind::storage, storage_access(module, id, type)});
        else
            throw std::logic_error("a binding of a kind this project does not use");
    }
    std::ranges::sort(result.bindings, {}, &Binding::binding);
    for (uint32_t i = 0; i < result.bindings.size(); ++i)
        if (result.bindings[i].binding != i) throw std::logic_error("bindings are not numbered without gaps");
    for (const auto& [key, operand] : module.decorations)
        if (key[2] == kSpecId) result.constants.push_back(operand);
    std::ranges::sort(result.constants);
    result.uses_subgroups = module.uses_subgroups;
    return result;
}

std::vector<uint32_t> with_values(std::span<const uint32_t> spirv,
                                  const std::vector<SpecConstant>& constants) {
    const Module module = parse(spirv);
    std::vector<uint32_t> code(spirv.begin(), spirv.end());
    for (size_t at = 5; at < code.size(); at += code[at] >> 16) {
        if ((code[at] & 0xffff) != kOpSpecConstant) continue;
        const auto id = module.decorations.find({code[at + 2], kWhole, kSpecId});
        if (id == module.decorations.end()) continue;
        for (const SpecConstant& constant : constants)
            if (constant.id == id->second) code[at + 3] = constant.value;
    }
    return code;
}

std::vector<uint32_t> with_float_modes(std::span<const uint32_t> spirv, const FloatModes& modes) {
    std::vector<FloatMode> asked;
    if (modes.special_values) asked.push_back(kSignedZeroInfNanPreserve);
    if (modes.denormals) asked.push_back(kDenormPreserve);
    std::vector<uint32_t> code(spirv.begin(), spirv.begin() + 5);
    // A module begins with its capabilities. Execution modes follow the entry points.
    for (const FloatMode& mode : asked) code.insert(code.end(), {2u << 16 | kOpCapability, mode.capability});
    uint32_t entry = 0;
    for (size_t at = 5; at < spirv.size(); at += spirv[at] >> 16) {
        const Words words = spirv.subspan(at, spirv[at] >> 16);
        const bool is_entry = (words[0] & 0xffff) == kOpEntryPoint;
        if (entry && !is_entry) {
            for (const FloatMode& mode : asked)
                code.insert(code.end(), {4u << 16 | kOpExecutionMode, entry, mode.execution_mode, 32u});
            entry = 0;
        }
        if (is_entry) entry = words[2];
        code.insert(code.end(), words.begin(), words.end());
    }
    return code;
}

vk::DescriptorType descriptor_type(BindingKind kind) {
    return kind == BindingKind::uniform ? vk::DescriptorType::eUniformBuffer
           : kind == BindingKind::texel ? vk::DescriptorType::eUniformTexelBuffer
                                        : vk::DescriptorType::eStorageBuffer;
}

namespace {

vk::UniquePipeline compile(Device& device, const std::string& name, const std::vector<uint32_t>& words,
                           const std::vector<SpecConstant>& constants, std::optional<uint32_t> lanes,
                           vk::PipelineLayout layout) {
    try {
        vk::ShaderModuleCreateInfo code;
        code.setCode(words);
        const auto module = device.handle().createShaderModuleUnique(code);
        std::vector<vk::SpecializationMapEntry> entries;
        for (uint32_t i = 0; i < constants.size(); ++i)
            entries.emplace_back(constants[i].id, i * uint32_t(sizeof(SpecConstant)) + 4, 4);
        const vk::SpecializationInfo specialization(uint32_t(entries.size()), entries.data(),
                                                    constants.size() * sizeof(SpecConstant),
                                                    constants.data());
        vk::PipelineShaderStageRequiredSubgroupSizeCreateInfoEXT size(lanes.value_or(0));
        vk::ComputePipelineCreateInfo create;
        create.stage.setStage(vk::ShaderStageFlagBits::eCompute).setModule(*module).setPName("main");
        create.stage.setPSpecializationInfo(&specialization);
        if (lanes) {
            create.stage.setPNext(&size);
            create.stage.setFlags(vk::PipelineShaderStageCreateFlagBits::eRequireFullSubgroupsEXT);
        }
        create.setLayout(layout);
        return std::move(device.handle().createComputePipelineUnique(device.pipeline_cache(), create).value);
    } catch (const vk::SystemError& error) {
        throw RunError("shader " + name + ": " + error.what());
    }
}

}  // namespace

Pipeline::Pipeline(Device& device, std::string name, std::span<const uint32_t> spirv,
                   const std::vector<SpecConstant>& constants)
    : name_(std::move(name)), reflection_(reflect(spirv)) {
    for (const uint32_t id : reflection_.constants)
        if (std::none_of(constants.begin(), constants.end(), [&](const auto& c) { return c.id == id; }))
            throw std::logic_error("shader " + name_ + ": specialisation constant " + std::to_string(id) +
                                   " is not given");
    try {
        std::vector<vk::DescriptorSetLayoutBinding> bindings;
        for (const Binding& binding : reflection_.bindings)
            bindings.emplace_back(binding.binding, descriptor_type(binding.kind), 1,
                                  vk::ShaderStageFlagBits::eCompute);
        vk::DescriptorSetLayoutCreateInfo set;
        set.setBindings(bindings);
        set_layout_ = device.handle().createDescriptorSetLayoutUnique(set);
        const vk::PushConstantRange push(vk::ShaderStageFlagBits::eCompute, 0,
                                         reflection_.push_constant_bytes);
        vk::PipelineLayoutCreateInfo layout;
        layout.setSetLayouts(*set_layout_);
        if (reflection_.push_constant_bytes) layout.setPushConstantRanges(push);
        layout_ = device.handle().createPipelineLayoutUnique(layout);
    } catch (const vk::SystemError& error) {
        throw RunError("shader " + name_ + ": " + error.what());
    }
    // Without subgroup operations, the driver knows best how wide the shader runs.
    const auto lanes = device.subgroup_size_control() && reflection_.uses_subgroups
                           ? std::optional(device.limits().subgroup_size)
                           : std::nullopt;
    // A CPU has no more cores than its compiler fills: the store has threads for them.
    pipeline_ = std::async(
        device.limits().cpu ? std::launch::deferred : std::launch::async, compile, std::ref(device), name_,
        with_float_modes(with_values(spirv, constants), device.float_modes()), constants, lanes, *layout_);
}

// One core is left to the thread that needs the kernels. It has other work first, or compiles those that have not begun.
PipelineStore::PipelineStore() : threads_(std::max(2u, std::thread::hardware_concurrency()) - 1) {}

const Pipeline& PipelineStore::get(Device& device, const std::string& name, std::span<const uint32_t> spirv,
                                   const std::vector<SpecConstant>& constants) {
    const std::lock_guard lock(mutex_);
    const std::pair key(spirv.data(), constants);
    const auto found = pipelines_.find(key);
    if (found != pipelines_.end()) return found->second;
    const Pipeline& made = pipelines_.emplace(key, Pipeline(device, name, spirv, constants)).first->second;
    if (device.limits().cpu) threads_.add(spirv.size(), made.compilation());
    return made;
}

size_t PipelineStore::count() const {
    const std::lock_guard lock(mutex_);
    return pipelines_.size();
}

}  // namespace ewa::gpu
