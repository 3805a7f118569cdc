// SPDX-License-Identifier: Apache-2.0
#include "report/work_precision.h"

#include <nlohmann/json.hpp>

namespace ewa::report {
namespace {

nlohmann::ordered_json table_json(const WorkTable& table) {
    nlohmann::ordered_json rows = nlohmann::ordered_json::array();
    for (const auto& [name, values] : table.rows) {
        nlohmann::ordered_json row{{table.columns.front(), name}};
        for (size_t i = 0; i < values.size(); ++i) row[table.columns[i + 1]] = values[i];
        rows.push_back(std::move(row));
    }
    return {{"title", table.title}, {"note", table.note}, {"rows", rows}};
}

}  // namespace

nlohmann::ordered_json work_precision_json(const WorkPrecision& diagram) {
    nlohmann::ordered_json json{
        {"schema", "ewa-work-precision-1"}, {"title", diagram.title},
        {"time", diagram.x_label},          {"error", diagram.y_label},
        {"notes", diagram.notes},           {"series", nlohmann::ordered_json::array()}};
    for (const WorkSeries& series : diagram.series) {
        nlohmann::ordered_json points = nlohmann::ordered_json::array();
        for (const WorkPoint& p : series.points)
            points.push_back({{"name", p.name},
                              {"time", p.time},
                              {"error", p.error},
                              {"worst", p.worst},
                              {"verdict", p.verdict}});
        json["series"].push_back({{"name", series.name}, {"points", points}});
    }
    json["tables"] = nlohmann::ordered_json::array();
    for (const WorkTable& table : diagram.tables) json["tables"].push_back(table_json(table));
    return json;
}

}  // namespace ewa::report
