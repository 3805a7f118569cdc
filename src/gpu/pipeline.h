// SPDX-License-Identifier: Apache-2.0
// One compiled compute shader with its specialisation constants.
#pragma once
#include <compare>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "gpu/device.h"
#include "gpu/reflection.h"

namespace ewa::gpu {

struct SpecConstant {
    uint32_t id = 0;
    uint32_t value = 0;
    auto operator<=>(const SpecConstant&) const = default;
};

class Pipeline {
  public:
    /// constants: those that the shader does not declare are ignored. Throws std::logic_error if one that it
    /// declares is missing, and RunError if the driver refuses the shader; both name the shader.
    Pipeline(Device& device, std::string name, std::span<const uint32_t> spirv,
             const std::vector<SpecConstant>& constants);

    const std::string& name() const { return name_; }
    const Reflection& reflection() const { return reflection_; }
    vk::Pipeline handle() const { return *pipeline_; }
    vk::PipelineLayout layout() const { return *layout_; }
    vk::DescriptorSetLayout set_layout() const { return *set_layout_; }

  private:
    std::string name_;
    Reflection reflection_;
    vk::UniqueDescriptorSetLayout set_layout_;
    vk::UniquePipelineLayout layout_;
    vk::UniquePipeline pipeline_;
};

vk::DescriptorType descriptor_type(BindingKind kind);

}  // namespace ewa::gpu
