// SPDX-License-Identifier: Apache-2.0
// Puts pictures and the panel over them into the window.
#pragma once
#include <array>
#include <span>

#include "ewa/image.h"
#include "viewer/photo_comparison.h"
#include "viewer/swapchain.h"

struct ImDrawData;

namespace ewa::viewer {

/// Part of a picture, and where in the window it goes.
struct Layer {
    enum Slot { rendering, photograph } slot = rendering;
    Rectangle target;            // inside the window
    double left = 0, right = 1;  // of the picture's width; the whole height
};

class Presenter {
  public:
    explicit Presenter(const PresentDevice& device);
    ~Presenter();

    /// What a layer of this slot shows from the next draw() on.
    void set_picture(Layer::Slot slot, const Picture& picture);

    /// One frame: the layers one over the other on black, those without a picture left out, then the panel.
    /// capture, if not null, receives what the window shows without the panel. False when nothing was drawn:
    /// the window is minimised or is just changing.
    bool draw(Size window, std::span<const Layer> layers, ImDrawData* panel, Image* capture);

    const Swapchain& swapchain() const { return swapchain_; }
    /// Runs commands once and waits until they are done.
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
    struct Held {
        HostBuffer staging;
        DeviceImage image;
        bool fresh = false;  // staging holds a picture that the image does not
    };
    void record_upload(Held& held);
    void record_layers(vk::Image target, std::span<const Layer> layers);
    void record_capture(vk::Image target);
    void record_panel(uint32_t index, ImDrawData* panel);
    Image captured() const;

    const PresentDevice& device_;
    Swapchain swapchain_;
    bool outdated_ = true;
    Size made_for_;  // the window's, when the swapchain was made: its own may differ
    vk::UniqueCommandPool pool_;
    vk::UniqueCommandBuffer commands_;
    vk::UniqueFence done_;
    bool pending_ = false;  // a submission whose fence has not been waited for
    HostBuffer readback_;
    std::array<Held, 2> pictures_;  // by slot
};

}  // namespace ewa::viewer
