// SPDX-License-Identifier: Apache-2.0
#include "report/scene_page.h"

#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string_view>

#include "report/chart.h"
#include "report/pictures.h"

// Made by cmake/EwaPage.cmake.
extern const unsigned char ewa_page_text[];
extern const std::size_t ewa_page_size;

namespace ewa::report {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kBudget = 1'000'000;  // splats on the screen, of a page with levels

Json numbers(const glm::dvec3& v) {
    return {v.x, v.y, v.z};
}

Json view_json(const Camera& camera) {
    Json rows = Json::array();
    for (int r = 0; r < 3; ++r)
        rows.push_back({camera.rotation[0][r], camera.rotation[1][r], camera.rotation[2][r]});
    return {{"width", camera.width}, {"height", camera.height},
            {"fx", camera.fx},       {"fy", camera.fy},
            {"cx", camera.cx},       {"cy", camera.cy},
            {"rows", rows},          {"eye", numbers(camera.position())}};
}

/// JSON that cannot end the element that holds it.
std::string settings_text(const ScenePage& page) {
    Json settings = {{"background", page.background},
                     {"up", numbers(page.up)},
                     {"target", numbers(page.target)},
                     {"start", view_json(page.start)},
                     {"cameras", Json::array()}};
    if (page.portrait) settings["portrait"] = view_json(*page.portrait);
    if (!page.levels.empty()) {
        settings["levels"] = page.levels;
        settings["budget"] = kBudget;
    }
    for (const PageView& view : page.views) {
        Json json = view_json(view.camera);
        json["name"] = view.name;
        settings["cameras"].push_back(std::move(json));
    }
    std::string text = settings.dump(-1, ' ', true, Json::error_handler_t::replace);
    for (size_t at = 0; (at = text.find('<', at)) != std::string::npos;) text.replace(at, 1, "\\u003c");
    return text;
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
    fill("@CONNECT@", page.levels.empty() ? "" : "; connect-src 'self'");
    const std::string title = escape_html(page.title);
    fill("@TITLE@", title);
    fill("@TITLE@", title);
    fill("@SETTINGS@", settings_text(page));
    fill("@SCENE@", base64({reinterpret_cast<const unsigned char*>(page.sog.data()), page.sog.size()}));
    html += rest;
    return html;
}

}  // namespace ewa::report
