// SPDX-License-Identifier: Apache-2.0
#include "io/datasets/view_list.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <nlohmann/json.hpp>

#include "core/atomic_file.h"
#include "core/json.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "scene/readout.h"

namespace ewa::io {
namespace {

using Json = nlohmann::ordered_json;

constexpr uint64_t kLargestView = 2048;  // bytes of the file
constexpr double kRotationTolerance = 1e-6;

std::vector<double> numbers(const Json& object, const char* name, size_t count) {
    const Json& list = object.at(name);
    std::vector<double> values =
        list.is_array() ? list.get<std::vector<double>>() : std::vector{list.get<double>()};
    if (values.size() != count)
        throw InputError(std::string(name) + " needs " + std::to_string(count) + " numbers");
    for (const double value : values)
        if (!std::isfinite(value)) throw InputError(std::string(name) + " is not finite");
    return values;
}

bool is_rotation(const glm::dmat3& r) {
    const glm::dmat3 product = r * glm::transpose(r);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            if (!(std::abs(product[i][j] - (i == j)) < kRotationTolerance)) return false;
    return glm::determinant(r) > 0;
}

void read_pose(const std::vector<double>& rotation, const std::vector<double>& translation,
               glm::dmat3& to_rotation, glm::dvec3& to_translation) {
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column)
            to_rotation[column][row] = rotation[size_t(3 * row + column)];
        to_translation[row] = translation[size_t(row)];
    }
    if (!is_rotation(to_rotation)) throw InputError("rotation is not orthonormal");
}

std::optional<Readout> parse_readout(const Json& object) {
    if (!object.contains("rolling_shutter")) return std::nullopt;
    const auto order = object.at("rolling_shutter").get<std::string>();
    const auto from = core::find_value(scene::kReadoutWords, order);
    if (!from)
        throw InputError("rolling_shutter '" + core::one_line(order.substr(0, 40)) + "' is no direction");
    Readout end{*from, {}, {}};
    read_pose(numbers(object, "rotation_end", 9), numbers(object, "translation_end", 3), end.rotation,
              end.translation);
    return end;
}

NamedView parse_view(const Json& object) {
    NamedView view;
    view.name = object.value("name", std::string());
    Camera& camera = view.camera;
    for (const auto& [name, side] : {std::pair{"width", &camera.width}, {"height", &camera.height}}) {
        const double value = numbers(object, name, 1)[0];
        if (!(value >= 1 && value <= 65536)) throw InputError(std::string(name) + " is not in 1..65536");
        *side = int(value);
    }
    for (const auto& [name, value] :
         {std::pair{"fx", &camera.fx}, {"fy", &camera.fy}, {"cx", &camera.cx}, {"cy", &camera.cy}})
        *value = numbers(object, name, 1)[0];
    if (!(camera.fx > 0) || !(camera.fy > 0)) throw InputError("a focal length is not above zero");
    const auto rotation = numbers(object, "rotation", 9), translation = numbers(object, "translation", 3),
               pivot = object.contains("pivot") ? numbers(object, "pivot", 3) : std::vector<double>(3);
    read_pose(rotation, translation, camera.rotation, camera.translation);
    for (int k = 0; k < 3; ++k) view.pivot[k] = pivot[size_t(k)];
    camera.readout = parse_readout(object);
    view.aligned = object.value("aligned", false);
    return view;
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
    const Json document =
        core::read_json_file<Json>(path, {.bytes = most * kLargestView, .not_finite = true});
    if (!document.is_object() || !document.contains("views") || !document["views"].is_array())
        throw InputError(path.string() + ": is not a list of views: expected an object with \"views\"");
    if (document["views"].size() > most)
        throw InputError(path.string() + ": more than " + std::to_string(most) + " views");
    std::vector<NamedView> views;
    for (const Json& entry : document["views"]) {
        const std::string where = path.string() + ": view " + std::to_string(views.size()) + ": ";
        try {
            views.push_back(parse_view(entry));
        } catch (const InputError& problem) {
            throw InputError(where + problem.what());
        } catch (const Json::exception& problem) {
            throw InputError(where + std::string(core::plain_reason(problem.what())));
        }
    }
    return views;
}

void write_views(const std::filesystem::path& path, const std::vector<NamedView>& views) {
    Json list = Json::array();
    for (const NamedView& view : views) {
        list.push_back(camera_json(view.name, view.camera));
        list.back()["pivot"] = {view.pivot.x, view.pivot.y, view.pivot.z};
    }
    core::write_text_file(path,
                          Json{{"views", list}}.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
}

}  // namespace ewa::io
