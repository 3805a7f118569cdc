// SPDX-License-Identifier: Apache-2.0
#include "live/protocol.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "core/json.h"
#include "core/text.h"
#include "ewa/error.h"

namespace ewa::live {
namespace {

using report::Json;

static_assert(std::endian::native == std::endian::little, "snapshots are written as they stand in memory");

constexpr char kMagic[4] = {'E', 'W', 'A', 'S'};
constexpr size_t kHeader = 40;  // bytes
constexpr const char* kStates[] = {"running", "paused", "done"};

Json figure(double value) {
    return std::isfinite(value) ? Json(value) : Json(nullptr);
}

template <class Splats, class Visit>
void for_each_array(Splats& gaussians, Visit visit) {
    visit(gaussians.means);
    visit(gaussians.quaternions);
    visit(gaussians.log_scales);
    visit(gaussians.opacity_logits);
    visit(gaussians.sh);
}

}  // namespace

std::string encode(const Status& status) {
    Json json;
    json["step"] = status.step;
    json["steps"] = status.steps;
    json["splats"] = status.splats;
    json["loss"] = figure(status.loss);
    json["seconds"] = figure(status.seconds);
    json["state"] = kStates[size_t(status.state)];
    json["commands"] = status.commands;
    json["metrics"] = Json::array();
    for (const report::MetricsLine& line : status.metrics) json["metrics"].push_back(report::to_json(line));
    return json.dump();
}

Status decode_status(const std::string& text) {
    const std::string name = "the trainer's status";
    const Json json = core::parse_json<Json>(text, name);
    try {
        Status status;
        status.step = int(report::whole_number(json, "step", INT32_MAX));
        status.steps = int(report::whole_number(json, "steps", INT32_MAX));
        status.splats = uint32_t(report::whole_number(json, "splats", UINT32_MAX));
        status.loss = report::number_or_nan(json, "loss");
        status.seconds = json.at("seconds").is_null() ? 0 : report::number_or_nan(json, "seconds");
        const std::string state = json.at("state").get<std::string>();
        status.state = state == "paused" ? State::paused : state == "done" ? State::done : State::running;
        status.commands = json.at("commands").get<bool>();
        const Json& lines = json.at("metrics");
        if (!lines.is_array() || lines.size() > kMostLines)
            throw InputError("\"metrics\" is no list of at most " + std::to_string(kMostLines) + " lines");
        for (const Json& line : lines) status.metrics.push_back(report::metrics_line(line));
        return status;
    } catch (const InputError& error) {
        throw InputError(name + " cannot be read: " + error.what());
    } catch (const Json::exception& error) {
        throw InputError(name + " cannot be read: " + core::one_line(error.what()));
    }
}

std::vector<std::byte> encode(const Snapshot& snapshot) {
    const Gaussians& g = snapshot.gaussians;
    size_t floats = 0;
    for_each_array(g, [&](const std::vector<float>& values) { floats += values.size(); });
    std::vector<std::byte> bytes(kHeader + 4 * floats);
    const uint32_t header[3] = {uint32_t(g.size()), uint32_t(g.sh_degree), uint32_t(snapshot.step)};
    std::memcpy(bytes.data(), kMagic, 4);
    std::memcpy(bytes.data() + 4, header, sizeof(header));
    const double origin[3] = {g.origin.x, g.origin.y, g.origin.z};
    std::memcpy(bytes.data() + 16, origin, sizeof(origin));
    size_t at = kHeader;
    for_each_array(g, [&](const std::vector<float>& values) {
        if (!values.empty()) std::memcpy(bytes.data() + at, values.data(), 4 * values.size());
        at += 4 * values.size();
    });
    return bytes;
}

Snapshot decode_snapshot(const std::vector<std::byte>& bytes) {
    uint32_t header[3] = {};
    if (bytes.size() < kHeader || std::memcmp(bytes.data(), kMagic, 4) != 0)
        throw InputError("the trainer's splats cannot be read: they do not begin with EWAS");
    std::memcpy(header, bytes.data() + 4, sizeof(header));
    if (header[1] > uint32_t(kMaxShDegree))
        throw InputError("the trainer's splats have SH degree " + std::to_string(header[1]));
    Snapshot snapshot;
    snapshot.step = int(header[2]);
    snapshot.gaussians.sh_degree = int(header[1]);
    const uint64_t floats = uint64_t(header[0]) * (11 + snapshot.gaussians.sh_stride());
    if (bytes.size() != kHeader + 4 * floats)  // before memory is taken
        throw InputError("the trainer's " + std::to_string(header[0]) + " splats are " +
                         std::to_string(bytes.size()) + " bytes, not " +
                         std::to_string(kHeader + 4 * floats));
    double origin[3] = {};
    std::memcpy(origin, bytes.data() + 16, sizeof(origin));
    for (int i = 0; i < 3; ++i) {
        if (!std::isfinite(origin[i]))
            throw InputError("the trainer's splats have an origin that is not finite");
        snapshot.gaussians.origin[i] = origin[i];
    }
    snapshot.gaussians.resize(header[0]);
    size_t at = kHeader;
    for_each_array(snapshot.gaussians, [&](std::vector<float>& values) {
        if (!values.empty()) std::memcpy(values.data(), bytes.data() + at, 4 * values.size());
        at += 4 * values.size();
    });
    return snapshot;
}

uint64_t payload_of(const std::string& line) {
    std::string_view rest = line;
    const std::string_view word = core::next_word(rest);
    if (word == "no") throw InputError("the trainer refuses: " + core::one_line(core::trim(rest)));
    const auto bytes = core::parse_integer<uint64_t>(core::trim(rest));
    if (word != "ok" || !bytes) throw InputError("what answers there is no training of ewa");
    if (*bytes > kMostPayload)
        throw InputError("an answer of " + std::to_string(*bytes) + " bytes is too large");
    return *bytes;
}

}  // namespace ewa::live
