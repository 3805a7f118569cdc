// SPDX-License-Identifier: Apache-2.0
#include "viewer/x_client.h"

#include <xcb/xcb.h>

#include <array>
#include <cctype>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

namespace ewa::test {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kXdndVersion = 5;
constexpr auto kPatience = std::chrono::seconds(20);
constexpr uint32_t kMostTitle = 1024;  // bytes

struct Free {
    void operator()(void* memory) const { std::free(memory); }
};
template <class Reply>
using Owned = std::unique_ptr<Reply, Free>;

}  // namespace

struct XClient::State {
    xcb_connection_t* connection = nullptr;
    xcb_screen_t* screen = nullptr;
    xcb_window_t own = 0;  // what the drags come from

    xcb_atom_t atom(const char* name) const {
        const auto cookie = xcb_intern_atom(connection, 0, uint16_t(std::strlen(name)), name);
        const Owned<xcb_intern_atom_reply_t> reply(xcb_intern_atom_reply(connection, cookie, nullptr));
        if (!reply) throw std::runtime_error("the X server has gone");
        return reply->atom;
    }
    std::string title(xcb_window_t window) const {
        const auto cookie = xcb_get_property(connection, 0, window, atom("_NET_WM_NAME"), atom("UTF8_STRING"),
                                             0, kMostTitle / 4);
        const Owned<xcb_get_property_reply_t> reply(xcb_get_property_reply(connection, cookie, nullptr));
        if (!reply) return "";
        return {static_cast<const char*>(xcb_get_property_value(reply.get())),
                size_t(xcb_get_property_value_length(reply.get()))};
    }
    void tell(xcb_window_t window, const char* what, const std::array<uint32_t, 4>& data) const {
        xcb_client_message_event_t event{};
        event.response_type = XCB_CLIENT_MESSAGE;
        event.format = 32;
        event.window = window;
        event.type = atom(what);
        event.data.data32[0] = own;
        for (size_t i = 0; i < data.size(); ++i) event.data.data32[i + 1] = data[i];
        xcb_send_event(connection, 0, window, 0, reinterpret_cast<const char*>(&event));
        xcb_flush(connection);
    }
    /// Answers what is asked of the dragged data until the window has said `wanted`; its flags (the second
    /// word).
    std::optional<uint32_t> heard(const char* wanted, const std::string& uris) const;
    void give(const xcb_selection_request_event_t& request, const std::string& uris) const;
};

void XClient::State::give(const xcb_selection_request_event_t& request, const std::string& uris) const {
    const bool known = request.target == atom("text/uri-list");
    if (known)
        xcb_change_property(connection, XCB_PROP_MODE_REPLACE, request.requestor, request.property,
                            request.target, 8, uint32_t(uris.size()), uris.data());
    xcb_selection_notify_event_t event{};
    std::array<char, 32> bytes{};  // what every event is sent as
    static_assert(sizeof(event) <= sizeof(bytes));
    event.response_type = XCB_SELECTION_NOTIFY;
    event.time = request.time;
    event.requestor = request.requestor;
    event.selection = request.selection;
    event.target = request.target;
    event.property = known ? request.property : xcb_atom_t(XCB_ATOM_NONE);
    std::memcpy(bytes.data(), &event, sizeof(event));
    xcb_send_event(connection, 0, request.requestor, 0, bytes.data());
    xcb_flush(connection);
}

std::optional<uint32_t> XClient::State::heard(const char* wanted, const std::string& uris) const {
    const xcb_atom_t kind = atom(wanted);
    for (const auto until = Clock::now() + kPatience; Clock::now() < until;) {
        const Owned<xcb_generic_event_t> event(xcb_poll_for_event(connection));
        if (!event) {
            std::this_thread::sleep_for(std::chrono::milliseconds(2));
            continue;
        }
        const int type = event->response_type & 0x7f;  // the highest bit: sent by a client
        if (type == XCB_SELECTION_REQUEST)
            give(*reinterpret_cast<const xcb_selection_request_event_t*>(event.get()), uris);
        const auto* message = reinterpret_cast<const xcb_client_message_event_t*>(event.get());
        if (type == XCB_CLIENT_MESSAGE && message->type == kind) return message->data.data32[1];
    }
    return std::nullopt;
}

XClient::XClient(const std::string& display) : state_(std::make_unique<State>()) {
    State& s = *state_;
    s.connection = xcb_connect(display.c_str(), nullptr);
    if (xcb_connection_has_error(s.connection)) {
        xcb_disconnect(s.connection);
        throw std::runtime_error("no X server at " + display);
    }
    s.screen = xcb_setup_roots_iterator(xcb_get_setup(s.connection)).data;
    s.own = xcb_generate_id(s.connection);
    xcb_create_window(s.connection, XCB_COPY_FROM_PARENT, s.own, s.screen->root, 0, 0, 1, 1, 0,
                      XCB_WINDOW_CLASS_INPUT_OUTPUT, s.screen->root_visual, 0, nullptr);
}

