// SPDX-License-Identifier: Apache-2.0
// One GLFW window: its life, and the keys.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "gpu/vulkan.h"

struct GLFWwindow;

namespace ewa::viewer {

struct Size {
    int width = 0, height = 0;
    bool operator==(const Size&) const = default;
};

/// GLFW itself, initialised while one of these lives. Throws RunError where there is no display.
class WindowSystem {
  public:
    WindowSystem();
    ~WindowSystem();
    WindowSystem(const WindowSystem&) = delete;
    WindowSystem& operator=(const WindowSystem&) = delete;

    /// What the desktop leaves free for a window on the main monitor, px; zero where that is unknown.
    Size room() const;
    std::vector<const char*> vulkan_extensions() const;
    /// Makes a Window::wait() return. For any thread.
    void wake() const;
};

class Window {
  public:
    /// Throws RunError. resizable: also asks window managers to keep the size where it is false.
    Window(const WindowSystem& system, const std::string& title, Size size, bool resizable);
    ~Window();
    Window(const Window&) = delete;
    Window& operator=(const Window&) = delete;

    GLFWwindow* handle() const { return window_; }
    vk::UniqueSurfaceKHR surface(vk::Instance instance) const;
    Size framebuffer() const;  // px; zero while minimised
    float scale() const;       // of text, on dense displays
    bool closed() const;
    bool held(int key) const;

    /// Waits for input, at most this long (0: takes what is there), and returns the keys pressed since.
    std::vector<int> wait(double seconds);
    /// Input or a change of the window came with the last wait().
    bool stirred() const { return stirred_; }

  private:
    static Window& of(GLFWwindow* window);
    void watch();

    GLFWwindow* window_ = nullptr;
    std::vector<int> pressed_;
    bool stirred_ = false;
};

}  // namespace ewa::viewer
