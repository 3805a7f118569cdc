// SPDX-License-Identifier: Apache-2.0
// Puts the last picture and the panel over it into the window.
#pragma once
#include "ewa/image.h"
#include "viewer/picture.h"
#include "viewer/swapchain.h"

struct ImDrawData;

namespace ewa::viewer {

class Presenter {
  public:
    explicit Presenter(const PresentDevice& device);
    ~Presenter();

    /// The picture that the window shows from the next draw() on.
    void set_picture(const Picture& picture);

    /// One frame: the picture, whole and undistorted in the middle of the window, then the panel. `shown_as`
    /// is the size the picture was made for; where that is the window's, the picture fills it. capture, if
    /// not null, receives what the window shows without the panel. False when nothing was drawn: the window
    /// is minimised or is just changing.
    bool draw(Size window, Size shown_as, ImDrawData* panel, Image* capture);

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
    void record_upload();
    void record_picture(vk::Image target, Size shown_as);
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
    HostBuffer staging_, readback_;
    DeviceImage picture_;
    bool fresh_ = false;  // staging_ holds a picture that picture_ does not
};

}  // namespace ewa::viewer
