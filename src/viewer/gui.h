// SPDX-License-Identifier: Apache-2.0
// Dear ImGui on one window: its life, and a frame of it.
#pragma once
#include "viewer/presenter.h"

namespace ewa::viewer {

class Gui {
  public:
    /// After the window's own callbacks are set: ImGui's call them in turn.
    Gui(const Window& window, const PresentDevice& device, Presenter& presenter);
    ~Gui();
    Gui(const Gui&) = delete;
    Gui& operator=(const Gui&) = delete;

    void begin_frame();
    ImDrawData* end_frame();

  private:
    const PresentDevice& device_;
    vk::UniqueDescriptorPool pool_;
};

}  // namespace ewa::viewer
