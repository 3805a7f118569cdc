// SPDX-License-Identifier: Apache-2.0
#include "gpu/pipeline.h"

#include <algorithm>
#include <stdexcept>

#include "ewa/error.h"

namespace ewa::gpu {

vk::DescriptorType descriptor_type(BindingKind kind) {
    switch (kind) {
        case BindingKind::uniform:
            return vk::DescriptorType::eUniformBuffer;
        case BindingKind::texel:
            return vk::DescriptorType::eUniformTexelBuffer;
        default:
            return vk::DescriptorType::eStorageBuffer;
    }
}

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

        vk::ShaderModuleCreateInfo code;
        code.setCodeSize(spirv.size_bytes()).setPCode(spirv.data());
        const auto module = device.handle().createShaderModuleUnique(code);
        std::vector<vk::SpecializationMapEntry> entries;
        for (uint32_t i = 0; i < constants.size(); ++i)
            entries.emplace_back(constants[i].id, i * uint32_t(sizeof(SpecConstant)) + 4, 4);
        const vk::SpecializationInfo specialization(uint32_t(entries.size()), entries.data(),
                                                    constants.size() * sizeof(SpecConstant),
                                                    constants.data());
        vk::PipelineShaderStageRequiredSubgroupSizeCreateInfoEXT size(device.limits().subgroup_size);
        vk::ComputePipelineCreateInfo create;
        create.stage.setStage(vk::ShaderStageFlagBits::eCompute).setModule(*module).setPName("main");
        create.stage.setPSpecializationInfo(&specialization);
        if (device.subgroup_size_control()) {
            create.stage.setPNext(&size);
            create.stage.setFlags(vk::PipelineShaderStageCreateFlagBits::eRequireFullSubgroupsEXT);
        }
        create.setLayout(*layout_);
        pipeline_ = device.handle().createComputePipelineUnique(device.pipeline_cache(), create).value;
    } catch (const vk::SystemError& error) {
        throw RunError("shader " + name_ + ": " + error.what());
    }
}

}  // namespace ewa::gpu
