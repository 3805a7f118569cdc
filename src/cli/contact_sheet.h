// SPDX-License-Identifier: Apache-2.0
// Many small images in one: a contact sheet.
#pragma once
#include <cstddef>
#include <vector>

#include "ewa/camera.h"
#include "ewa/image.h"

namespace ewa::cli {

/// The same view with twice the pixels that a contact sheet shows of it, or fewer.
Camera thumbnail_of(const Camera& camera);

class ContactSheet {
  public:
    /// views: at least one, in their order on the sheet: row by row, about half wider than high.
    explicit ContactSheet(const std::vector<Camera>& views);

    /// The next image, of any size: reduced to fit its place, and in its middle.
    void add(const Image& image);
    const Image& image() const { return sheet_; }

  private:
    int cell_height_ = 0, columns_ = 0;
    size_t added_ = 0;
    Image sheet_;
};

}  // namespace ewa::cli
