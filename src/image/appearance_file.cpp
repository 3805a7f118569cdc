// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <utility>
#include <variant>
#include <vector>

#include "core/json.h"
#include "core/json_field.h"
#include "core/typing.h"
#include "ewa/appearance.h"
#include "ewa/error.h"

namespace ewa {
namespace {

/// The numbers that `into` has. key: of their list; null: the field itself.
template <class Numbers>
void read_numbers(const core::JsonField& field, const char* key, Numbers& into, const char* form = nullptr) {
    std::ranges::copy(field.floats(key, into.size(), form), into.begin());
}

Appearance ppisp_of(const core::JsonField& image, const std::vector<core::JsonField>& cameras) {
    Ppisp ppisp;
    const uint64_t camera = image.whole("camera", UINT32_MAX);
    if (camera >= cameras.size()) image.fail("\"camera\" is not a number of one of the cameras");
    read_numbers(image, "photo", ppisp.photo);
    read_numbers(cameras[camera], nullptr, ppisp.camera);
    return ppisp;
}

enum : size_t { kAffine, kPpisp, kGrid };  // as in Appearance
constexpr std::array<const char*, 3> kModels{"affine", "ppisp", "grid"};

}  // namespace

std::map<std::string, Appearance> load_appearances(const std::filesystem::path& path) {
    const auto top = core::JsonField::of_file(path);
    if (!top.value().is_object()) top.fail("the JSON is not an object of appearances");
    const std::string word = core::text_in(top.value(), "model");
    const bool older = word.empty();  // an exposures.json, with the rows of each image
    const auto model = older ? size_t(kAffine) : size_t(std::ranges::find(kModels, word) - kModels.begin());
    if (model == kModels.size()) top.fail("\"model\" is none of \"affine\", \"ppisp\" and \"grid\"");
    const core::JsonField images = older ? top : top.object("images");
    const auto cameras = model == kPpisp ? top.items("cameras") : std::vector<core::JsonField>();
    std::map<std::string, Appearance> appearances;
    for (const auto& [name, value] : images.value().items()) {
        Exposure exposure;
        ColorGrid grid;
        if (model == kAffine)
            read_numbers(images, name.c_str(), exposure,
                         older ? "three rows of four finite numbers" : nullptr);
        else if (model == kGrid)
            read_numbers(images, name.c_str(), grid.cells);
        appearances[name] = model == kAffine ? Appearance(exposure)
                            : model == kGrid ? Appearance(grid)
                                             : ppisp_of(images.part(name.c_str()), cameras);
    }
    return appearances;
}

void save_appearances(const std::filesystem::path& path, const std::vector<std::string>& names,
                      const std::vector<Appearance>& appearances) {
    check(appearances);
    if (names.size() != appearances.size())
        throw InputError(core::counted(names.size(), "name") + " for " +
                         core::counted(appearances.size(), "appearance"));
    nlohmann::ordered_json all;
    all["model"] = kModels[appearances.empty() ? size_t(kPpisp) : appearances.front().index()];
    std::vector<std::array<float, 27>> cameras;
    auto images = nlohmann::ordered_json::object();
    for (size_t i = 0; i < appearances.size(); ++i) {
        auto& image = images[names[i]];
        if (const auto* exposure = std::get_if<Exposure>(&appearances[i])) image = *exposure;
        if (const auto* grid = std::get_if<ColorGrid>(&appearances[i])) image = grid->cells;
        const auto* ppisp = std::get_if<Ppisp>(&appearances[i]);
        if (!ppisp) continue;
        const auto camera = std::ranges::find(cameras, ppisp->camera);
        image = {{"camera", camera - cameras.begin()}, {"photo", ppisp->photo}};
        if (camera == cameras.end()) cameras.push_back(ppisp->camera);
    }
    if (all["model"] == "ppisp") all["cameras"] = cameras;
    all["images"] = std::move(images);
    core::write_json(path, all);
}

}  // namespace ewa
