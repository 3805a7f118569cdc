// SPDX-License-Identifier: Apache-2.0
// Shows images and the panel, which Dear ImGui draws, in the window.
#pragma once
#include <array>
#include <span>

#include "ewa/image.h"
#include "viewer/comparison.h"
#include "viewer/swapchain.h"

struct ImDrawData;

namespace ewa::viewer {

/// Part of an image, and its place in the window.
struct Layer {
    enum Slot { rendering, image } slot = rendering;
    Rectangle target;            // inside the window
    double left = 0, right = 1;  // columns shown, as shares of the image's width; all rows are shown
};

/// Copies images and the panel to the window.
class Presenter {
  public:
    explicit Presenter(const PresentDevice& device);
    ~Presenter();

    /// Sets the image of a slot for the next draw().
    void set_picture(Layer::Slot slot, const ByteImage& picture);

    /// Draws one frame: the layers that have an image, in order on the backdrop, then the panel. capture: receives
    /// the window without the panel, on black; null: no capture. Returns false if nothing was drawn because the
    /// window is minimised or changing.
    bool draw(Size window, std::span<const Layer> layers, ImDrawData* panel, Image* capture);

    const Swapchain& swapchain() const { return swapchain_; }
    /// Runs commands once and waits for them.
    template <class Record>
    void run_once(Record record) {
        begin();
        record(*commands_);
        commands_->end();
        submit(nullptr, nullptr);
        wait();
    }

  private:
    void begin();
    void submit(const vk::Semaphore* after, const vk::Semaphore* then);
    void wait();
    struct Slot {
        HostBuffer staging;
        DeviceImage image;
        bool fresh = false;  // the image does not have the data of staging yet
    };
    void record_upload(Slot& slot);
    void record_layers(vk::Image target, std::span<const Layer> layers, bool on_black);
    void record_capture(vk::Image target);
    void record_panel(uint32_t index, ImDrawData* panel);
    Image captured() const;

    const PresentDevice& device_;
    Swapchain swapchain_;
    bool outdated_ = true;
    Size made_for_;  // size of the window when the swapchain was created; its images may differ
    vk::UniqueCommandPool pool_;
    vk::UniqueCommandBuffer commands_;
    vk::UniqueFence done_;
    bool pending_ = false;  // a submission whose fence has not been waited for
    HostBuffer readback_;
    std::array<Slot, 2> pictures_;  // by slot
};

/// Dear ImGui on one window.
class Gui {
  public:
    /// Set the window's own callbacks first, because those of ImGui call them. text: height of the text, px.
    /// light: the light theme.
    Gui(const Window& window, const PresentDevice& device, Presenter& presenter, double text, bool light);
    ~Gui();

    void begin_frame();
    ImDrawData* end_frame();

  private:
    void add_fonts(double text);

    const PresentDevice& device_;
    vk::UniqueDescriptorPool pool_;
};

/// The objects that depend on the device, the text size and the theme. They are created again if the device is lost or one changes.
struct Screen {
    Screen(const WindowSystem& system, Window& window, const std::string& device_name, double text_height,
           bool light_theme)
        : text(text_height),
          light(light_theme),
          device(system, window, device_name),
          presenter(device),
          gui(window, device, presenter, text, light) {}
    double text;
    bool light;
    PresentDevice device;
    Presenter presenter;
    Gui gui;
};

}  // namespace ewa::viewer
