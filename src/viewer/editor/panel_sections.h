// SPDX-License-Identifier: Apache-2.0
// The sections of the panel of edits. Each draws into the present window of ImGui.
#pragma once
#include <array>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "viewer/editor/edit_words.h"
#include "viewer/editor/editor.h"
#include "viewer/editor/histogram.h"
#include "viewer/editor/panel_controls.h"
#include "viewer/editor/texts.h"
#include "viewer/latest.h"

namespace ewa::viewer {

/// Performs a step on the selection, or on all splats that can be selected if none is.
void perform_on_selection(Editor& editor, const char* title, std::vector<edit::Words> edits);

class SelectionSection {
  public:
    void draw(Editor& editor);

  private:
    void draw_shape(Editor& editor);
    void draw_growth(Editor& editor);
    double distance_ = 0;  // of growing, world units; 0: not chosen yet
};

class MoveSection {
  public:
    void draw(Editor& editor);

  private:
    Placement placement_;
    uint64_t version_ = 0;
    size_t scene_ = 0;
};

class ColourSection {
  public:
    void draw(Editor& editor);
    bool waiting() const { return sent_ || shown_ != last_; }

  private:
    const edit::Adjustment& in_effect(const Editor& editor);
    void settle(Editor& editor);
    edit::Adjustment shown_, last_;         // in the controls; in effect at the last frame
    std::optional<edit::Adjustment> sent_;  // to the editor, which has not done it yet
    uint64_t sent_version_ = 0;
    int idle_frames_ = 0;
    /// In effect after `from_` steps and each one more, as long as these are steps of this section.
    std::vector<edit::Adjustment> applied_{{}};
    size_t from_ = 0, scene_ = 0;
};

class CleanSection {
  public:
    void draw(Editor& editor);
    /// Ends the preview, if there is one.
    void end(Editor& editor);
    bool waiting() const { return waiting_; }

  private:
    void draw_rule(Editor& editor, const ui::Text& text, std::initializer_list<ui::Button> first,
                   const char* title, const std::vector<std::string>& shapes);
    void preview(Editor& editor, const std::vector<std::string>& shapes);
    void remove(Editor& editor, const char* title, const std::vector<std::string>& shapes);
    std::vector<std::string> previewed_;  // shapes of edit/shapes.h; empty: none
    std::string_view rule_;               // the rule of it, also while its number is changed
    uint64_t version_ = 0;
    size_t scene_ = 0;
    bool waiting_ = false;
    int views_ = 3;
    float opacity_ = 0.02f, scale_ = 0;  // scale_: 0: not chosen yet
};

class HistogramSection {
  public:
    HistogramSection();
    void draw(Editor& editor);
    bool waiting() const;

  private:
    struct Request {
        std::shared_ptr<const Gaussians> splats;
        std::shared_ptr<const std::vector<uint8_t>> states;
        edit::Cameras cameras;
        HistogramColumn column;
        uint64_t number = 0;
    };
    struct Counted {
        Histogram histogram;
        std::string problem;
        uint64_t number = 0;
    };
    void ask(Editor& editor, const HistogramColumn& column);
    void draw_bins(Editor& editor, const Histogram& histogram);
    std::string column_ = "opacity";
    int counts_ = 0;               // 1: logarithms
    std::optional<size_t> first_;  // the bin where a drag began
    Request asked_;
    Latest<Request, Counted> counting_;
};

void draw_scenes(Editor& editor);
void draw_history(Editor& editor);

}  // namespace ewa::viewer
