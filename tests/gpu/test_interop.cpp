// SPDX-License-Identifier: Apache-2.0
// libewa on a caller's instance, device and queue, and renders in the caller's images and buffers. The validation layer listens to
// all of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <vector>
#include <vulkan/vulkan.hpp>

#include "ewa/error.h"
#include "ewa/gpu_interop.h"
#include "ewa/renderer.h"
#include "gpu/reference_inputs.h"
#include "gpu/test_device.h"
#include "support/image_difference.h"
#include "support/temp_folder.h"

namespace ewa::test {
namespace {

std::vector<std::string> heard;  // from the layer

VKAPI_ATTR VkBool32 VKAPI_CALL hear(VkDebugUtilsMessageSeverityFlagBitsEXT, VkDebugUtilsMessageTypeFlagsEXT,
                                    const VkDebugUtilsMessengerCallbackDataEXT* data, void*) {
    heard.emplace_back(data->pMessage);
    return VK_FALSE;
}

/// A program with a device of its own.
class Engine {
  public:
    /// all: with everything that DeviceNeeds names; else with what kernels cannot do without. own: features of Vulkan 1.3 that
    /// the program uses itself.
    explicit Engine(bool all = true, VkPhysicalDeviceVulkan13Features* own = nullptr) {
        heard.clear();
        const vk::ApplicationInfo application("engine", 1, nullptr, 0, VK_API_VERSION_1_3);
        std::vector<const char*> layers;
        if (with_validation()) layers.push_back("VK_LAYER_KHRONOS_validation");
        const char* extension = VK_EXT_DEBUG_UTILS_EXTENSION_NAME;
        instance_ = vk::createInstanceUnique(vk::InstanceCreateInfo({}, &application, layers, extension));
        VkDebugUtilsMessengerCreateInfoEXT listen{};
        listen.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT;
        listen.messageSeverity =
            VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
        listen.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT;
        listen.pfnUserCallback = hear;
        function<PFN_vkCreateDebugUtilsMessengerEXT>("vkCreateDebugUtilsMessengerEXT")(*instance_, &listen,
                                                                                       nullptr, &messenger_);
        const auto devices = instance_->enumeratePhysicalDevices();
        physical_ = devices.at(size_t(device()->info().index));
        needs_.emplace(physical_);
        needs_->vulkan12.timelineSemaphore = true;
        if (!all) {
            needs_->extensions.clear();
            needs_->features.features = {};
            needs_->vulkan12.pNext = nullptr;
        }
        if (own) needs_->use(*own);
        family_ = device()->queue_family();
        // The layer objects to a family if this instance did not list the device's families.
        if (family_ >= physical_.getQueueFamilyProperties().size())
            throw std::runtime_error("no such queue family");
        queue_info_.setQueueFamilyIndex(family_).setQueueCount(1).setPQueuePriorities(&priority_);
        info_.setQueueCreateInfos(queue_info_)
            .setPEnabledExtensionNames(needs_->extensions)
            .setPNext(&needs_->features);
        device_ = physical_.createDeviceUnique(info_);
    }
    ~Engine() {
        device_.reset();
        function<PFN_vkDestroyDebugUtilsMessengerEXT>("vkDestroyDebugUtilsMessengerEXT")(*instance_,
                                                                                         messenger_, nullptr);
    }
    Engine(const Engine&) = delete;

    VulkanDevice handles() const {
        VulkanDevice own;
        own.instance = *instance_;
        own.physical = physical_;
        own.device = *device_;
        own.queue = device_->getQueue(family_, 0);
        own.queue_family = family_;
        own.created_with = &static_cast<const VkDeviceCreateInfo&>(info_);
        return own;
    }
    /// With the kernels that the tests ask for.
    std::shared_ptr<gpu::Device> borrowed() const {
        std::shared_ptr<gpu::Device> made = borrow_device(handles());
        const char* kernels = std::getenv("EWA_TEST_KERNELS");
        if (kernels && std::string_view(kernels) == "gpu") pretend_gpu(*made);
        return made;
    }
    vk::Device handle() const { return *device_; }

