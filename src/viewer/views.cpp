// SPDX-License-Identifier: Apache-2.0
#include "viewer/views.h"

#include <algorithm>
#include <cstdio>

#include "scene/camera.h"

namespace ewa::viewer {

const io::NamedView* SavedViews::find(size_t number) const {
    const auto found = std::find_if(views_.begin(), views_.end(), [&](const io::NamedView& view) {
        return view.name == std::to_string(number);
    });
    return found == views_.end() ? nullptr : &*found;
}

void SavedViews::save(size_t number, const Camera& camera, const glm::dvec3& pivot) {
    const io::NamedView view{std::to_string(number), camera, pivot};
    if (const io::NamedView* same = find(number))
        views_[size_t(same - views_.data())] = view;
    else
        views_.push_back(view);
}

void SavedViews::erase(size_t index) {
    if (index < views_.size()) views_.erase(views_.begin() + std::ptrdiff_t(index));
}

size_t SavedViews::free_number() const {
    size_t number = 1;
    while (find(number)) ++number;
    return number;
}

Film::Film(const SavedViews& views, const std::filesystem::path& into, Size frame_size, double seconds)
    : folder(into), size(frame_size) {
    for (const io::NamedView& view : views.all()) keys.push_back(view.camera);
    frames = int((double(keys.size()) - 1) * kRate * seconds + 0.5) + 1;
}

Camera Film::camera() const {
    return along_path(keys, frames > 1 ? double(next) * double(keys.size() - 1) / (frames - 1) : 0);
}

std::filesystem::path Film::file() const {
    char name[32];
    std::snprintf(name, sizeof(name), "%05d.png", next);
    return folder / name;
}

}  // namespace ewa::viewer
