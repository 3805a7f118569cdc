// SPDX-License-Identifier: Apache-2.0
#include "pipeline/appearances.h"

#include <algorithm>
#include <utility>

#include "shared/constants.h"

namespace ewa::pipeline {
namespace {

std::vector<float> repeated(const std::vector<float>& row, size_t times) {
    std::vector<float> all;
    all.reserve(row.size() * times);
    for (size_t k = 0; k < times; ++k) all.insert(all.end(), row.begin(), row.end());
    return all;
}

/// The values that change no colour.
std::vector<float> neutral(AppearanceModel model, size_t photos, uint32_t cameras) {
    if (model == AppearanceModel::affine)
        return repeated({kIdentityExposure.begin(), kIdentityExposure.end()}, photos);
    if (model == AppearanceModel::grid) return repeated(ColorGrid::identity_cells(), photos);
    std::vector<float> start(shared::PPISP_PHOTO_FLOATS * photos);
    for (uint32_t k = 0; k < cameras; ++k) {
        const auto camera = Ppisp::neutral_camera();
        start.insert(start.end(), camera.begin(), camera.end());
        start.resize(start.size() + shared::PPISP_CAMERA_FLOATS - shared::PPISP_CAMERA_VALUES);
    }
    start.resize(start.size() + shared::PPISP_PHOTO_FLOATS);  // the means
    return start;
}

LearnedTable::Layout layout_of(AppearanceModel model, uint32_t views) {
    const bool affine = model == AppearanceModel::affine;
    return {.name = affine ? "exposures" : "appearances",
            .moments = affine ? "exp_moments" : "app_moments",
            .row_floats = row_floats(model),
            .slot_floats = model == AppearanceModel::ppisp ? shared::PPISP_CAMERA_FLOATS : 0,
            .views = views};
}

}  // namespace

Appearances::Appearances(gpu::Device& device, AppearanceModel of, std::vector<uint32_t> cameras_of_photos,
                         uint32_t views)
    : model(of), camera_of(std::move(cameras_of_photos)) {
    cameras = 1 + *std::max_element(camera_of.begin(), camera_of.end());
    static_cast<LearnedTable&>(*this) =
        LearnedTable(device, layout_of(model, views), neutral(model, camera_of.size(), cameras));
}

uint32_t Appearances::camera_at(uint32_t camera) const {
    return uint32_t(shared::PPISP_PHOTO_FLOATS * camera_of.size() + shared::PPISP_CAMERA_FLOATS * camera);
}

std::vector<Appearance> Appearances::download() const {
    const std::vector<float> all = LearnedTable::download();
    std::vector<Appearance> appearances;
    for (size_t p = 0; p < camera_of.size(); ++p) {
        const auto row = std::span(all).subspan(layout.row_floats * p, layout.row_floats);
        if (model == AppearanceModel::grid) {
            appearances.push_back(ColorGrid{{row.begin(), row.end()}});
        } else if (model == AppearanceModel::affine) {
            Exposure exposure;
            std::copy(row.begin(), row.end(), exposure.begin());
            appearances.push_back(exposure);
        } else {
            Ppisp ppisp;
            std::copy_n(row.begin(), ppisp.photo.size(), ppisp.photo.begin());
            std::copy_n(&all[camera_at(camera_of[p])], ppisp.camera.size(), ppisp.camera.begin());
            appearances.push_back(ppisp);
        }
    }
    return appearances;
}

void Appearances::set_exposures(std::span<const float> stops) {
    std::vector<float> all = LearnedTable::download();
    double sum = 0;
    for (size_t p = 0; p < stops.size(); ++p) {
        all[shared::PPISP_PHOTO_FLOATS * p] = stops[p];
        sum += double(stops[p]);
    }
    all[camera_at(cameras)] = float(sum / double(stops.size()));
    values.upload(std::span<const float>(all));
}

uint32_t row_floats(AppearanceModel model) {
    switch (model) {
        case AppearanceModel::affine:
            return shared::GRID_CELL_FLOATS;
        case AppearanceModel::grid:
            return shared::GRID_FLOATS;
        case AppearanceModel::ppisp:
            return shared::PPISP_PHOTO_FLOATS;
        default:
            return 0;
    }
}

uint32_t grid_parts(AppearanceModel model, uint32_t width, uint32_t height) {
    if (model != AppearanceModel::affine && model != AppearanceModel::grid) return 0;
    const auto reach = [&](uint32_t size, uint32_t cells) {
        return model == AppearanceModel::affine ? uint64_t(size) : uint64_t(2 * size / (cells - 1) + 4);
    };
    const uint64_t rows = reach(height, shared::GRID_HEIGHT);
    const uint64_t pixels = reach(width, shared::GRID_WIDTH) * rows;
    return uint32_t(std::clamp<uint64_t>(pixels / shared::GRID_PART_PIXELS, 1, rows));
}

}  // namespace ewa::pipeline
