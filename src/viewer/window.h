// SPDX-License-Identifier: Apache-2.0
// One GLFW window: its life, and the keys.
#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "gpu/vulkan.h"
#include "viewer/size.h"

struct GLFWwindow;

namespace ewa::viewer {

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

/// A key as it was pressed: by the time it is looked at, the others may be released.
struct KeyPress {
    int key = 0;
    bool shift = false, control = false;
};

/// Wakes it at the end of its life.
struct Wake {
    const WindowSystem& system;
    ~Wake() { system.wake(); }
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
    void close();
    bool held(int key) const;

    /// Waits for input, at most this long (0: takes what is there), and returns the keys pressed since.
    std::vector<KeyPress> wait(double seconds);
    /// Input or a change of the window came with the last wait().
    bool stirred() const { return stirred_; }
    /// What was dropped on the window since the last call; empty: nothing.
    std::filesystem::path take_dropped() { return std::exchange(dropped_, {}); }
    void set_title(const std::string& title);

  private:
    static Window& of(GLFWwindow* window);
    void watch();

    GLFWwindow* window_ = nullptr;
    std::vector<KeyPress> pressed_;
    std::filesystem::path dropped_;
    bool stirred_ = false;
};

}  // namespace ewa::viewer
