// SPDX-License-Identifier: Apache-2.0
#include "viewer/window.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "ewa/error.h"
#include "viewer/layout.h"

namespace ewa::viewer {
namespace {

std::string glfw_reason() {
    const char* text = nullptr;
    glfwGetError(&text);
    return text ? text : "unknown reason";
}

}  // namespace

WindowSystem::WindowSystem() {
#ifdef GLFW_PLATFORM
    // GLFW 3.4 tries Wayland first, and libwayland prints an error where there is none.
    if (glfwPlatformSupported(GLFW_PLATFORM_X11) && !std::getenv("WAYLAND_DISPLAY") &&
        !std::getenv("WAYLAND_SOCKET"))
        glfwInitHint(GLFW_PLATFORM, GLFW_PLATFORM_X11);
#endif
    if (!glfwInit())
        throw RunError("no window can be opened: " + glfw_reason() +
                       "; the window needs a desktop session; ewa render and --screenshot need none");
    if (!glfwVulkanSupported()) {
        const std::string reason = glfw_reason();
        glfwTerminate();
        throw RunError("no window can be opened: " + reason +
                       "; no Vulkan driver can show images on this display");
    }
    if (GLFWmonitor* monitor = glfwGetPrimaryMonitor()) {
        Size millimetres;
        glfwGetMonitorPhysicalSize(monitor, &millimetres.width, &millimetres.height);
        density_scale_ = float(monitor_scale(work_area(), millimetres));
    }
}

WindowSystem::~WindowSystem() {
    glfwTerminate();
}

Size WindowSystem::work_area() const {
    Size size;
    int x = 0, y = 0;
    if (GLFWmonitor* monitor = glfwGetPrimaryMonitor())
        glfwGetMonitorWorkarea(monitor, &x, &y, &size.width, &size.height);
    return size;
}

float WindowSystem::scale() const {
    float x = 1, y = 1;
    if (GLFWmonitor* monitor = glfwGetPrimaryMonitor()) glfwGetMonitorContentScale(monitor, &x, &y);
    return std::max({density_scale_, x, y});
}

std::vector<const char*> WindowSystem::vulkan_extensions() const {
    uint32_t count = 0;
    const char** names = glfwGetRequiredInstanceExtensions(&count);
    return names ? std::vector<const char*>(names, names + count) : std::vector<const char*>();
}

void WindowSystem::wake() const {
    glfwPostEmptyEvent();
}

Window::Window(const WindowSystem& system, const std::string& title, Size size, bool resizable)
    : least_scale_(system.density_scale()) {
    glfwWindowHint(GLFW_CLIENT_API, GLFW_NO_API);
    // The name by which a desktop finds ewa-view.desktop, and its icon.
    glfwWindowHintString(GLFW_X11_CLASS_NAME, "ewa-view");
    glfwWindowHintString(GLFW_X11_INSTANCE_NAME, "ewa-view");
    glfwWindowHint(GLFW_RESIZABLE, resizable ? GLFW_TRUE : GLFW_FALSE);
    window_ = glfwCreateWindow(size.width, size.height, title.c_str(), nullptr, nullptr);
    if (!window_) throw RunError("no window can be opened: " + glfw_reason());
    glfwSetWindowUserPointer(window_, this);
    watch();
}

Window::~Window() {
    glfwDestroyWindow(window_);
}

Window& Window::of(GLFWwindow* window) {
    return *static_cast<Window*>(glfwGetWindowUserPointer(window));
}

void Window::watch() {
    glfwSetKeyCallback(window_, [](GLFWwindow* window, int key, int, int action, int mods) {
        Window& self = of(window);
        self.stirred_ = true;
        const bool control = (mods & GLFW_MOD_CONTROL) != 0;
        if (action == GLFW_RELEASE) self.commands_.erase(key);
        if (action != GLFW_PRESS) return;
        if (control) self.commands_.insert(key);
        self.pressed_.push_back({key, (mods & GLFW_MOD_SHIFT) != 0, control});
    });
    glfwSetDropCallback(window_, [](GLFWwindow* window, int count, const char** paths) {
        of(window).stirred_ = true;
        of(window).dropped_.assign(paths, paths + count);
    });
    const auto stir = [](GLFWwindow* window, auto...) { of(window).stirred_ = true; };
    glfwSetCursorPosCallback(window_, stir);
    glfwSetMouseButtonCallback(window_, stir);
    glfwSetScrollCallback(window_, stir);
    glfwSetCharCallback(window_, stir);
    glfwSetFramebufferSizeCallback(window_, stir);
    glfwSetWindowRefreshCallback(window_, stir);
    glfwSetWindowFocusCallback(window_, stir);
}

vk::UniqueSurfaceKHR Window::surface(vk::Instance instance) const {
    VkSurfaceKHR surface = VK_NULL_HANDLE;
    if (glfwCreateWindowSurface(instance, window_, nullptr, &surface) != VK_SUCCESS)
        throw RunError("Vulkan cannot show images in this window: " + glfw_reason());
    return vk::UniqueSurfaceKHR(surface, instance);
}

Size Window::framebuffer() const {
    Size size;
    glfwGetFramebufferSize(window_, &size.width, &size.height);
    return size;
}

void Window::set_title(const std::string& title) {
    glfwSetWindowTitle(window_, title.c_str());
}

float Window::scale() const {
    float x = 1, y = 1;
    glfwGetWindowContentScale(window_, &x, &y);
    return std::max({least_scale_, x, y});
}

float Window::density() const {
    const Size pixels = framebuffer(), units = size();
    return pixels.width > 0 && units.width > 0 ? float(pixels.width) / float(units.width) : 1.0f;
}

Size Window::size() const {
    Size size;
    glfwGetWindowSize(window_, &size.width, &size.height);
    return size;
}

bool Window::closed() const {
    return glfwWindowShouldClose(window_);
}

void Window::close() {
    glfwSetWindowShouldClose(window_, GLFW_TRUE);
}

void Window::stay() {
    glfwSetWindowShouldClose(window_, GLFW_FALSE);
}

bool Window::held(int key) const {
    return glfwGetKey(window_, key) == GLFW_PRESS && !commands_.contains(key);
}

std::vector<KeyPress> Window::wait(double seconds) {
    stirred_ = false;
    if (seconds > 0)
        glfwWaitEventsTimeout(seconds);
    else
        glfwPollEvents();
    return std::exchange(pressed_, {});
}

}  // namespace ewa::viewer