XClient::~XClient() {
    xcb_disconnect(state_->connection);
}

std::optional<uint32_t> XClient::window_titled(const std::string& end, double seconds) const {
    const State& s = *state_;
    const auto until = Clock::now() + std::chrono::duration<double>(seconds);
    do {
        const Owned<xcb_query_tree_reply_t> tree(
            xcb_query_tree_reply(s.connection, xcb_query_tree(s.connection, s.screen->root), nullptr));
        if (!tree) return std::nullopt;
        const xcb_window_t* children = xcb_query_tree_children(tree.get());
        for (int i = 0; i < xcb_query_tree_children_length(tree.get()); ++i)
            if (s.title(children[i]).ends_with(end)) return children[i];
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    } while (Clock::now() < until);
    return std::nullopt;
}

Image XClient::pixels(uint32_t window) const {
    const State& s = *state_;
    const Owned<xcb_get_geometry_reply_t> shape(
        xcb_get_geometry_reply(s.connection, xcb_get_geometry(s.connection, window), nullptr));
    if (!shape) throw std::runtime_error("the window has gone");
    const auto cookie = xcb_get_image(s.connection, XCB_IMAGE_FORMAT_Z_PIXMAP, window, 0, 0, shape->width,
                                      shape->height, ~0u);
    const Owned<xcb_get_image_reply_t> reply(xcb_get_image_reply(s.connection, cookie, nullptr));
    const size_t count = size_t(shape->width) * shape->height;
    if (!reply || size_t(xcb_get_image_data_length(reply.get())) != 4 * count)
        throw std::runtime_error("the window's pixels cannot be had");
    Image image(shape->width, shape->height, 3);
    const uint8_t* bgrx = xcb_get_image_data(reply.get());
    for (size_t i = 0; i < count; ++i)
        for (size_t c = 0; c < 3; ++c) image.pixels[3 * i + c] = float(bgrx[4 * i + 2 - c]) / 255.0f;
    return image;
}

Image XClient::pixels_at_rest(uint32_t window, const Image* before) const {
    Image last = pixels(window);
    for (const auto until = Clock::now() + kPatience; before && Clock::now() < until;) {
        if (last.pixels != before->pixels) break;
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
        last = pixels(window);
    }
    for (int i = 0, equal = 0; i < 200 && equal < 10; ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
        Image now = pixels(window);
        equal = now.pixels == last.pixels ? equal + 1 : 0;
        last = std::move(now);
    }
    return last;
}

void XClient::set_resources(const std::string& text) const {
    const State& s = *state_;
    xcb_change_property(s.connection, XCB_PROP_MODE_REPLACE, s.screen->root, XCB_ATOM_RESOURCE_MANAGER,
                        XCB_ATOM_STRING, 8, uint32_t(text.size()), text.data());
    s.atom("RESOURCE_MANAGER");  // an answer: what was sent before it has arrived
}

bool XClient::drop(uint32_t window, const std::string& uris) const {
    const State& s = *state_;
    const Owned<xcb_translate_coordinates_reply_t> corner(xcb_translate_coordinates_reply(
        s.connection, xcb_translate_coordinates(s.connection, window, s.screen->root, 0, 0), nullptr));
    const Owned<xcb_get_geometry_reply_t> shape(
        xcb_get_geometry_reply(s.connection, xcb_get_geometry(s.connection, window), nullptr));
    if (!corner || !shape) return false;
    const uint32_t x = uint32_t(corner->dst_x + shape->width / 2),
                   y = uint32_t(corner->dst_y + shape->height / 2);
    xcb_set_selection_owner(s.connection, s.own, s.atom("XdndSelection"), XCB_CURRENT_TIME);
    s.tell(window, "XdndEnter", {uint32_t(kXdndVersion) << 24, s.atom("text/uri-list"), 0, 0});
    s.tell(window, "XdndPosition", {0, x << 16 | y, XCB_CURRENT_TIME, s.atom("XdndActionCopy")});
    const auto status = s.heard("XdndStatus", uris);
    if (!status || !(*status & 1)) {
        s.tell(window, "XdndLeave", {0, 0, 0, 0});
        return false;
    }
    s.tell(window, "XdndDrop", {0, XCB_CURRENT_TIME, 0, 0});
    const auto finished = s.heard("XdndFinished", uris);
    return finished && *finished != 0;  // of GLFW: the number of bytes, where the specification has a flag
}

std::string uri_of(const std::string& path) {
    std::string uri = "file://";
    for (const char c : path) {
        const bool plain = std::isalnum(static_cast<unsigned char>(c)) || std::strchr("-._~/", c);
        char escape[4];
        std::snprintf(escape, sizeof(escape), "%%%02X", static_cast<unsigned>(static_cast<unsigned char>(c)));
        uri += plain ? std::string(1, c) : escape;
    }
    return uri + "\r\n";
}

}  // namespace ewa::test
