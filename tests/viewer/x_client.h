// SPDX-License-Identifier: Apache-2.0
// A client of the X server beside the viewer: sees the pixels that the server shows, and drops files on
// windows as a file manager does.
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "ewa/image.h"

namespace ewa::test {

class XClient {
  public:
    /// Throws std::runtime_error where there is no such display.
    explicit XClient(const std::string& display);
    ~XClient();

    /// The first window whose title ends in this, within `seconds`.
    std::optional<uint32_t> window_titled(const std::string& end, double seconds = 60) const;
    /// RGB, as it stands on the display: panel, hint and all.
    Image pixels(uint32_t window) const;
    /// The same once nothing has moved for half a second, or after ten. before: not until something else than
    /// this is there.
    Image pixels_at_rest(uint32_t window, const Image* before = nullptr) const;
    /// What desktop settings say that clients should know, e.g. "Xft.dpi: 192".
    void set_resources(const std::string& text) const;

    /// Plays the source of a drag (XDND 5) that ends in the middle of the window. uris: what the dragged
    /// text/uri-list holds, its line ends included. Whether the window took it.
    bool drop(uint32_t window, const std::string& uris) const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

/// file:///…, with everything but letters, digits and -._~/ as percent escapes, and a line end.
std::string uri_of(const std::string& path);

}  // namespace ewa::test
