// SPDX-License-Identifier: Apache-2.0
#include "io/datasets/view_list.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <nlohmann/json.hpp>

#include "core/atomic_file.h"
#include "core/json_field.h"
#include "scene/readout.h"

namespace ewa::io {
namespace {

using Json = nlohmann::ordered_json;

constexpr uint64_t kLargestView = 2048;  // bytes of the file
constexpr double kLatestTime = 1e6;      // s
constexpr double kRotationTolerance = 1e-6;

bool is_rotation(const glm::dmat3& r) {
    const glm::dmat3 product = r * glm::transpose(r);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            if (!(std::abs(product[i][j] - (i == j)) < kRotationTolerance)) return false;
    return glm::determinant(r) > 0;
}

void read_pose(const core::JsonField& view, const std::string& end, glm::dmat3& to_rotation,
               glm::dvec3& to_translation) {
    const auto r = view.numbers(("rotation" + end).c_str(), 9);
    const auto t = view.numbers(("translation" + end).c_str(), 3);
    to_rotation = {r[0], r[3], r[6], r[1], r[4], r[7], r[2], r[5], r[8]};
    to_translation = {t[0], t[1], t[2]};
    if (!is_rotation(to_rotation)) view.fail("rotation" + end + " is not orthonormal");
}

std::optional<Readout> parse_readout(const core::JsonField& view) {
    if (!view.has("rolling_shutter")) return std::nullopt;
    const std::string order = view.text("rolling_shutter");
    const auto from = core::find_value(scene::kReadoutWords, order);
    if (!from) view.fail("rolling_shutter '" + order.substr(0, 40) + "' is no direction");
    Readout end{*from, {}, {}};
    read_pose(view, "_end", end.rotation, end.translation);
    return end;
}

NamedView parse_view(const core::JsonField& view) {
    NamedView named;
    named.name = view.text("name", {});
    Camera& camera = named.camera;
    camera.width = int(view.whole("width", 65536, 1));
    camera.height = int(view.whole("height", 65536, 1));
    for (const auto& [name, value] :
         {std::pair{"fx", &camera.fx}, {"fy", &camera.fy}, {"cx", &camera.cx}, {"cy", &camera.cy}})
        *value = view.number(name);
    if (!(camera.fx > 0) || !(camera.fy > 0)) view.fail("a focal length is not above zero");
    read_pose(view, "", camera.rotation, camera.translation);
    if (view.has("pivot")) {
        const auto pivot = view.numbers("pivot", 3);
        named.pivot = {pivot[0], pivot[1], pivot[2]};
    }
    camera.readout = parse_readout(view);
    named.aligned = view.flag("aligned");
    if (view.has("time")) named.time = view.number("time");
    return named;
}

/// before: the view before it, or null.
void check_time(const core::JsonField& field, const NamedView& view, const NamedView* before) {
    if (before && before->time.has_value() != view.time.has_value())
        field.fail("either all views have a time or none has");
    const double earliest = before && before->time ? *before->time : -1;
    if (view.time && !(*view.time >= 0 && *view.time > earliest && *view.time <= kLatestTime))
        field.fail("time is not after that of the view before, or not from 0 to a million");
}

}  // namespace

Json camera_json(const std::string& name, const Camera& c) {
    const auto rows = [](const glm::dmat3& rotation) {
        Json values = Json::array();
        for (int row = 0; row < 3; ++row)
            for (int column = 0; column < 3; ++column) values.push_back(rotation[column][row]);
        return values;
    };
    Json view{{"name", name},
              {"width", c.width},
              {"height", c.height},
              {"fx", c.fx},
              {"fy", c.fy},
              {"cx", c.cx},
              {"cy", c.cy},
              {"rotation", rows(c.rotation)},
              {"translation", {c.translation.x, c.translation.y, c.translation.z}}};
    if (!c.readout) return view;
    const glm::dvec3& end = c.readout->translation;
    view["rolling_shutter"] = core::word_for(scene::kReadoutWords, c.readout->from);
    view["rotation_end"] = rows(c.readout->rotation);
    view["translation_end"] = {end.x, end.y, end.z};
    return view;
}

std::vector<NamedView> read_views(const std::filesystem::path& path, size_t most) {
    const auto top = core::JsonField::of_file(path, {.bytes = most * kLargestView, .not_finite = true});
    const nlohmann::json& document = top.value();
    if (!document.contains("views") || !document["views"].is_array())
        top.fail("is not a list of views: expected an object with \"views\"");
    if (document["views"].size() > most) top.fail("more than " + std::to_string(most) + " views");
    std::vector<NamedView> views;
    for (const nlohmann::json& entry : document["views"]) {
        const core::JsonField field(entry, top.where() + ": view " + std::to_string(views.size()));
        NamedView view = parse_view(field);
        check_time(field, view, views.empty() ? nullptr : &views.back());
        views.push_back(std::move(view));
    }
    return views;
}

std::vector<double> times_of(const std::vector<NamedView>& views, double distance) {
    std::vector<double> times;
    for (const NamedView& view : views) times.push_back(view.time.value_or(distance * double(times.size())));
    return times;
}

void write_views(const std::filesystem::path& path, const std::vector<NamedView>& views) {
    Json list = Json::array();
    for (const NamedView& view : views) {
        list.push_back(camera_json(view.name, view.camera));
        list.back()["pivot"] = {view.pivot.x, view.pivot.y, view.pivot.z};
        if (view.time) list.back()["time"] = *view.time;
    }
    core::write_text_file(path,
                          Json{{"views", list}}.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
}

}  // namespace ewa::io
