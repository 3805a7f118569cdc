// SPDX-License-Identifier: Apache-2.0
// What is asked of devices that this machine does not have: queues, float modes, and what they are said to lack.
#include <gtest/gtest.h>

#include <numeric>

#include "gpu/capabilities.h"
#include "gpu/choose.h"
#include "gpu/pipeline.h"
#include "gpu/test_device.h"
#include "passes/shader_code.h"

namespace ewa::test {
namespace {

using Queue = vk::QueueFlagBits;

std::optional<uint32_t> family_of(const std::vector<vk::QueueFlags>& flags, bool own_queue) {
    std::vector<vk::QueueFamilyProperties> families;
    for (const vk::QueueFlags each : flags) families.emplace_back(each, 1);
    return gpu::compute_family(families, own_queue);
}

TEST(ComputeFamily, PrefersOneWithoutGraphics) {
    const vk::QueueFlags all = Queue::eGraphics | Queue::eCompute | Queue::eTransfer;
    const vk::QueueFlags compute = Queue::eCompute | Queue::eTransfer;
    EXPECT_EQ(family_of({all, Queue::eTransfer, compute}, true), 2u);  // NVIDIA
    EXPECT_EQ(family_of({all, Queue::eTransfer, compute}, false), 0u);
    EXPECT_EQ(family_of({Queue::eGraphics, compute, compute, all}, true), 1u);
    EXPECT_EQ(family_of({all}, true), 0u);  // lavapipe
    EXPECT_EQ(family_of({Queue::eTransfer, all, all}, true), 1u);
    EXPECT_FALSE(family_of({Queue::eGraphics, Queue::eTransfer}, true));
    EXPECT_FALSE(family_of({Queue::eGraphics, Queue::eTransfer}, false));
    EXPECT_FALSE(family_of({}, true));
}

DeviceInfo device_of(int index, const char* name, const char* type, const char* unusable = "") {
    DeviceInfo info;
    info.index = index, info.name = name, info.type = type, info.unusable = unusable;
    return info;
}

TEST(ChosenDevice, IsOfTheBestType) {
    const std::vector<DeviceInfo> infos = {
        device_of(0, "lavapipe", "cpu"), device_of(1, "Iris", "integrated"),
        device_of(2, "old", "discrete", "Vulkan 1.2"), device_of(3, "H200", "discrete")};
    EXPECT_EQ(gpu::choose_device(infos, "").index, 3);
    EXPECT_EQ(gpu::choose_device(infos, "iris").index, 1);
    EXPECT_EQ(gpu::choose_device(infos, "0").index, 0);
    EXPECT_THROW(gpu::choose_device(infos, "old"), InputError);
    EXPECT_THROW(gpu::choose_device(infos, "4"), InputError);
    EXPECT_THROW(gpu::choose_device({}, ""), InputError);
}

/// A GPU of another kind, or with another driver, would compute other bytes.
TEST(ChosenDevice, IsAnotherOneOfItsKindForEachProcess) {
    std::vector<DeviceInfo> infos = {device_of(0, "lavapipe", "cpu"), device_of(1, "H200", "discrete"),
                                     device_of(2, "A2", "discrete"), device_of(3, "H200", "discrete"),
                                     device_of(4, "H200", "discrete")};
    infos[4].driver = "another";
    const int chosen[] = {1, 3, 1, 3};
    for (int process = 0; process < 4; ++process) {
        EXPECT_EQ(gpu::choose_device(infos, "", process).index, chosen[process]);
        EXPECT_EQ(gpu::choose_device(infos, "h200", process).index, chosen[process]);
        EXPECT_EQ(gpu::choose_device(infos, "a2", process).index, 2);
        EXPECT_EQ(gpu::choose_device(infos, "4", process).index, 4);
        EXPECT_EQ(gpu::choose_device(infos, "pipe", process).index, 0);
    }
}

TEST(FloatModesOf, AskForWhatTheDeviceHasAlone) {
    vk::PhysicalDeviceFloatControlsProperties properties;
    properties.denormBehaviorIndependence = vk::ShaderFloatControlsIndependence::e32BitOnly;
    EXPECT_EQ(gpu::float_modes_of(properties), (gpu::FloatModes{false, false}));
    properties.shaderSignedZeroInfNanPreserveFloat32 = true;
    EXPECT_EQ(gpu::float_modes_of(properties), (gpu::FloatModes{true, false}));
    properties.shaderDenormPreserveFloat32 = true;
    EXPECT_EQ(gpu::float_modes_of(properties), (gpu::FloatModes{true, true}));
    properties.denormBehaviorIndependence = vk::ShaderFloatControlsIndependence::eNone;
    EXPECT_EQ(gpu::float_modes_of(properties), (gpu::FloatModes{true, false}));
}

TEST(FloatModesOf, AreAskedOfGpusAlone) {
    const auto own = open_test_device(false);
    gpu::Limits limits = own->limits();
    EXPECT_EQ(limits.exact_floats, !limits.cpu);
    limits.exact_floats = false;
    own->pretend(limits);
    EXPECT_EQ(own->float_modes(), gpu::FloatModes{});
    limits.exact_floats = true;
    own->pretend(limits);
    const auto there =
        own->physical()
            .getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceFloatControlsProperties>()
            .get<vk::PhysicalDeviceFloatControlsProperties>();
    EXPECT_EQ(own->float_modes(), gpu::float_modes_of(there));
}

/// The instructions of a module with an opcode, each without its first word.
std::vector<std::vector<uint32_t>> instructions(std::span<const uint32_t> spirv, uint32_t opcode) {
    std::vector<std::vector<uint32_t>> found;
    for (size_t at = 5; at < spirv.size(); at += spirv[at] >> 16)
        if ((spirv[at] & 0xffff) == opcode)
            found.emplace_back(spirv.begin() + long(at) + 1, spirv.begin() + long(at + (spirv[at] >> 16)));
    return found;
}

// With EWA_TEST_KERNELS=gpu, the validation layer of the other tests checks where the instructions stand.
TEST(WithFloatModes, AddsACapabilityAndAnExecutionModeEach) {
    constexpr uint32_t kEntryPoint = 15, kExecutionMode = 16, kCapability = 17, kSpirv14 = 0x00010400;
    for (const std::string_view name : passes::shader_names()) {
        SCOPED_TRACE(std::string(name));
        const auto spirv = passes::shader_code(name, true);
        EXPECT_GE(spirv[1], kSpirv14);  // older modules need an extension too
        EXPECT_EQ(gpu::with_float_modes(spirv, {}), std::vector<uint32_t>(spirv.begin(), spirv.end()));
        const uint32_t entry = instructions(spirv, kEntryPoint).at(0).at(1);
        const std::vector<uint32_t> special = gpu::with_float_modes(spirv, {.special_values = true}),
                                    both = gpu::with_float_modes(spirv, {true, true});
        auto capabilities = instructions(spirv, kCapability), modes = instructions(spirv, kExecutionMode);
        capabilities.insert(capabilities.begin(), {4466});
        modes.insert(modes.begin(), {entry, 4461, 32});
        EXPECT_EQ(special.size(), spirv.size() + 6);
        EXPECT_EQ(instructions(special, kCapability), capabilities);
        EXPECT_EQ(instructions(special, kExecutionMode), modes);
        capabilities.insert(capabilities.begin() + 1, {4464});
        modes.insert(modes.begin() + 1, {entry, 4459, 32});
        EXPECT_EQ(both.size(), spirv.size() + 12);
        EXPECT_EQ(instructions(both, kCapability), capabilities);
        EXPECT_EQ(instructions(both, kExecutionMode), modes);
    }
}

TEST(Validation, OnlyTheMessageOfTheLoaderIsIgnored) {
    const auto own = open_test_device(false);
    const std::string of_the_loader =
        "vkGetDeviceProcAddr(): pName is trying to grab "
        "vkGetPhysicalDeviceVideoEncodeQualityLevelPropertiesKHR which is an instance level function";
    own->add_validation_message(of_the_loader);
    EXPECT_NO_THROW(own->check_validation());
    own->add_validation_message("Validation Error: [ UNASSIGNED ] | " + of_the_loader);
    EXPECT_NO_THROW(own->check_validation());
    own->add_validation_message(
        "vkGetDeviceProcAddr(): pName is trying to grab vkCreateInstance which is an instance level "
        "function");
    EXPECT_THROW(own->check_validation(), RunError);
    EXPECT_NO_THROW(own->check_validation());
}

TEST(LacksOf, NamesEachPartOnceWithItsConsequence) {
    const gpu::OptionalParts whole{.cpu = false,
                                   .subgroups = {.lanes = 32, .controlled = true},
                                   .ballots = true,
                                   .floats = {true, true},
                                   .timestamps = true,
                                   .own_queue = true,
                                   .cached_memory = true};
    EXPECT_TRUE(gpu::lacks_of(whole).empty());
    const auto lacks = [&](auto change) {
        gpu::OptionalParts parts = whole;
        change(parts);
        const auto list = gpu::lacks_of(parts);
        return list.empty() ? "" : std::accumulate(list.begin(), list.end(), std::string());
    };
    EXPECT_EQ(lacks([](auto& p) { p.subgroups.controlled = false; }),
              "subgroup size control (kernels run with the lanes that the driver reports)");
    EXPECT_EQ(lacks([](auto& p) { p.ballots = false; }), "subgroup ballots (sorting is slower)");
    EXPECT_EQ(lacks([](auto& p) { p.ballots = false, p.cpu = true; }), "");
    EXPECT_EQ(lacks([](auto& p) { p.floats.special_values = false; }),
              "exact infinities and NaN (broken splats may not be recognised)");
    EXPECT_EQ(lacks([](auto& p) { p.floats.denormals = false; }),
              "exact denormal numbers (values under 1.2e-38 may count as zero)");
    EXPECT_EQ(lacks([](auto& p) { p.timestamps = false; }), "timestamps (no times of single passes)");
    EXPECT_EQ(lacks([](auto& p) { p.own_queue = false; }),
              "a queue for compute alone (training and the desktop wait for each other)");
    EXPECT_EQ(lacks([](auto& p) { p.own_queue = false, p.cpu = true; }), "");
    EXPECT_EQ(lacks([](auto& p) { p.cached_memory = false; }),
              "memory that the host caches (reading results back is slow)");
    EXPECT_EQ(gpu::lacks_of({}).size(), 7u);
}

}  // namespace
}  // namespace ewa::test
