// SPDX-License-Identifier: Apache-2.0
// Draws a splat file into this program's own Vulkan image and buffer: interop SPLATS OUT.png [--validate]
//
// libewa runs on the instance, device and queue of this program, and copies nothing to the host. The program then reads its image
// and buffer back itself, to compare them with what Renderer::render gives. --validate turns the Khronos validation layer on; a
// message of it is a failure.
#include <ewa/error.h>
#include <ewa/gpu_interop.h>
#include <ewa/renderer.h>
#include <ewa/splat_files.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string_view>
#include <vulkan/vulkan.hpp>

namespace {

constexpr uint32_t kVersion = VK_API_VERSION_1_3, kWidth = 320, kHeight = 240;
int messages = 0;

VKAPI_ATTR VkBool32 VKAPI_CALL on_message(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                          VkDebugUtilsMessageTypeFlagsEXT,
                                          const VkDebugUtilsMessengerCallbackDataEXT* data, void*) {
    ++messages;
    std::fprintf(stderr, "%s\n", data->pMessage);
    return VK_FALSE;
}

/// What an engine has anyway: an instance, a device, and a queue for graphics and compute.
class Engine {
  public:
    explicit Engine(bool validate) {
        const vk::ApplicationInfo application("interop", 1, nullptr, 0, kVersion);
        const char* layer = "VK_LAYER_KHRONOS_validation";
        const char* extension = VK_EXT_DEBUG_UTILS_EXTENSION_NAME;
        vk::DebugUtilsMessengerCreateInfoEXT listen;
        listen.messageSeverity = vk::DebugUtilsMessageSeverityFlagBitsEXT::eWarning |
                                 vk::DebugUtilsMessageSeverityFlagBitsEXT::eError;
        listen.messageType = vk::DebugUtilsMessageTypeFlagBitsEXT::eValidation;
        listen.pfnUserCallback = decltype(listen.pfnUserCallback)(on_message);
        vk::InstanceCreateInfo create({}, &application);
        if (validate)
            create.setPEnabledLayerNames(layer).setPEnabledExtensionNames(extension).setPNext(&listen);
        instance_ = vk::createInstanceUnique(create);
        if (validate) {
            const auto make =
                PFN_vkCreateDebugUtilsMessengerEXT(instance_->getProcAddr("vkCreateDebugUtilsMessengerEXT"));
            const VkDebugUtilsMessengerCreateInfoEXT& listener = listen;
            make(*instance_, &listener, nullptr, &messenger_);
        }
        physical_ = instance_->enumeratePhysicalDevices().at(0);

        // What libewa uses is enabled with what the engine uses itself: here, timeline semaphores.
        ewa::DeviceNeeds needs(physical_, kVersion);
        needs.vulkan12.timelineSemaphore = true;
        const auto families = physical_.getQueueFamilyProperties();
        const auto family = std::find_if(families.begin(), families.end(), [](const auto& each) {
            return bool(each.queueFlags & vk::QueueFlagBits::eCompute);
        });
        family_ = uint32_t(family - families.begin());
        const float priority = 1;
        const vk::DeviceQueueCreateInfo queue({}, family_, 1, &priority);
        vk::DeviceCreateInfo info;
        info.setQueueCreateInfos(queue).setPEnabledExtensionNames(needs.extensions).setPNext(&needs.features);
        device_ = physical_.createDeviceUnique(info);
        queue_ = device_->getQueue(family_, 0);

        ewa::VulkanDevice own;
        own.instance = *instance_;
        own.physical = physical_;
        own.device = *device_;
        own.queue = queue_;
        own.queue_family = family_;
        own.api_version = kVersion;
        const VkDeviceCreateInfo& created = info;
        own.created_with = &created;
        splats_device_ = ewa::borrow_device(own);
    }
    ~Engine() {
        splats_device_.reset();
        if (!messenger_) return;
        const auto destroy =
            PFN_vkDestroyDebugUtilsMessengerEXT(instance_->getProcAddr("vkDestroyDebugUtilsMessengerEXT"));
        device_.reset();
        destroy(*instance_, messenger_, nullptr);
    }
    Engine(const Engine&) = delete;

