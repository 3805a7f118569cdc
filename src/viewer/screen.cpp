// SPDX-License-Identifier: Apache-2.0
#include "viewer/screen.h"

#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_vulkan.h>
#include <imgui.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <vector>

#include "ewa/error.h"
#include "viewer/editor/theme.h"
#include "viewer/font.h"

namespace ewa::viewer {
namespace {

using Access = vk::AccessFlagBits;
using Layout = vk::ImageLayout;
using Stage = vk::PipelineStageFlagBits;
using Usage = vk::ImageUsageFlagBits;

constexpr double kOwnFontShare = 13 / kTextHeight;  // at 13 px, each dot of the bitmap font is a pixel

const vk::ImageSubresourceRange kWhole(vk::ImageAspectFlagBits::eColor, 0, 1, 0, 1);
const vk::ImageSubresourceLayers kLayer(vk::ImageAspectFlagBits::eColor, 0, 0, 1);

struct Use {
    vk::PipelineStageFlags stage;
    vk::AccessFlags access;
    Layout layout;
};

void change(vk::CommandBuffer commands, vk::Image image, const Use& from, const Use& to) {
    const vk::ImageMemoryBarrier barrier(from.access, to.access, from.layout, to.layout,
                                         VK_QUEUE_FAMILY_IGNORED, VK_QUEUE_FAMILY_IGNORED, image, kWhole);
    commands.pipelineBarrier(from.stage, to.stage, {}, {}, {}, barrier);
}

const Use kNothingYet{Stage::eTransfer, {}, Layout::eUndefined};
const Use kWritten{Stage::eTransfer, Access::eTransferWrite, Layout::eTransferDstOptimal};
const Use kRead{Stage::eTransfer, Access::eTransferRead, Layout::eTransferSrcOptimal};
const Use kDrawnOn{Stage::eColorAttachmentOutput,
                   Access::eColorAttachmentRead | Access::eColorAttachmentWrite,
                   Layout::eColorAttachmentOptimal};

/// Clips to the window, so that a blit stays inside the image.
Rectangle clipped(const Rectangle& rectangle, Size window) {
    const int left = std::clamp(rectangle.x, 0, window.width),
              top = std::clamp(rectangle.y, 0, window.height);
    return {left, top, std::clamp(rectangle.x + rectangle.width, left, window.width) - left,
            std::clamp(rectangle.y + rectangle.height, top, window.height) - top};
}

/// An ImU32. srgb: the image encodes what it is cleared with.
vk::ClearColorValue clear_color(unsigned color, bool srgb) {
    const auto channel = [&](unsigned shift) {
        const float value = float((color >> shift) & 255) / 255;
        return srgb ? (value <= 0.04045f ? value / 12.92f : std::pow((value + 0.055f) / 1.055f, 2.4f))
                    : value;
    };
    return {channel(IM_COL32_R_SHIFT), channel(IM_COL32_G_SHIFT), channel(IM_COL32_B_SHIFT), 1.0f};
}

/// Between a whole image and tightly packed bytes.
vk::BufferImageCopy whole_copy(Size size) {
    return {0, 0, 0, kLayer, {}, {uint32_t(size.width), uint32_t(size.height), 1}};
}

void check(VkResult result) {
    if (result == VK_ERROR_DEVICE_LOST) throw vk::DeviceLostError("the panel cannot be drawn");
    if (result < 0) throw RunError("the panel cannot be drawn: " + vk::to_string(vk::Result(result)));
}

}  // namespace

Presenter::Presenter(const PresentDevice& device) : device_(device), swapchain_(device) {
    const vk::Device vulkan = device.handle();
    pool_ = vulkan.createCommandPoolUnique(
        {vk::CommandPoolCreateFlagBits::eResetCommandBuffer, device.queue_family()});
    commands_ =
        std::move(vulkan.allocateCommandBuffersUnique({*pool_, vk::CommandBufferLevel::ePrimary, 1}).front());
    done_ = vulkan.createFenceUnique({});
}

Presenter::~Presenter() {
    (void)vkDeviceWaitIdle(device_.handle());
}

void Presenter::wait() {
    if (!pending_) return;
    if (device_.handle().waitForFences(*done_, true, ~uint64_t(0)) != vk::Result::eSuccess)
        throw RunError("the device did not finish drawing the window");
    device_.handle().resetFences(*done_);
    pending_ = false;
}

void Presenter::begin() {
    wait();
    commands_->reset();
    commands_->begin(vk::CommandBufferBeginInfo(vk::CommandBufferUsageFlagBits::eOneTimeSubmit));
}

void Presenter::submit(const vk::Semaphore* after, const vk::Semaphore* then) {
    const vk::PipelineStageFlags stage = Stage::eTransfer;
    vk::SubmitInfo submit;
    submit.setCommandBuffers(*commands_);
    if (after) submit.setWaitSemaphores(*after).setWaitDstStageMask(stage);
    if (then) submit.setSignalSemaphores(*then);
    device_.queue().submit(submit, *done_);
    pending_ = true;
}

void Presenter::set_picture(Layer::Slot slot, const ByteImage& picture) {
    wait();  // the previous submission may still read the staging buffer
    Slot& slot_data = pictures_[slot];
    if (slot_data.staging.bytes < picture.rgba.size()) {
        slot_data.staging = {};
        slot_data.staging = device_.host_buffer(picture.rgba.size(), vk::BufferUsageFlagBits::eTransferSrc);
    }
    std::memcpy(slot_data.staging.mapped, picture.rgba.data(), picture.rgba.size());
    const Size size{picture.width, picture.height};
    if (slot_data.image.size != size) {
        // If the window's format encodes to sRGB, this one decodes from it, so that values stay unchanged.
        const vk::Format format = swapchain_.srgb() ? vk::Format::eR8G8B8A8Srgb : vk::Format::eR8G8B8A8Unorm;
        slot_data.image = {};
        slot_data.image = device_.image(size, format, Usage::eTransferDst | Usage::eTransferSrc);
    }
    slot_data.fresh = true;
}

void Presenter::record_upload(Slot& slot_data) {
    change(*commands_, *slot_data.image.image, kNothingYet, kWritten);
    commands_->copyBufferToImage(*slot_data.staging.buffer, *slot_data.image.image,
                                 Layout::eTransferDstOptimal, whole_copy(slot_data.image.size));
    change(*commands_, *slot_data.image.image, kWritten, kRead);
    slot_data.fresh = false;
}

void Presenter::record_layers(vk::Image target, std::span<const Layer> layers, bool on_black) {
    change(*commands_, target, kNothingYet, kWritten);
    const vk::ClearColorValue color =
        on_black ? vk::ClearColorValue(0.0f, 0.0f, 0.0f, 1.0f) : clear_color(backdrop(), swapchain_.srgb());
    commands_->clearColorImage(target, Layout::eTransferDstOptimal, color, kWhole);
    for (const Layer& layer : layers) {
        const DeviceImage& picture = pictures_[layer.slot].image;
        const Rectangle to = clipped(layer.target, swapchain_.size());
        if (!picture.image || to.width == 0 || to.height == 0) continue;
        const int width = picture.size.width, height = picture.size.height;
        const int left = std::clamp(int(std::lround(layer.left * width)), 0, width - 1);
        const int right = std::clamp(int(std::lround(layer.right * width)), left + 1, width);
        change(*commands_, target, kWritten, kWritten);
        vk::ImageBlit blit;
        blit.setSrcSubresource(kLayer)
            .setDstSubresource(kLayer)
            .setSrcOffsets({vk::Offset3D(left, 0, 0), vk::Offset3D(right, height, 1)})
            .setDstOffsets({vk::Offset3D(to.x, to.y, 0), vk::Offset3D(to.x + to.width, to.y + to.height, 1)});
        const bool as_it_is = to.width == right - left && to.height == height;
        commands_->blitImage(*picture.image, Layout::eTransferSrcOptimal, target, Layout::eTransferDstOptimal,
                             blit, as_it_is ? vk::Filter::eNearest : vk::Filter::eLinear);
    }
}

void Presenter::record_capture(vk::Image target) {
    const Size size = swapchain_.size();
    const vk::DeviceSize bytes = vk::DeviceSize(size.width) * vk::DeviceSize(size.height) * 4;
    if (readback_.bytes < bytes) {
        readback_ = {};
        readback_ = device_.host_buffer(bytes, vk::BufferUsageFlagBits::eTransferDst);
    }
    commands_->copyImageToBuffer(target, Layout::eTransferSrcOptimal, *readback_.buffer, whole_copy(size));
    const vk::MemoryBarrier to_host(Access::eTransferWrite, Access::eHostRead);
    commands_->pipelineBarrier(Stage::eTransfer, Stage::eHost, {}, to_host, {}, {});
}

void Presenter::record_panel(uint32_t index, ImDrawData* panel) {
    vk::RenderPassBeginInfo begin;
    begin.setRenderPass(swapchain_.overlay_pass())
        .setFramebuffer(swapchain_.framebuffer(index))
        .setRenderArea({{0, 0}, {uint32_t(swapchain_.size().width), uint32_t(swapchain_.size().height)}});
    commands_->beginRenderPass(begin, vk::SubpassContents::eInline);
    if (panel) ImGui_ImplVulkan_RenderDrawData(panel, *commands_);
    commands_->endRenderPass();
}

Image Presenter::captured() const {
    const bool bgr =
        swapchain_.format() == vk::Format::eB8G8R8A8Unorm || swapchain_.format() == vk::Format::eB8G8R8A8Srgb;
    Image image(swapchain_.size().width, swapchain_.size().height, 3);
    const auto* bytes = static_cast<const uint8_t*>(readback_.mapped);
    for (size_t i = 0; i < image.pixels.size() / 3; ++i)
        for (size_t c = 0; c < 3; ++c)
            image.pixels[3 * i + c] = float(bytes[4 * i + (bgr ? 2 - c : c)]) / 255.0f;
    return image;
}

bool Presenter::draw(Size window, std::span<const Layer> layers, ImDrawData* panel, Image* capture) {
    if (window.width == 0 || window.height == 0) return false;
    if (capture && !swapchain_.readable())
        throw RunError("this display does not allow reading the window back");
    wait();
    if (outdated_ || !swapchain_.exists() || made_for_ != window) {
        if (!swapchain_.recreate(window)) return false;
        made_for_ = window;
        outdated_ = false;
    }
    const auto [index, outdated] = swapchain_.acquire();
    if (!index) {
        outdated_ = outdated;
        return false;
    }
    const vk::Image target = swapchain_.image(*index);
    begin();
    for (Slot& slot_data : pictures_)
        if (slot_data.fresh) record_upload(slot_data);
    record_layers(target, layers, capture != nullptr);
    if (capture) {
        change(*commands_, target, kWritten, kRead);
        record_capture(target);
    }
    change(*commands_, target, capture ? kRead : kWritten, kDrawnOn);
    record_panel(*index, panel);
    commands_->end();
    const vk::Semaphore acquired = swapchain_.acquired(), drawn = swapchain_.drawn(*index);
    submit(&acquired, &drawn);
    if (!swapchain_.present(*index)) outdated_ = true;
    if (capture) {
        wait();
        *capture = captured();
    }
    return true;
}

/// The panel's font, and then the one of headlines. Both are rasterised at the size in which the framebuffer shows them.
void Gui::add_fonts(double text) {
    // Latin with its extensions, Greek and Cyrillic, and punctuation: file names have them.
    static const std::array<ImWchar, 5> names{0x20, 0x52f, 0x2010, 0x2027, 0};
    ImFontAtlas& fonts = *ImGui::GetIO().Fonts;
    static std::vector<unsigned char> file;  // the atlas reads it until it is built
    file = read_font(find_font());
    for (const double size : {text, 2 * text}) {
        ImFontConfig font;
        font.SizePixels = float(size * kOwnFontShare);  // of Dear ImGui's own font
        font.FontDataOwnedByAtlas = false;
        font.OversampleH = font.OversampleV = 1;
        if (file.empty())
            fonts.AddFontDefault(&font);
        else
            fonts.AddFontFromMemoryTTF(file.data(), int(file.size()), float(size), &font,
                                       size == text ? names.data() : nullptr);
    }
}

Gui::Gui(const Window& window, const PresentDevice& device, Presenter& presenter, double text, bool light)
    : device_(device) {
    const vk::DescriptorPoolSize size(vk::DescriptorType::eCombinedImageSampler, 1);
    vk::DescriptorPoolCreateInfo create;
    create.setMaxSets(1).setPoolSizes(size);
    create.setFlags(vk::DescriptorPoolCreateFlagBits::eFreeDescriptorSet);  // ImGui 1.90 frees the font's set
    pool_ = device.handle().createDescriptorPoolUnique(create);

    ImGui::CreateContext();
    ImGui::GetIO().IniFilename = nullptr;  // write no settings file
    set_theme(light);
    const float density = window.density();
    ImGui::GetStyle().ScaleAllSizes(float(text / kTextHeight) / density);
    ImGui::GetIO().FontGlobalScale = 1 / density;
    add_fonts(text);

    ImGui_ImplGlfw_InitForVulkan(window.handle(), true);
    ImGui_ImplVulkan_InitInfo info{};
    info.Instance = device.instance();
    info.PhysicalDevice = device.physical();
    info.Device = device.handle();
    info.QueueFamily = device.queue_family();
    info.Queue = device.queue();
    info.DescriptorPool = *pool_;
    info.MinImageCount = presenter.swapchain().least_images();
    // ImGui cycles its vertex buffers over this many frames. Only one frame is in flight, so the minimum is
    // enough.
    info.ImageCount = info.MinImageCount;
    info.MSAASamples = VK_SAMPLE_COUNT_1_BIT;
    info.CheckVkResultFn = check;
    ImGui_ImplVulkan_Init(&info, presenter.swapchain().overlay_pass());
    // Before the first frame: the upload waits for the device.
#if IMGUI_VERSION_NUM < 19000
    presenter.run_once([](vk::CommandBuffer commands) { ImGui_ImplVulkan_CreateFontsTexture(commands); });
    ImGui_ImplVulkan_DestroyFontUploadObjects();
#else
    ImGui_ImplVulkan_CreateFontsTexture();  // has command buffers of its own
#endif
}

Gui::~Gui() {
    (void)vkDeviceWaitIdle(device_.handle());  // the last frame may still be in flight
    ImGui_ImplVulkan_Shutdown();
    ImGui_ImplGlfw_Shutdown();
    ImGui::DestroyContext();
}

void Gui::begin_frame() {
    ImGui_ImplVulkan_NewFrame();
    ImGui_ImplGlfw_NewFrame();
    ImGui::NewFrame();
}

ImDrawData* Gui::end_frame() {
    ImGui::Render();
    return ImGui::GetDrawData();
}

}  // namespace ewa::viewer
