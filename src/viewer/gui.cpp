// SPDX-License-Identifier: Apache-2.0
#include "viewer/gui.h"

#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_vulkan.h>
#include <imgui.h>

#include "ewa/error.h"

namespace ewa::viewer {
namespace {

void check(VkResult result) {
    if (result == VK_ERROR_DEVICE_LOST) throw vk::DeviceLostError("the panel cannot be drawn");
    if (result < 0) throw RunError("the panel cannot be drawn: " + vk::to_string(vk::Result(result)));
}

}  // namespace

Gui::Gui(const Window& window, const PresentDevice& device, Presenter& presenter) : device_(device) {
    const vk::DescriptorPoolSize size(vk::DescriptorType::eCombinedImageSampler, 1);
    vk::DescriptorPoolCreateInfo create;
    create.setMaxSets(1).setPoolSizes(size);
    create.setFlags(vk::DescriptorPoolCreateFlagBits::eFreeDescriptorSet);  // ImGui 1.90 frees the font's set
    pool_ = device.handle().createDescriptorPoolUnique(create);

    ImGui::CreateContext();
    ImGui::GetIO().IniFilename = nullptr;  // write no settings file
    ImGui::StyleColorsDark();
    ImGui::GetStyle().ScaleAllSizes(window.scale());
    ImFontConfig font;
    font.SizePixels = 13.0f * window.scale();
    ImGui::GetIO().Fonts->AddFontDefault(&font);

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
