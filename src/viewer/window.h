// SPDX-License-Identifier: Apache-2.0
// One GLFW window and its input.
#pragma once
#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "gpu/device.h"
#include "viewer/byte_image.h"

struct GLFWwindow;

namespace ewa::viewer {

/// Initialises GLFW; the destructor terminates it. Throws RunError if there is no display.
class WindowSystem {
  public:
    WindowSystem();
    ~WindowSystem();
    WindowSystem(const WindowSystem&) = delete;
    WindowSystem& operator=(const WindowSystem&) = delete;

    /// The size that a window on the main monitor can have without covering the desktop's bars, in window units; zero if unknown.
    Size work_area() const;
    /// The scale of text on the main monitor: the desktop's, or the larger one that its density asks for.
    float scale() const;
    /// The scale that the density of the main monitor asks for, as of the start.
    float density_scale() const { return density_scale_; }
    std::vector<const char*> vulkan_extensions() const;
    /// Makes Window::wait() return. Any thread may call it.
    void wake() const;

  private:
    float density_scale_ = 1;
};

/// A key press with the modifiers at that time.
struct KeyPress {
    int key = 0;
    bool shift = false, control = false;
};

class Window {
  public:
    /// resizable: false also asks the window manager to keep the size. Throws RunError.
    Window(const WindowSystem& system, const std::string& title, Size size, bool resizable);
    ~Window();
    Window(const Window&) = delete;
    Window& operator=(const Window&) = delete;

    GLFWwindow* handle() const { return window_; }
    vk::UniqueSurfaceKHR surface(vk::Instance instance) const;
    Size framebuffer() const;  // px; zero while minimised
    Size size() const;         // in the window system's units
    float scale() const;       // of text in the framebuffer, on high-density displays
    float density() const;     // px of the framebuffer per unit of the window's size
    bool closed() const;
    void close();
    void stay();  // closed() is false again
    /// Whether a key is down. A key that was pressed with Ctrl is a command, even once Ctrl is let go.
    bool held(int key) const;

    /// Waits for input, at most so many seconds (0: no wait). Returns the keys pressed since the last call.
    std::vector<KeyPress> wait(double seconds);
    /// Whether the last wait() brought input or a change of the window.
    bool stirred() const { return stirred_; }
    /// The files that were dropped on the window since the last call.
    std::vector<std::filesystem::path> take_dropped() { return std::exchange(dropped_, {}); }
    void set_title(const std::string& title);

  private:
    static Window& of(GLFWwindow* window);
    void watch();

    GLFWwindow* window_ = nullptr;
    float least_scale_ = 1;
    std::vector<KeyPress> pressed_;
    std::set<int> commands_;  // keys pressed with Ctrl and still down
    std::vector<std::filesystem::path> dropped_;
    bool stirred_ = false;
};

}  // namespace ewa::viewer