    const std::shared_ptr<ewa::gpu::Device>& splats_device() const { return splats_device_; }
    vk::Device device() const { return *device_; }
    vk::Queue queue() const { return queue_; }
    uint32_t family() const { return family_; }

    vk::UniqueDeviceMemory allocate(const vk::MemoryRequirements& needs,
                                    vk::MemoryPropertyFlags wanted) const {
        const auto memory = physical_.getMemoryProperties();
        for (uint32_t i = 0; i < memory.memoryTypeCount; ++i)
            if ((needs.memoryTypeBits & (1u << i)) &&
                (memory.memoryTypes[i].propertyFlags & wanted) == wanted)
                return device_->allocateMemoryUnique({needs.size, i});
        throw ewa::RunError("no memory of a kind");
    }

  private:
    vk::UniqueInstance instance_;
    VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
    vk::PhysicalDevice physical_;
    vk::UniqueDevice device_;
    vk::Queue queue_;
    uint32_t family_ = 0;
    std::shared_ptr<ewa::gpu::Device> splats_device_;
};

/// An image of floats on the device.
struct Picture {
    vk::UniqueImage image;
    vk::UniqueDeviceMemory memory;

    explicit Picture(const Engine& engine) {
        vk::ImageCreateInfo create;
        create.setImageType(vk::ImageType::e2D)
            .setFormat(vk::Format::eR32G32B32A32Sfloat)
            .setExtent({kWidth, kHeight, 1})
            .setMipLevels(1)
            .setArrayLayers(1)
            .setUsage(vk::ImageUsageFlagBits::eTransferDst | vk::ImageUsageFlagBits::eTransferSrc);
        image = engine.device().createImageUnique(create);
        memory = engine.allocate(engine.device().getImageMemoryRequirements(*image), {});
        engine.device().bindImageMemory(*image, *memory, 0);
    }
};

/// A buffer that the host reads.
struct Bytes {
    vk::UniqueBuffer buffer;
    vk::UniqueDeviceMemory memory;
    const void* mapped;