    vk::UniqueDeviceMemory allocate(const vk::MemoryRequirements& needs, bool mapped) const {
        const auto wanted =
            mapped ? vk::MemoryPropertyFlagBits::eHostVisible | vk::MemoryPropertyFlagBits::eHostCoherent
                   : vk::MemoryPropertyFlags();
        const auto memory = physical_.getMemoryProperties();
        for (uint32_t i = 0; i < memory.memoryTypeCount; ++i)
            if ((needs.memoryTypeBits & (1u << i)) &&
                (memory.memoryTypes[i].propertyFlags & wanted) == wanted)
                return device_->allocateMemoryUnique({needs.size, i});
        throw std::runtime_error("no memory");
    }
    /// Runs commands on the queue and waits.
    template <class Record>
    void run(Record record, vk::Semaphore signal = {}) const {
        const auto pool = device_->createCommandPoolUnique({{}, family_});
        const auto commands = std::move(
            device_->allocateCommandBuffersUnique({*pool, vk::CommandBufferLevel::ePrimary, 1}).front());
        commands->begin(vk::CommandBufferBeginInfo{});
        record(*commands);
        commands->end();
        vk::SubmitInfo submit;
        submit.setCommandBuffers(*commands);
        if (signal) submit.setSignalSemaphores(signal);
        const auto done = device_->createFenceUnique({});
        device_->getQueue(family_, 0).submit(submit, *done);
        (void)device_->waitForFences(*done, true, UINT64_MAX);
    }

  private:
    template <class Function>
    Function function(const char* name) const {
        return reinterpret_cast<Function>(instance_->getProcAddr(name));
    }

    vk::UniqueInstance instance_;
    VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
    vk::PhysicalDevice physical_;
    std::optional<DeviceNeeds> needs_;
    uint32_t family_ = 0;
    float priority_ = 1;
    vk::DeviceQueueCreateInfo queue_info_;
    vk::DeviceCreateInfo info_;
    vk::UniqueDevice device_;
};

/// A buffer that the host sees, of bytes 0xa5.
struct HostBytes {
    vk::UniqueBuffer buffer;
    vk::UniqueDeviceMemory memory;
    std::byte* mapped;
    uint64_t size;

    HostBytes(const Engine& engine, uint64_t bytes) : size(bytes) {
        buffer = engine.handle().createBufferUnique(
            {{}, bytes, vk::BufferUsageFlagBits::eTransferDst | vk::BufferUsageFlagBits::eTransferSrc});
        memory = engine.allocate(engine.handle().getBufferMemoryRequirements(*buffer), true);
        engine.handle().bindBufferMemory(*buffer, *memory, 0);
        mapped = static_cast<std::byte*>(engine.handle().mapMemory(*memory, 0, VK_WHOLE_SIZE));
        std::memset(mapped, 0xa5, bytes);
    }
    template <class Value>
    Value at(uint64_t byte) const {
        Value value;
        std::memcpy(&value, mapped + byte, sizeof(Value));
        return value;
    }
    DeviceTarget target(VkFormat format, uint64_t begin = 0, uint64_t row = 0) const {
        return {format, DeviceBuffer{*buffer, size, begin, row}};
    }
};

constexpr uint32_t kLevel = 1, kLayer = 2;

/// Three layers of two mip levels. Level 1 has the size.
struct Picture {
    vk::Format format;
    VkExtent2D size;
    vk::UniqueImage image;
    vk::UniqueDeviceMemory memory;

