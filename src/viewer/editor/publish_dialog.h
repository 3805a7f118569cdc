// SPDX-License-Identifier: Apache-2.0
// The dialog that publishes the active scene: a web page, a SOG, or streamed levels.
#pragma once
#include <array>
#include <functional>
#include <string>

#include "ewa/splat_scene.h"
#include "viewer/editor/editor.h"
#include "viewer/editor/modal.h"
#include "viewer/editor/publish.h"

namespace ewa::viewer {

class PublishDialog {
  public:
    PublishDialog(Editor& editor, FileDialog& files, std::function<void()> wake);

    /// Begins with the active scene. views: the views that a page may offer; empty: none.
    void begin(const std::filesystem::path& views);
    /// Draws the modal. Returns whether it stays open.
    bool draw();
    /// Takes the answers of the file dialog and of the program.
    void take();
    bool running() const { return publisher_.running(); }

  private:
    void choose(int kind);
    void draw_form();
    void draw_work();
    void draw_done();
    SplatFormat format() const;  // the chosen one
    void start();
    void open(const std::filesystem::path& path);

    Editor& editor_;
    FileDialog& files_;
    Publisher publisher_;
    PathField path_;
    int kind_ = 0, levels_ = 0;
    std::array<char, 256> title_{};
    bool with_views_ = false;
    std::filesystem::path views_, out_;
    size_t left_ = 0;  // splats that are written
    std::string problem_, text_,
        wrote_;  // of opening the result; of the program that has ended; what it wrote
    bool done_ = false;
};

}  // namespace ewa::viewer
