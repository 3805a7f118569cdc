// SPDX-License-Identifier: Apache-2.0
// Where the images of ewa render go: a file for each view, or one contact sheet.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cli/contact_sheet.h"
#include "cli/output.h"
#include "ewa/renderer.h"

namespace ewa::cli {

/// What to draw for --mode; opacity comes with colours.
Drawing drawing_of(const std::string& mode);

struct ImageKind {
    std::string mode, format;  // --mode; png, jpg or exr
    bool transparent = false;
};

class RenderOutput {
  public:
    /// files: of each view, or with `sheet` the one of all.
    RenderOutput(ImageKind kind, std::vector<std::filesystem::path> files, Progress& progress,
                 std::optional<ContactSheet> sheet)
        : kind_(std::move(kind)), files_(std::move(files)), progress_(progress), sheet_(std::move(sheet)) {}

    /// The image of view i, in their order. panorama: it shows all directions.
    void add(size_t i, Rendering&& rendering, bool panorama);
    void finish();

  private:
    ImageKind kind_;
    std::vector<std::filesystem::path> files_;
    Progress& progress_;
    std::optional<ContactSheet> sheet_;
};

}  // namespace ewa::cli