    Bytes(const Engine& engine, vk::DeviceSize size) {
        buffer = engine.device().createBufferUnique({{}, size, vk::BufferUsageFlagBits::eTransferDst});
        memory = engine.allocate(
            engine.device().getBufferMemoryRequirements(*buffer),
            vk::MemoryPropertyFlagBits::eHostVisible | vk::MemoryPropertyFlagBits::eHostCoherent);
        engine.device().bindBufferMemory(*buffer, *memory, 0);
        mapped = engine.device().mapMemory(*memory, 0, VK_WHOLE_SIZE);
    }
};

/// The image's values, by a copy that waits for the semaphore in the way of an engine's next pass.
ewa::Image read_back(const Engine& engine, const Picture& picture, vk::Semaphore drawn, uint64_t value) {
    const Bytes host(engine, 16ull * kWidth * kHeight);
    const auto pool = engine.device().createCommandPoolUnique({{}, engine.family()});
    const auto commands = std::move(
        engine.device().allocateCommandBuffersUnique({*pool, vk::CommandBufferLevel::ePrimary, 1}).front());
    commands->begin(vk::CommandBufferBeginInfo{});
    commands->copyImageToBuffer(
        *picture.image, vk::ImageLayout::eTransferSrcOptimal, *host.buffer,
        vk::BufferImageCopy(0, 0, 0, {vk::ImageAspectFlagBits::eColor, 0, 0, 1}, {}, {kWidth, kHeight, 1}));
    commands->pipelineBarrier(
        vk::PipelineStageFlagBits::eTransfer, vk::PipelineStageFlagBits::eHost, {},
        vk::MemoryBarrier(vk::AccessFlagBits::eTransferWrite, vk::AccessFlagBits::eHostRead), {}, {});
    commands->end();
    const vk::TimelineSemaphoreSubmitInfo values(1, &value);
    const vk::PipelineStageFlags stage = vk::PipelineStageFlagBits::eTransfer;
    vk::SubmitInfo submit;
    submit.setWaitSemaphores(drawn).setWaitDstStageMask(stage).setCommandBuffers(*commands).setPNext(&values);
    const auto done = engine.device().createFenceUnique({});
    engine.queue().submit(submit, *done);
    (void)engine.device().waitForFences(*done, true, UINT64_MAX);
    ewa::Image image(int(kWidth), int(kHeight), 4);
    std::memcpy(image.pixels.data(), host.mapped, 4 * image.pixels.size());
    return image;
}

ewa::Camera camera_before(const ewa::Gaussians& gaussians) {
    double reach = 1e-3;
    for (const float value : gaussians.means)
        if (std::isfinite(value)) reach = std::max(reach, std::abs(double(value)));
    ewa::Camera camera;
    camera.width = int(kWidth);
    camera.height = int(kHeight);
    camera.fx = camera.fy = 300;
    camera.cx = kWidth / 2.0;
    camera.cy = kHeight / 2.0;
    camera.translation = glm::dvec3(0, 0, 3 * reach) - gaussians.origin;
    return camera;
}

/// Whether floats and bytes are those of the render on the host.
bool same(const ewa::Rendering& host, const ewa::Image& image, const uint8_t* bytes) {
    for (size_t i = 0; i < host.alpha.pixels.size(); ++i)
        for (size_t c = 0; c < 4; ++c) {
            const float value = c < 3 ? host.color.pixels[3 * i + c] : host.alpha.pixels[i];
            if (image.pixels[4 * i + c] != value) return false;
            if (bytes[4 * i + c] != uint8_t(std::clamp(value, 0.0f, 1.0f) * 255 + 0.5f)) return false;
        }
    return true;
}

void run(const char* splats, const char* output, bool validate) {
    const Engine engine(validate);
    const ewa::Gaussians gaussians = ewa::load_splats(splats);
    const ewa::Camera camera = camera_before(gaussians);
    ewa::Renderer renderer(engine.splats_device(), gaussians, {});
    const Picture picture(engine);
    const vk::DeviceSize size = 4ull * kWidth * kHeight;
    const Bytes bytes(engine, size);
    const vk::SemaphoreTypeCreateInfo timeline(vk::SemaphoreType::eTimeline, 0);
    const auto drawn = engine.device().createSemaphoreUnique({{}, &timeline});

    ewa::DeviceImage image;
    image.image = *picture.image;
    image.size = {kWidth, kHeight};
    image.layout_after = VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL;
    const ewa::DeviceBuffer buffer{*bytes.buffer, size};
    const std::array<ewa::DeviceTarget, 2> targets{
        {{VK_FORMAT_R32G32B32A32_SFLOAT, image}, {VK_FORMAT_R8G8B8A8_UNORM, buffer}}};
    ewa::DeviceSync sync;
    sync.signal = *drawn;
    sync.signal_value = 1;
    ewa::render_to(renderer, camera, {}, targets, sync);

    const ewa::Image result = read_back(engine, picture, *drawn, 1);
    ewa::save_image(output, result);
    if (!same(renderer.render(camera), result, static_cast<const uint8_t*>(bytes.mapped)))
        throw ewa::RunError("the image on the device is not the one on the host");
    std::printf("%s: %zu splats, the image on the device is the one on the host\n",
                ewa::device_info(*engine.splats_device()).name.c_str(), gaussians.size());
}

}  // namespace

int main(int argc, char** argv) try {
    const bool validate = argc == 4 && std::string_view(argv[3]) == "--validate";
    if (argc != 3 && !validate) {
        std::fprintf(stderr, "interop SPLATS OUT.png [--validate]\n");
        return 2;
    }
    run(argv[1], argv[2], validate);
    if (messages == 0) return 0;
    std::fprintf(stderr, "interop: %d messages of the validation layer\n", messages);
    return 1;
} catch (const ewa::InputError& error) {
    std::fprintf(stderr, "interop: %s\n", error.what());
    return 2;
} catch (const std::exception& error) {
    std::fprintf(stderr, "interop: %s\n", error.what());
    return 1;
}
