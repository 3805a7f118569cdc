// SPDX-License-Identifier: Apache-2.0
// What all passes share. A pass is a struct that describes one shader:
// - shader: its file in shaders/passes without extension, which is also the name of its timing;
// - group_size(config): invocations of its workgroup;
// - Buffers: gpu::BufferPart members only, in the order of the shader's bindings;
// - Push: its push constants;
// - groups(config, push): its workgroups.
// A pass does not say what it reads or writes: a recording derives that from the shader.
#pragma once
#include <array>
#include <bit>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include "gpu/recording.h"
#include "passes/kernel_config.h"

namespace ewa::passes {

/// One invocation owns one element.
struct ElementPass {
    static uint32_t group_size(const KernelConfig& config) { return config.element_group; }
};
/// One workgroup is one subgroup.
struct SubgroupPass {
    static uint32_t group_size(const KernelConfig& config) { return config.subgroup; }
};

using Constants = std::vector<gpu::SpecConstant>;

/// A compiled pass.
template <class Definition>
struct Pass {
    using Buffers = typename Definition::Buffers;
    using Push = typename Definition::Push;
    const gpu::Pipeline& pipeline;
    const KernelConfig& config;

    void record(gpu::Recording& recording, const Buffers& buffers, const Push& push,
                const char* name = Definition::shader) const {
        record(recording, buffers, push, Definition::groups(config, push), name);
    }
    /// groups: the dispatch's workgroups.
    void record(gpu::Recording& recording, const Buffers& buffers, const Push& push, const Groups& groups,
                const char* name = Definition::shader) const {
        constexpr size_t kParts = sizeof(Buffers) / sizeof(gpu::BufferPart);
        static_assert(sizeof(Buffers) == kParts * sizeof(gpu::BufferPart));
        recording.dispatch(pipeline, name, std::bit_cast<std::array<gpu::BufferPart, kParts>>(buffers),
                           std::as_bytes(std::span(&push, 1)), groups);
    }
};

/// The compiled passes of a device. Each is compiled at its first use.
class PassCache {
  public:
    explicit PassCache(gpu::Device& device) : PassCache(device, config_for(device.limits())) {}
    PassCache(gpu::Device& device, const KernelConfig& config) : device_(device), config_(config) {}
    PassCache(const PassCache&) = delete;

    gpu::Device& device() const { return device_; }
    const KernelConfig& config() const { return config_; }

    /// variant: the shader's specialisation constants (SPEC_*) that the configuration does not set. Throws
    /// std::logic_error if one is missing or the shader does not declare it.
    template <class Definition>
    Pass<Definition> get(const Constants& variant = {}) {
        return {pipeline(Definition::shader, Definition::group_size(config_), variant), config_};
    }

  private:
    const gpu::Pipeline& pipeline(std::string_view shader, uint32_t group_size, const Constants& variant);

    gpu::Device& device_;
    KernelConfig config_;
    std::map<std::pair<std::string_view, Constants>, gpu::Pipeline> pipelines_;
};

}  // namespace ewa::passes
