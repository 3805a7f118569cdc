// SPDX-License-Identifier: Apache-2.0
#include "pipeline/appearances.h"

#include <algorithm>
#include <cstring>
#include <set>
#include <utility>

#include "pipeline/model.h"
#include "shared/constants.h"

namespace ewa::pipeline {
Appearances::Appearances(gpu::Device& device, AppearanceModel of, std::vector<uint32_t> cameras_of_photos,
                         uint32_t views)
    : model(of), camera_of(std::move(cameras_of_photos)) {
    cameras = 1 + *std::max_element(camera_of.begin(), camera_of.end());
    std::vector<float> start;
    if (model == AppearanceModel::grid) {
        const std::vector<float> identity = ColorGrid::identity_cells();
        for (size_t k = 0; k < camera_of.size(); ++k)
            start.insert(start.end(), identity.begin(), identity.end());
    } else {
        start.resize(shared::PPISP_PHOTO_FLOATS * camera_of.size());
        for (uint32_t k = 0; k < cameras; ++k) {
            const auto neutral = Ppisp::neutral_camera();
            start.insert(start.end(), neutral.begin(), neutral.end());
            start.resize(start.size() + shared::PPISP_CAMERA_FLOATS - shared::PPISP_CAMERA_VALUES);
        }
        start.resize(start.size() + shared::PPISP_PHOTO_FLOATS);  // the means
        slots = gpu::Buffer(device, "appearance slots", 4ull * shared::PPISP_CAMERA_FLOATS * views);
    }
    values = gpu::Buffer(device, "appearances", 4 * start.size());
    values.upload(std::span<const float>(start));
    moments1 = gpu::Buffer(device, "appearance moments1", 4 * start.size());
    moments2 = gpu::Buffer(device, "appearance moments2", 4 * start.size());
    zero(moments1);
    zero(moments2);
}

uint32_t Appearances::photo_floats() const {
    return model == AppearanceModel::grid ? shared::GRID_FLOATS : shared::PPISP_PHOTO_FLOATS;
}

uint32_t Appearances::camera_at(uint32_t camera) const {
    return uint32_t(shared::PPISP_PHOTO_FLOATS * camera_of.size() + shared::PPISP_CAMERA_FLOATS * camera);
}

uint64_t Appearances::bytes() const {
    if (model == AppearanceModel::grid) return 4ull * shared::GRID_FLOATS * camera_of.size();
    return 4ull * (camera_at(cameras) + shared::PPISP_PHOTO_FLOATS);
}

std::vector<Appearance> Appearances::download() const {
    const std::vector<float> all = values.download<float>(bytes() / 4);
    std::vector<Appearance> appearances;
    for (size_t p = 0; p < camera_of.size(); ++p) {
        const float* photo = &all[photo_floats() * p];
        if (model == AppearanceModel::grid) {
            appearances.push_back(ColorGrid{{photo, photo + shared::GRID_FLOATS}});
            continue;
        }
        Ppisp ppisp;
        std::copy_n(photo, ppisp.photo.size(), ppisp.photo.begin());
        std::copy_n(&all[camera_at(camera_of[p])], ppisp.camera.size(), ppisp.camera.begin());
        appearances.push_back(ppisp);
    }
    return appearances;
}

void Appearances::set_exposures(std::span<const float> stops) {
    std::vector<float> all = values.download<float>(bytes() / 4);
    double sum = 0;
    for (size_t p = 0; p < stops.size(); ++p) {
        all[shared::PPISP_PHOTO_FLOATS * p] = stops[p];
        sum += double(stops[p]);
    }
    all[camera_at(cameras)] = float(sum / double(stops.size()));
    values.upload(std::span<const float>(all));
}

size_t Appearances::words_of_view() const {
    return (3ull * photo_floats() + (slots ? shared::PPISP_CAMERA_FLOATS : 0)) / 2;
}

std::vector<uint64_t> Appearances::words(uint32_t photo, uint32_t slot) const {
    std::vector<uint64_t> words(words_of_view());
    const auto bytes = std::as_writable_bytes(std::span(words));
    const size_t own = 4ull * photo_floats();
    size_t at = 0;
    for (const gpu::Buffer* buffer : {&values, &moments1, &moments2}) {
        buffer->download(bytes.subspan(at, own), own * photo);
        at += own;
    }
    if (slots) slots.download(bytes.subspan(at), 4ull * shared::PPISP_CAMERA_FLOATS * slot);
    return words;
}

void Appearances::set(uint32_t photo, uint32_t slot, std::span<const uint64_t> words) {
    const auto bytes = std::as_bytes(words);
    const size_t own = 4ull * photo_floats();
    size_t at = 0;
    for (gpu::Buffer* buffer : {&values, &moments1, &moments2}) {
        buffer->upload(bytes.subspan(at, own), own * photo);
        at += own;
    }
    if (slots) slots.upload(bytes.subspan(at), 4ull * shared::PPISP_CAMERA_FLOATS * slot);
}

uint32_t grid_parts(uint32_t width, uint32_t height) {
    const auto reach = [](uint32_t size, uint32_t cells) { return uint64_t(2 * size / (cells - 1) + 4); };
    const uint64_t rows = reach(height, shared::GRID_HEIGHT);
    const uint64_t pixels = reach(width, shared::GRID_WIDTH) * rows;
    return uint32_t(std::clamp<uint64_t>(pixels / shared::GRID_PART_PIXELS, 1, rows));
}

}  // namespace ewa::pipeline
