// SPDX-License-Identifier: Apache-2.0
#include "io/splats/scene_page.h"

#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string_view>

#include "core/atomic_file.h"
#include "core/html.h"
#include "ewa/dataset.h"
#include "io/splats/formats.h"
#include "io/splats/levels.h"
#include "io/splats/prepare.h"
#include "scene/framing.h"

// Made by cmake/EwaPage.cmake.
extern const unsigned char ewa_page_text[];
extern const std::size_t ewa_page_size;

namespace ewa::io {
namespace {

using PageJson = nlohmann::ordered_json;

constexpr int kBudget = 1'000'000;  // splats on the screen, of a page with levels
constexpr int kStartWidth = 1280, kStartHeight = 720;

PageJson vector_json(const glm::dvec3& v) {
    return {v.x, v.y, v.z};
}

PageJson view_json(const Camera& camera) {
    PageJson rows = PageJson::array();
    for (int r = 0; r < 3; ++r)
        rows.push_back({camera.rotation[0][r], camera.rotation[1][r], camera.rotation[2][r]});
    return {{"width", camera.width}, {"height", camera.height},
            {"fx", camera.fx},       {"fy", camera.fy},
            {"cx", camera.cx},       {"cy", camera.cy},
            {"rows", rows},          {"eye", vector_json(camera.position())}};
}

/// JSON that cannot end the element that holds it.
std::string settings_text(const ScenePage& page) {
    PageJson settings = {{"background", page.background},
                         {"up", vector_json(page.up)},
                         {"target", vector_json(page.target)},
                         {"start", view_json(page.start)},
                         {"cameras", PageJson::array()}};
    if (page.live) settings["live"] = true;
    if (page.portrait) settings["portrait"] = view_json(*page.portrait);
    if (!page.levels.empty()) {
        settings["levels"] = page.levels;
        settings["budget"] = kBudget;
    }
    for (const PageView& view : page.views) {
        PageJson camera = view_json(view.camera);
        camera["name"] = view.name;
        settings["cameras"].push_back(std::move(camera));
    }
    for (const FilmKey& key : page.film) {
        PageJson camera = view_json(key.camera);
        camera["time"] = key.time;
        settings["film"].push_back(std::move(camera));
    }
    std::string text = settings.dump(-1, ' ', true, PageJson::error_handler_t::replace);
    for (size_t at = 0; (at = text.find('<', at)) != std::string::npos;) text.replace(at, 1, "\\u003c");
    return text;
}

/// Each page of a folder has levels of its own. Relative to it.
std::filesystem::path levels_beside(const std::filesystem::path& page) {
    return std::filesystem::path(page.stem().string() + "-levels") / kLevelsName;
}

/// What the page shows before anybody moves.
void set_views(ScenePage& page, const Gaussians& gaussians, const Dataset* cameras) {
    scene::FramingHints hints;
    if (cameras && !cameras->frames.empty()) {
        for (const Frame& frame : cameras->frames)
            page.views.push_back({frame.name, scene::pinhole_at(frame.camera)});
        hints.up = scene::mean_up(*cameras);
        hints.forward = glm::transpose(cameras->frames[0].camera.rotation)[2];
    }
    const scene::Framing framing = scene::frame_scene(gaussians, kStartWidth, kStartHeight, hints);
    page.start = page.views.empty() ? framing.camera : page.views.front().camera;
    if (page.views.empty())
        page.portrait = scene::frame_scene(gaussians, kStartHeight, kStartWidth, hints).camera;
    page.target = framing.target;
    page.up = framing.up;
}

}  // namespace

std::string scene_page_html(const ScenePage& page) {
    std::string_view rest(reinterpret_cast<const char*>(ewa_page_text), ewa_page_size);
    std::string html;
    html.reserve(rest.size() + page.sog.size() / 3 * 4 + 4096);
    // One after another: what takes the place of a mark is not searched for marks.
    const auto fill = [&](std::string_view mark, const std::string& text) {
        const size_t at = rest.find(mark);
        if (at == std::string_view::npos) throw std::logic_error("the page has no " + std::string(mark));
        html += rest.substr(0, at);
        html += text;
        rest.remove_prefix(at + mark.size());
    };
    fill("@CONNECT@", page.levels.empty() && !page.live ? "" : "; connect-src 'self'");
    const std::string title = core::escape_html(page.title);
    fill("@TITLE@", title);
    fill("@TITLE@", title);
    fill("@SETTINGS@", settings_text(page));
    fill("@SCENE@", core::base64({reinterpret_cast<const unsigned char*>(page.sog.data()), page.sog.size()}));
    html += rest;
    return html;
}

std::string live_page(const Gaussians& gaussians, const PageOptions& options) {
    ScenePage page;
    page.title = options.title;
    page.background = options.background;
    page.live = true;
    set_views(page, gaussians, options.cameras);
    return scene_page_html(page);
}

std::filesystem::path levels_of_page(const std::filesystem::path& page) {
    return page.parent_path() / levels_beside(page);
}

std::vector<std::string> write_page(const std::filesystem::path& path, Gaussians gaussians,
                                    const SaveOptions& options) {
    ScenePage page;
    page.title = options.page.title.empty() ? path.stem().string() : options.page.title;
    page.background = options.page.background;
    page.film = options.page.film;
    core::AtomicFile file(path);
    set_views(page, gaussians, options.page.cameras);
    const bool unbundled = options.page.unbundled;
    std::vector<std::string> remarks =
        prepare(gaussians, row_of(unbundled ? SplatFormat::sog_levels : SplatFormat::sog));
    std::vector<std::string> more;
    if (unbundled) {
        page.levels = levels_beside(path).generic_string();
        more = write_levels(levels_of_page(path), std::move(gaussians), options);
    } else {
        page.sog = pack_sog(path, gaussians, options, more);
    }
    remarks.insert(remarks.end(), more.begin(), more.end());
    file.write(scene_page_html(page));
    file.commit();
    return remarks;
}

}  // namespace ewa::io
