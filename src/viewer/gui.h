// SPDX-License-Identifier: Apache-2.0
// Dear ImGui on one window, and all that shows pictures there.
#pragma once
#include "viewer/presenter.h"

namespace ewa::viewer {

class Gui {
  public:
    /// The window's own callbacks must be set before: those of ImGui call them.
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

/// What shows pictures in the window. Created again if its device is lost.
struct Screen {
    Screen(const WindowSystem& system, Window& window, const std::string& device_name)
        : device(system, window, device_name), presenter(device), gui(window, device, presenter) {}
    PresentDevice device;
    Presenter presenter;
    Gui gui;
};

}  // namespace ewa::viewer
