// SPDX-License-Identifier: Apache-2.0
// The file dialog of the desktop's portal, over D-Bus.
#include "viewer/file_dialog.h"

#ifdef EWA_PORTAL
#include <systemd/sd-bus.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>

namespace ewa::viewer {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kStartMicroseconds = 5'000'000;  // for the portal to start
constexpr uint64_t kLookMicroseconds = 100'000;     // between two looks at `stop`
constexpr const char* kPortal = "org.freedesktop.portal.Desktop";
constexpr const char* kToken = "ewa";

struct PortalAnswer {
    bool here = false;
    fs::path chosen;
};

using Message = std::unique_ptr<sd_bus_message, decltype(&sd_bus_message_unref)>;

/// The signal Response(u response, a{sv} results). results has "uris" (as).
int take_response(sd_bus_message* message, void* data, sd_bus_error* /*error*/) {
    PortalAnswer& answer = *static_cast<PortalAnswer*>(data);
    answer.here = true;
    uint32_t response = 1;
    if (sd_bus_message_read(message, "u", &response) < 0 || response != 0) return 0;
    if (sd_bus_message_enter_container(message, 'a', "{sv}") < 0) return 0;
    while (sd_bus_message_enter_container(message, 'e', "sv") > 0) {
        const char* name = "";
        if (sd_bus_message_read(message, "s", &name) < 0) return 0;
        if (std::string(name) != "uris") {
            sd_bus_message_skip(message, "v");
        } else if (sd_bus_message_enter_container(message, 'v', "as") > 0) {
            const char* uri = nullptr;
            if (sd_bus_message_enter_container(message, 'a', "s") > 0 &&
                sd_bus_message_read(message, "s", &uri) > 0)
                answer.chosen = path_of_uri(uri);
            return 0;
        }
        sd_bus_message_exit_container(message);
    }
    return 0;
}

/// Where the portal will answer. It is known before the call, so that no answer is missed.
std::string request_path(sd_bus* bus) {
    const char* name = nullptr;
    if (sd_bus_get_unique_name(bus, &name) < 0 || !name) return {};
    std::string sender(name + 1);  // after the colon
    std::replace(sender.begin(), sender.end(), '.', '_');
    return "/org/freedesktop/portal/desktop/request/" + sender + "/" + kToken;
}

/// The options of a dialog to save: the name in the field, and the folder that is shown (ay, with a zero byte at the end).
bool append_proposed(sd_bus_message* call, const fs::path& proposed) {
    const std::string folder = proposed.parent_path().string();
    return sd_bus_message_append(call, "{sv}", "current_name", "s", proposed.filename().c_str()) >= 0 &&
           sd_bus_message_open_container(call, 'e', "sv") >= 0 &&
           sd_bus_message_append(call, "s", "current_folder") >= 0 &&
           sd_bus_message_open_container(call, 'v', "ay") >= 0 &&
           sd_bus_message_append_array(call, 'y', folder.c_str(), folder.size() + 1) >= 0 &&
           sd_bus_message_close_container(call) >= 0 && sd_bus_message_close_container(call) >= 0;
}

bool call_portal(sd_bus* bus, Wanted wanted, const fs::path& proposed) {
    const bool save = wanted == Wanted::save;
    sd_bus_message* made = nullptr;
    if (sd_bus_message_new_method_call(bus, &made, kPortal, "/org/freedesktop/portal/desktop",
                                       "org.freedesktop.portal.FileChooser",
                                       save ? "SaveFile" : "OpenFile") < 0)
        return false;
    const Message call(made, sd_bus_message_unref);
    const int folder = wanted == Wanted::folder;
    if (sd_bus_message_append(call.get(), "ss", "", save ? "Save" : "Open") < 0 ||
        sd_bus_message_open_container(call.get(), 'a', "{sv}") < 0 ||
        sd_bus_message_append(call.get(), "{sv}", "handle_token", "s", kToken) < 0 ||
        (!save && sd_bus_message_append(call.get(), "{sv}", "directory", "b", folder) < 0) ||
        (save && !proposed.empty() && !append_proposed(call.get(), proposed)) ||
        sd_bus_message_close_container(call.get()) < 0)
        return false;
    sd_bus_message* reply = nullptr;
    const int status = sd_bus_call(bus, call.get(), kStartMicroseconds, nullptr, &reply);
    sd_bus_message_unref(reply);
    return status >= 0;
}

}  // namespace

bool ask_portal(Wanted wanted, const fs::path& proposed, const std::atomic<bool>& stop, fs::path& chosen) {
    sd_bus* opened = nullptr;
    if (sd_bus_open_user(&opened) < 0) return false;
    // The portal closes its dialog when the connection ends.
    const std::unique_ptr<sd_bus, decltype(&sd_bus_flush_close_unref)> bus(opened, sd_bus_flush_close_unref);
    PortalAnswer answer;
    const std::string request = request_path(bus.get());
    if (request.empty() ||
        sd_bus_match_signal(bus.get(), nullptr, nullptr, request.c_str(), "org.freedesktop.portal.Request",
                            "Response", take_response, &answer) < 0 ||
        !call_portal(bus.get(), wanted, proposed))
        return false;
    while (!answer.here && !stop) {
        const int status = sd_bus_process(bus.get(), nullptr);
        if (status < 0) break;
        if (status == 0 && sd_bus_wait(bus.get(), kLookMicroseconds) < 0) break;
    }
    chosen = answer.chosen;
    return true;
}

}  // namespace ewa::viewer
#else
namespace ewa::viewer {

bool ask_portal(Wanted /*wanted*/, const std::filesystem::path& /*proposed*/,
                const std::atomic<bool>& /*stop*/, std::filesystem::path& /*chosen*/) {
    return false;
}

}  // namespace ewa::viewer
#endif
