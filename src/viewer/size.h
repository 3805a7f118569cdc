// SPDX-License-Identifier: Apache-2.0
// Width and height in px.
#pragma once

namespace ewa::viewer {

struct Size {
    int width = 0, height = 0;
    bool operator==(const Size&) const = default;
};

}  // namespace ewa::viewer
