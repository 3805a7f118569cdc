// SPDX-License-Identifier: Apache-2.0
#include "io/splats/render_mark.h"

#include <algorithm>
#include <optional>

#include "core/text.h"

namespace ewa::io {

namespace {

enum class Mark { plain, antialiased, surfels };

std::optional<Mark> mark_of(const std::string& comment) {
    std::string_view rest = comment;
    const std::string key = core::lower(core::next_word(rest)), value = core::lower(core::trim(rest));
    if (key == "splatrendermode:") {
        if (value == "default") return Mark::plain;
        if (value == "mip") return Mark::antialiased;
        if (value == kSurfels) return Mark::surfels;
    }
    if (key == "antialiased" && value == "0") return Mark::plain;
    if (key == "antialiased" && value == "1") return Mark::antialiased;
    return std::nullopt;
}

/// The last mark among the comments, which lose all of them.
std::optional<Mark> take_mark(std::vector<std::string>& comments) {
    std::optional<Mark> last;
    std::erase_if(comments, [&](const std::string& comment) {
        const std::optional<Mark> mark = mark_of(comment);
        if (mark) last = mark;
        return mark.has_value();
    });
    return last;
}

}  // namespace

void take_marks(SplatScene& scene) {
    const std::optional<Mark> mark = take_mark(scene.comments);
    scene.antialiased = mark == Mark::antialiased;
    if (mark == Mark::surfels) remark_surfels(scene);
}

void remark_surfels(SplatScene& scene) {
    const std::string text = "the splats were trained as flat ones (2DGS); ewa draws them as ellipsoids";
    if (std::ranges::find(scene.remarks, text) == scene.remarks.end()) scene.remarks.push_back(text);
}

std::vector<std::string> marked_comments(const SaveOptions& options) {
    std::vector<std::string> comments = options.comments;
    const std::optional<Mark> mark = take_mark(comments);
    for (std::string& comment : comments) comment = core::one_line(comment);
    if (options.antialiased || mark == Mark::antialiased) comments.emplace_back("SplatRenderMode: mip");
    return comments;
}

}  // namespace ewa::io
