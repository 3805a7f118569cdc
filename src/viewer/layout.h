// SPDX-License-Identifier: Apache-2.0
// The layout of the window: the panel at the left, the render and the image beside it. Sizes are in px of the framebuffer,
// unless stated otherwise. Independent of the window.
#pragma once
#include "viewer/byte_image.h"

namespace ewa::viewer {

enum class Comparison { none, beside, wipe, difference };

/// Position and size in px. The origin is the window's top left corner.
struct Rectangle {
    int x = 0, y = 0, width = 0, height = 0;
    bool operator==(const Rectangle&) const = default;
    Size size() const { return {width, height}; }
};

/// The largest rectangle with the aspect ratio of `shape`, centred in `space`.
Rectangle fitted(Size shape, const Rectangle& space);

inline constexpr double kTextHeight = 16;     // of the panel's text, at a content scale of 1
inline constexpr double kPanelWidth = 19;     // in heights of the text
inline constexpr double kMostPanel = 0.45;    // share of the window's width
inline constexpr double kBarsNeed = 22;       // in heights of the text: the least side of a picture with bars
inline constexpr Size kUsualSize{1280, 800};  // of a picture that no camera sets

/// The scale of text for a monitor whose desktop sets none: 1 for usual monitors, and by the height on dense ones. millimetres: its
/// size; zero if unknown.
double monitor_scale(Size pixels, Size millimetres);

/// The width of the panel in a window of this width. It is less than usual where that leaves the bars of the editor room.
int panel_width(int window, double text_height);

/// In px of the framebuffer: what the bars take of the window.
struct BarSizes {
    int top = 0, left = 0, bottom = 0;
};
BarSizes bar_sizes(double text_height);

/// The part of the window that the panel does not cover. A panel wider than kMostPanel of the window lies over the picture, so
/// this part is the whole window. panel: the panel's width; 0: it is hidden.
Rectangle free_area(Size window, int panel);

/// Places of both pictures in the window. With Comparison::beside, each gets half of the area, left and right or one above
/// the other, whichever shows the image larger. Else the render fills the area, and the image the part that its camera saw.
struct Arrangement {
    Rectangle rendering, image;
};
Arrangement arrange(Comparison comparison, const Rectangle& area, Size image);

/// The size of a new window with the panel and a picture of this shape beside it: about 1100 px wide and 880 px high
/// times `scale`, larger for a wide picture, and never larger than most of the desktop. desktop: zero if unknown.
Size window_size(Size picture, int panel, Size desktop, double scale);

/// A part of an image. It is cut to what the image has of it.
Image part_of(const Image& image, const Rectangle& part);

}  // namespace ewa::viewer
