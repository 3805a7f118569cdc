// SPDX-License-Identifier: Apache-2.0
// An HTML file that shows a scene of splats in a browser: one inside it without a network, or levels of detail beside it from a web server.
// Its program is in web/.
#pragma once
#include <array>
#include <filesystem>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "ewa/camera.h"
#include "ewa/splat_scene.h"

namespace ewa::io {

struct PageView {
    std::string name;
    Camera camera;
};

struct ScenePage {
    std::string title;
    std::string sog;          // a .sog file of version 2 with stored entries; empty with `levels`
    std::string levels = {};  // name of the lod-meta.json beside the page; empty: the scene is in the page
    bool live = false;        // the page shows the splats of a training that runs; `sog` is empty
    std::array<float, 3> background{};    // RGB, 0..1
    Camera start;                         // the first view
    std::optional<Camera> portrait = {};  // that of a window which is higher than wide; empty: `start`
    glm::dvec3 up{0, -1, 0}, target{0};   // world: unit length; the point that the views turn about
    std::vector<PageView> views = {};     // those that the page can go to
    std::vector<FilmKey> film = {};       // as PageOptions::film
};

/// The text of the file.
std::string scene_page_html(const ScenePage& page);

/// The page that asks the server it comes from for the splats of a training (live/server.h). gaussians: where its views lead.
std::string live_page(const Gaussians& gaussians, const PageOptions& options);

/// The levels of an unbundled NAME.html: NAME-levels/lod-meta.json beside it.
std::filesystem::path levels_of_page(const std::filesystem::path& page);

}  // namespace ewa::io
