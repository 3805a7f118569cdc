// SPDX-License-Identifier: Apache-2.0
#include "viewer/presenter.h"

#include <backends/imgui_impl_vulkan.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "ewa/error.h"

namespace ewa::viewer {
namespace {

using Access = vk::AccessFlagBits;
using Layout = vk::ImageLayout;
using Stage = vk::PipelineStageFlagBits;
using Usage = vk::ImageUsageFlagBits;

const vk::ImageSubresourceRange kWhole(vk::ImageAspectFlagBits::eColor, 0, 1, 0, 1);
const vk::ImageSubresourceLayers kLayer(vk::ImageAspectFlagBits::eColor, 0, 0, 1);

struct Use {
    vk::PipelineStageFlags stage;
    vk::AccessFlags access;
    Layout layout;
};

void change(vk::CommandBuffer commands, vk::Image image, const Use& from, const Use& to) {
    vk::ImageMemoryBarrier barrier;
    barrier.setSrcAccessMask(from.access)
        .setDstAccessMask(to.access)
        .setOldLayout(from.layout)
        .setNewLayout(to.layout)
        .setSrcQueueFamilyIndex(VK_QUEUE_FAMILY_IGNORED)
        .setDstQueueFamilyIndex(VK_QUEUE_FAMILY_IGNORED)
        .setImage(image)
        .setSubresourceRange(kWhole);
    commands.pipelineBarrier(from.stage, to.stage, {}, {}, {}, barrier);
}

const Use kNothingYet{Stage::eTransfer, {}, Layout::eUndefined};
const Use kWritten{Stage::eTransfer, Access::eTransferWrite, Layout::eTransferDstOptimal};
const Use kRead{Stage::eTransfer, Access::eTransferRead, Layout::eTransferSrcOptimal};
const Use kDrawnOn{Stage::eColorAttachmentOutput,
                   Access::eColorAttachmentRead | Access::eColorAttachmentWrite,
                   Layout::eColorAttachmentOptimal};

/// The largest rectangle of the shape of `shape` in the middle of `room`: two corners.
std::array<vk::Offset3D, 2> fitted_rectangle(Size shape, Size room) {
    Size size = room;
    if (shape != room) {
        const double scale = std::min(double(room.width) / shape.width, double(room.height) / shape.height);
        size.width = std::clamp(int(std::lround(shape.width * scale)), 1, room.width);
        size.height = std::clamp(int(std::lround(shape.height * scale)), 1, room.height);
    }
    const int x = (room.width - size.width) / 2, y = (room.height - size.height) / 2;
    return {vk::Offset3D(x, y, 0), vk::Offset3D(x + size.width, y + size.height, 1)};
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

void Presenter::set_picture(const Picture& picture) {
    wait();  // the submission before may still read the staging buffer
    if (staging_.bytes < picture.rgba.size()) {
        staging_ = {};
        staging_ = device_.host_buffer(picture.rgba.size(), vk::BufferUsageFlagBits::eTransferSrc);
    }
    std::memcpy(staging_.mapped, picture.rgba.data(), picture.rgba.size());
    const Size size{picture.width, picture.height};
    if (picture_.size != size) {
        // Where the window's format encodes to sRGB, the picture's decodes from it: its values come out as
        // they went in.
        const vk::Format format = swapchain_.srgb() ? vk::Format::eR8G8B8A8Srgb : vk::Format::eR8G8B8A8Unorm;
        picture_ = {};
        picture_ = device_.image(size, format, Usage::eTransferDst | Usage::eTransferSrc);
    }
    fresh_ = true;
}

void Presenter::record_upload() {
    change(*commands_, *picture_.image, kNothingYet, kWritten);
    vk::BufferImageCopy copy;
    copy.setImageSubresource(kLayer).setImageExtent(
        {uint32_t(picture_.size.width), uint32_t(picture_.size.height), 1});
    commands_->copyBufferToImage(*staging_.buffer, *picture_.image, Layout::eTransferDstOptimal, copy);
    change(*commands_, *picture_.image, kWritten, kRead);
    fresh_ = false;
}

void Presenter::record_picture(vk::Image target, Size shown_as) {
    change(*commands_, target, kNothingYet, kWritten);
    const Size room = swapchain_.size();
    const auto corners = fitted_rectangle(shown_as, room);
    const bool covers = picture_.image && corners[1].x - corners[0].x == room.width &&
                        corners[1].y - corners[0].y == room.height;
    if (!covers) {
        const vk::ClearColorValue black(std::array<float, 4>{0, 0, 0, 1});
        commands_->clearColorImage(target, Layout::eTransferDstOptimal, black, kWhole);
    }
    if (!picture_.image) return;
    if (!covers) change(*commands_, target, kWritten, kWritten);
    vk::ImageBlit blit;
    blit.setSrcSubresource(kLayer)
        .setDstSubresource(kLayer)
        .setSrcOffsets({vk::Offset3D(0, 0, 0), vk::Offset3D(picture_.size.width, picture_.size.height, 1)})
        .setDstOffsets(corners);
    const vk::Filter filter = covers && picture_.size == room ? vk::Filter::eNearest : vk::Filter::eLinear;
    commands_->blitImage(*picture_.image, Layout::eTransferSrcOptimal, target, Layout::eTransferDstOptimal,
                         blit, filter);
}

void Presenter::record_capture(vk::Image target) {
    const Size size = swapchain_.size();
    const vk::DeviceSize bytes = vk::DeviceSize(size.width) * vk::DeviceSize(size.height) * 4;
    if (readback_.bytes < bytes) {
        readback_ = {};
        readback_ = device_.host_buffer(bytes, vk::BufferUsageFlagBits::eTransferDst);
    }
    vk::BufferImageCopy copy;
    copy.setImageSubresource(kLayer).setImageExtent({uint32_t(size.width), uint32_t(size.height), 1});
    commands_->copyImageToBuffer(target, Layout::eTransferSrcOptimal, *readback_.buffer, copy);
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

bool Presenter::draw(Size window, Size shown_as, ImDrawData* panel, Image* capture) {
    if (window.width == 0 || window.height == 0) return false;
    if (capture && !swapchain_.readable())
        throw RunError("this display does not let a window's picture be read back");
    wait();
    if (outdated_ || !swapchain_.exists() || made_for_ != window) {
        if (!swapchain_.recreate(window)) return false;
        made_for_ = window;
        outdated_ = false;
    }
    const std::optional<uint32_t> index = swapchain_.acquire();
    if (!index) {
        outdated_ = true;
        return false;
    }
    const vk::Image target = swapchain_.image(*index);
    begin();
    if (fresh_) record_upload();
    record_picture(target, shown_as);
    if (capture) {
        change(*commands_, target, kWritten, kRead);
        record_capture(target);
        change(*commands_, target, kRead, kDrawnOn);
    } else {
        change(*commands_, target, kWritten, kDrawnOn);
    }
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

}  // namespace ewa::viewer