    Picture(const Engine& engine, vk::Format f, uint32_t width, uint32_t height)
        : format(f), size{width, height} {
        vk::ImageCreateInfo create;
        create.setImageType(vk::ImageType::e2D)
            .setFormat(format)
            .setExtent({2 * width, 2 * height, 1})
            .setMipLevels(2)
            .setArrayLayers(3)
            .setUsage(vk::ImageUsageFlagBits::eTransferDst | vk::ImageUsageFlagBits::eTransferSrc);
        image = engine.handle().createImageUnique(create);
        memory = engine.allocate(engine.handle().getImageMemoryRequirements(*image), false);
        engine.handle().bindImageMemory(*image, *memory, 0);
    }
    DeviceTarget target(int x, int y) const {
        DeviceImage to;
        to.image = *image;
        to.size = size;
        to.place = {x, y};
        to.mip_level = kLevel;
        to.array_layer = kLayer;
        to.layout_after = VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL;
        return {VkFormat(format), to};
    }
    void read(const Engine& engine, const HostBytes& to) const {
        engine.run([&](vk::CommandBuffer commands) {
            commands.copyImageToBuffer(
                *image, vk::ImageLayout::eTransferSrcOptimal, *to.buffer,
                vk::BufferImageCopy(0, 0, 0, {vk::ImageAspectFlagBits::eColor, kLevel, kLayer, 1}, {},
                                    {size.width, size.height, 1}));
        });
    }
};

void expect_silence() {
    EXPECT_TRUE(heard.empty()) << heard.front();
}

int byte_of(float value) {
    return int(std::clamp(value, 0.0f, 1.0f) * 255 + 0.5f);
}

constexpr uint32_t kDrawnWidth = 61, kDrawnHeight = 47;  // neither a multiple of a tile nor of a texel

struct Drawn {
    Scene scene = random_scene(46, 200, SplatKind::ordinary, int(kDrawnWidth), int(kDrawnHeight));
    DrawOptions options{};

