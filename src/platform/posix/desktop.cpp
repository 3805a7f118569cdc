// SPDX-License-Identifier: Apache-2.0
#include "platform/desktop.h"

#include "platform/process.h"
#include "platform/system.h"

namespace ewa::platform {

bool has_desktop() {
    for (const char* name : {"DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"})
        if (!variable(name).empty()) return true;
    return false;
}

std::string open_outside(const std::filesystem::path& file, const std::string& remedy) {
    if (find_program("xdg-open").empty()) return "there is no xdg-open here (" + remedy + ")";
    // The shell ends at once. A program that ends with this one would close the user's browser.
    Process shell;
    const std::error_code error =
        shell.start({"/bin/sh", "-c", "xdg-open \"$1\" < /dev/null > /dev/null 2>&1 &", "sh",
                     std::filesystem::absolute(file).string()},
                    {}, {});
    if (error) return "cannot start /bin/sh: " + error.message();
    shell.wait();
    return {};
}

bool choose(Choice, const std::filesystem::path&, const std::atomic<bool>&, std::filesystem::path&) {
    return false;
}

}  // namespace ewa::platform
