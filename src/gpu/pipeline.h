// SPDX-License-Identifier: Apache-2.0
// One compiled compute shader with its specialisation constants, and the declarations of its SPIR-V module:
// bindings, accesses, push constants. Recordings derive all accesses from these.
#pragma once
#include <compare>
#include <cstdint>
#include <functional>
#include <future>
#include <map>
#include <mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "gpu/compile_threads.h"
#include "gpu/device.h"

namespace ewa::gpu {

enum class Access : uint32_t { read = 1, write = 2, read_write = 3 };
enum class BindingKind { storage, uniform, texel };

struct Binding {
    uint32_t binding = 0;
    BindingKind kind = BindingKind::storage;
    Access access = Access::read_write;
};

struct Reflection {
    std::vector<Binding> bindings;  // of set 0; entry i is binding i
    uint32_t push_constant_bytes = 0;
    std::vector<uint32_t> constants;  // ids of the specialisation constants, ascending
    bool uses_subgroups = false;      // by shuffles, votes or ballots
};

/// Access of a storage block: read if every member is NonWritable, write if every member is NonReadable
/// (GLSL readonly and writeonly), else read_write. Uniform blocks and texel buffers: read. Push constants:
/// bytes up to the end of the last member. Throws std::logic_error if bindings are not numbered from 0
/// without gaps, or for a module of a kind that this project does not produce.
Reflection reflect(std::span<const uint32_t> spirv);

struct SpecConstant {
    uint32_t id = 0;
    uint32_t value = 0;
    auto operator<=>(const SpecConstant&) const = default;
};

/// The module with these values as its constants' defaults. MoltenVK before 1.3 sizes arrays by the defaults whatever a
/// pipeline says. All constants are 32 bits wide.
std::vector<uint32_t> with_values(std::span<const uint32_t> spirv,
                                  const std::vector<SpecConstant>& constants);

/// The module with an entry point that requests these modes of 32-bit floats. SPIR-V has the modes from version 1.4 on.
std::vector<uint32_t> with_float_modes(std::span<const uint32_t> spirv, const FloatModes& modes);

class Pipeline {
  public:
    /// constants: those that the shader does not declare are ignored. Throws std::logic_error if one that it
    /// declares is missing. It is compiled in a thread of its own, as a GPU's compiler takes up to a second a shader. On a CPU
    /// device, the first that waits for it compiles it.
    Pipeline(Device& device, std::string name, std::span<const uint32_t> spirv,
             const std::vector<SpecConstant>& constants);

    const std::string& name() const { return name_; }
    const Reflection& reflection() const { return reflection_; }
    /// Waits for the compiler. Throws RunError, which names the shader, if the driver refuses it.
    vk::Pipeline handle() const { return *pipeline_.get(); }
    vk::PipelineLayout layout() const { return *layout_; }
    vk::DescriptorSetLayout set_layout() const { return *set_layout_; }
    /// A function that compiles the pipeline, or waits until it is compiled. It does not report errors; handle() throws them.
    std::function<void()> compilation() const {
        return [pipeline = pipeline_] { pipeline.wait(); };
    }

  private:
    std::string name_;
    Reflection reflection_;
    vk::UniqueDescriptorSetLayout set_layout_;
    vk::UniquePipelineLayout layout_;
    std::shared_future<vk::UniquePipeline> pipeline_;
};

/// The pipelines of a device, which live as long as the device. Each is compiled once, for all users of the device. A CPU
/// device compiles on all cores but one. Calls may come from any thread.
class PipelineStore {
  public:
    PipelineStore();
    /// spirv: a module that outlives the device; its address identifies it. Throws as Pipeline's constructor does.
    const Pipeline& get(Device& device, const std::string& name, std::span<const uint32_t> spirv,
                        const std::vector<SpecConstant>& constants);
    /// The number of pipelines that get() has created so far.
    size_t count() const;

  private:
    mutable std::mutex mutex_;
    std::map<std::pair<const uint32_t*, std::vector<SpecConstant>>, Pipeline> pipelines_;
    CompileThreads threads_;  // last: they end before the pipelines do
};

vk::DescriptorType descriptor_type(BindingKind kind);

}  // namespace ewa::gpu