    Drawn() {
        for (float& value : scene.gaussians.sh) value *= 2;  // beyond white too
        options.render = scene.options;
        options.drawing = Drawing::depth;
    }
};

float value_of(const Rendering& host, size_t pixel, size_t channel) {
    return channel < 3 ? host.color.pixels[3 * pixel + channel] : host.alpha.pixels[pixel];
}

TEST(Interop, ImagesAndBuffersHoldTheRender) {
    const Engine engine;
    const Drawn drawn;
    {
        Renderer renderer(engine.borrowed(), drawn.scene.gaussians, drawn.scene.options);
        const Picture floats(engine, vk::Format::eR32G32B32A32Sfloat, kDrawnWidth + 5, kDrawnHeight + 7),
            bytes(engine, vk::Format::eR8G8B8A8Srgb, kDrawnWidth, kDrawnHeight);
        constexpr uint64_t kBegin = 12, kRow = 4 * kDrawnWidth + 20;
        const HostBytes rows(engine, kBegin + kRow * kDrawnHeight),
            depth(engine, 4 * kDrawnWidth * kDrawnHeight);
        const std::vector<DeviceTarget> targets{floats.target(3, 2), bytes.target(0, 0),
                                                rows.target(VK_FORMAT_R8G8B8A8_UNORM, kBegin, kRow),
                                                depth.target(VK_FORMAT_R32_SFLOAT)};
        render_to(renderer, drawn.scene.camera, drawn.options, targets);
        render_to(renderer, drawn.scene.camera, drawn.options, targets);  // again, over what is there

        const HostBytes all_floats(engine, 16ull * floats.size.width * floats.size.height),
            all_bytes(engine, 4 * kDrawnWidth * kDrawnHeight);
        floats.read(engine, all_floats);
        bytes.read(engine, all_bytes);
        const Rendering host = renderer.render(drawn.scene.camera, drawn.options);
        size_t transparent = 0;
        for (size_t y = 0; y < kDrawnHeight; ++y)
            for (size_t x = 0; x < kDrawnWidth; ++x) {
                const size_t i = y * kDrawnWidth + x;
                for (size_t c = 0; c < 4; ++c) {
                    const float value = value_of(host, i, c);
                    const size_t at = 4 * (((y + 2) * floats.size.width + x + 3) * 4 + c);
                    ASSERT_EQ(all_floats.at<float>(at), value) << x << " " << y << " " << c;
                    ASSERT_EQ(int(all_bytes.at<uint8_t>(4 * i + c)), byte_of(value))
                        << x << " " << y << " " << c;
                    ASSERT_EQ(int(rows.at<uint8_t>(kBegin + y * kRow + 4 * x + c)), byte_of(value));
                }
                transparent += host.alpha.pixels[i] < 0.9f;
                const float wanted = host.depth.pixels[i];
                ASSERT_NEAR(depth.at<float>(4 * i), wanted, 1e-6f * std::abs(wanted)) << x << " " << y;
            }
        EXPECT_GT(transparent, 10u);
        // Around the rows nothing is written.
        for (uint64_t y = 0; y + 1 < kDrawnHeight; ++y)
            for (uint64_t at = kBegin + y * kRow + 4 * kDrawnWidth; at < kBegin + (y + 1) * kRow; ++at)
                ASSERT_EQ(rows.at<uint8_t>(at), 0xa5);
        EXPECT_EQ(rows.at<uint8_t>(kBegin - 1), 0xa5);
    }
    expect_silence();
}

TEST(Interop, ABorrowedDeviceDrawsWhatAnOwnOneDraws) {
    const Engine engine;
    const Drawn drawn;
    const std::shared_ptr<gpu::Device> borrowed = engine.borrowed();
    EXPECT_EQ(device_info(*borrowed).name, device_info(*device()).name);
    EXPECT_EQ(device_info(*borrowed).lacks, device_info(*device()).lacks);
    Renderer there(borrowed, drawn.scene.gaussians, drawn.scene.options),
        here(device(), drawn.scene.gaussians, drawn.scene.options);
    EXPECT_EQ(there.render(drawn.scene.camera).color.pixels, here.render(drawn.scene.camera).color.pixels);
    expect_silence();
}

TEST(Interop, AFeatureThatIsNotNeededMayBeOff) {
    const Engine engine(false);
    const Drawn drawn;
    const std::shared_ptr<gpu::Device> borrowed = engine.borrowed();
    const auto lacks = device_info(*borrowed).lacks;
    EXPECT_TRUE(std::ranges::any_of(
        lacks, [](const std::string& text) { return text.starts_with("subgroup size control"); }));
    Renderer there(borrowed, drawn.scene.gaussians, drawn.scene.options),
        here(device(), drawn.scene.gaussians, drawn.scene.options);
    EXPECT_LT(
        largest_difference(there.render(drawn.scene.camera).color, here.render(drawn.scene.camera).color),
        1e-5);
    expect_silence();
}

TEST(Interop, SemaphoresOrderTheWork) {
    const Engine engine;
    const Drawn drawn;
    Renderer renderer(engine.borrowed(), drawn.scene.gaussians, drawn.scene.options);
    const HostBytes bytes(engine, 4 * kDrawnWidth * kDrawnHeight);
    const std::vector<DeviceTarget> targets{bytes.target(VK_FORMAT_R8G8B8A8_UNORM)};
    const vk::SemaphoreTypeCreateInfo timeline(vk::SemaphoreType::eTimeline, 4);
    const auto counter = engine.handle().createSemaphoreUnique({{}, &timeline}),
               binary = engine.handle().createSemaphoreUnique({});
    engine.run([](vk::CommandBuffer) {}, *binary);
    DeviceSync sync;
    sync.wait = *binary;
    sync.signal = *counter;
    sync.signal_value = 7;
    render_to(renderer, drawn.scene.camera, drawn.options, targets, sync);
    // The fence that render_to waits for may be signalled before the semaphore.
    constexpr uint64_t kSecond = 1'000'000'000, kValue = 7;
    EXPECT_EQ(engine.handle().waitSemaphores(vk::SemaphoreWaitInfo({}, *counter, kValue), 10 * kSecond),
              vk::Result::eSuccess);
    EXPECT_EQ(engine.handle().getSemaphoreCounterValue(*counter), kValue);
    sync = {};
    sync.wait = *counter;
    sync.wait_value = 7;
    sync.signal = *binary;
    render_to(renderer, drawn.scene.camera, drawn.options, targets, sync);
    sync = {};
    sync.wait = *binary;
    render_to(renderer, drawn.scene.camera, drawn.options, targets, sync);
    expect_silence();
}

TEST(Interop, TheCallerMaySubmit) {
    const Engine engine;
    const Drawn drawn;
    VulkanDevice own = engine.handles();
    int submissions = 0;
    VkResult result = VK_SUCCESS;
    own.submit = [&, queue = own.queue](const VkSubmitInfo& info, VkFence fence) {
        ++submissions;
        return result == VK_SUCCESS ? vkQueueSubmit(queue, 1, &info, fence) : result;
    };
    Renderer renderer(borrow_device(own), drawn.scene.gaussians, drawn.scene.options);
    renderer.render(drawn.scene.camera);
    EXPECT_GT(submissions, 0);
    result = VK_ERROR_OUT_OF_DEVICE_MEMORY;
    EXPECT_THROW(renderer.render(drawn.scene.camera), RunError);
    result = VK_ERROR_DEVICE_LOST;
    expect_error<RunError>([&] { renderer.render(drawn.scene.camera); }, {"was lost"});
    expect_silence();
}

TEST(Interop, WhatADeviceLacksIsNamed) {
    const Engine engine;
    const auto refused = [](const VulkanDevice& own, std::initializer_list<std::string> parts) {
        expect_error<InputError>([&] { borrow_device(own); }, parts);
    };
    refused({}, {"no instance", "no physical device", "no device", "no queue", "no VkDeviceCreateInfo"});
    VulkanDevice own = engine.handles();
    own.api_version = VK_API_VERSION_1_1;
    own.queue_family = 99;
    VkDeviceCreateInfo nothing{};
    nothing.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
    own.created_with = &nothing;
    refused(own, {"Vulkan before 1.2", "queue family 99 has no compute",
                  "scalarBlockLayout, which is not enabled"});
    own = engine.handles();
    const Engine other;
    own.physical = other.handles().physical;
    refused(own, {"not of the instance"});
    // Each structure that can enable the feature is read.
    own = engine.handles();
    VkPhysicalDeviceScalarBlockLayoutFeatures scalar{
        VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SCALAR_BLOCK_LAYOUT_FEATURES, nullptr, VK_TRUE};
    VkDeviceCreateInfo alone = nothing;
    alone.pNext = &scalar;
    own.created_with = &alone;
    EXPECT_NO_THROW(borrow_device(own));
    scalar.scalarBlockLayout = VK_FALSE;
    refused(own, {"scalarBlockLayout, which is not enabled"});
    expect_error<InputError>([] { const DeviceNeeds needs(VK_NULL_HANDLE); }, {"no physical device"});
    expect_silence();
}

TEST(Interop, AProgramHasFeaturesOfVulkan13) {
    const Drawn drawn;
    VkPhysicalDeviceVulkan13Features own{};
    own.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES;
    own.dynamicRendering = own.synchronization2 = VK_TRUE;
    const Engine engine(true, &own);
    const DeviceNeeds needs(engine.handles().physical);
    EXPECT_EQ(own.subgroupSizeControl, needs.subgroup_sizes.subgroupSizeControl);
    EXPECT_EQ(own.computeFullSubgroups, needs.subgroup_sizes.computeFullSubgroups);
    Renderer renderer(engine.borrowed(), drawn.scene.gaussians, drawn.scene.options);
    const Picture picture(engine, vk::Format::eR8G8B8A8Unorm, kDrawnWidth, kDrawnHeight);
    render_to(renderer, drawn.scene.camera, drawn.options, std::vector<DeviceTarget>{picture.target(0, 0)});
    expect_silence();
}

TEST(Interop, TargetsThatDoNotFitAreRefused) {
    const Engine engine;
    const Drawn drawn;
    Renderer renderer(engine.borrowed(), drawn.scene.gaussians, drawn.scene.options);
    const Picture picture(engine, vk::Format::eR8G8B8A8Unorm, kDrawnWidth, kDrawnHeight);
    const HostBytes bytes(engine, 4 * kDrawnWidth * kDrawnHeight);
    const auto refused = [&](const DeviceTarget& target, const char* part, Drawing drawing = Drawing::color) {
        DrawOptions options = drawn.options;
        options.drawing = drawing;
        // Behind one that fits: that is not written either.
        const std::vector<DeviceTarget> both{bytes.target(VK_FORMAT_R8G8B8A8_UNORM), target};
        expect_error<InputError>([&] { render_to(renderer, drawn.scene.camera, options, both); }, {part});
    };
    const auto changed = [&](auto change) {
        DeviceTarget target = picture.target(0, 0);
        change(std::get<DeviceImage>(target.to));
        return target;
    };
    refused(picture.target(1, 0), "does not fit in an image of 61 x 47 px");
    refused(picture.target(0, 1), "does not fit in an image");
    refused(picture.target(-1, 0), "does not fit in an image");
    refused(changed([](DeviceImage& to) { to.size = {}; }), "does not fit in an image of 0 x 0 px");
    refused(changed([](DeviceImage& to) { to.image = VK_NULL_HANDLE; }), "without an image");
    refused(changed([](DeviceImage& to) { to.layout_after = VK_IMAGE_LAYOUT_UNDEFINED; }), "Undefined");
    refused({VK_FORMAT_R8G8B8A8_UNORM, DeviceBuffer{}}, "without a buffer");
    refused(bytes.target(VK_FORMAT_R8G8B8A8_UNORM, 4), "does not fit in 11468 bytes from byte 4");
    refused(bytes.target(VK_FORMAT_R8G8B8A8_UNORM, 2), "multiples of 4");
    refused(bytes.target(VK_FORMAT_R8G8B8A8_UNORM, 0, 4 * kDrawnWidth - 4), "a row has 244");
    refused(bytes.target(VK_FORMAT_R8G8B8A8_UNORM, 0, ~uint64_t(3)), "does not fit");
    refused(bytes.target(VK_FORMAT_R8G8B8A8_UNORM, ~uint64_t(3)), "does not fit");
    refused(bytes.target(VK_FORMAT_R32G32B32A32_SFLOAT), "does not fit");
    refused(bytes.target(VK_FORMAT_B8G8R8A8_UNORM), "not B8G8R8A8Unorm");
    refused(bytes.target(VK_FORMAT_UNDEFINED), "not Undefined");
    refused(bytes.target(VK_FORMAT_R32_SFLOAT), "needs Drawing::depth");
    refused(bytes.target(VK_FORMAT_R8G8B8A8_UNORM), "median depths and normals", Drawing::normal);
    expect_error<InputError>([&] { render_to(renderer, drawn.scene.camera, drawn.options, {}); },
                             {"no target"});
    EXPECT_EQ(bytes.at<uint32_t>(0), 0xa5a5a5a5u);
    const std::vector<DeviceTarget> fits{bytes.target(VK_FORMAT_R8G8B8A8_UNORM)};
    EXPECT_NO_THROW(render_to(renderer, drawn.scene.camera, drawn.options, fits));
    EXPECT_NE(bytes.at<uint32_t>(0), 0xa5a5a5a5u);
    expect_silence();
}

}  // namespace
}  // namespace ewa::test
