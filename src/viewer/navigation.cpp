// SPDX-License-Identifier: Apache-2.0
#include "viewer/navigation.h"

#include <algorithm>
#include <cstdio>
#include <string>

#include "scene/camera.h"

namespace ewa::viewer {

Film::Film(const std::vector<io::NamedView>& views, const std::filesystem::path& into, Size frame_size,
           double seconds)
    : folder(into), size(frame_size) {
    for (const io::NamedView& view : views) keys.push_back(view.camera);
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

void Navigation::reset() {
    view.reset();
    at_camera = start_frame;
}

void Navigation::go_to(const Camera& camera, const glm::dvec3& pivot) {
    view.stand({camera, pivot, view.up(), view.radius()});
    leave_camera();
}

std::vector<io::NamedView>::iterator Navigation::find(size_t number) {
    return std::find_if(
        views.begin(), views.end(),
        [name = std::to_string(number)](const io::NamedView& saved) { return saved.name == name; });
}

}  // namespace ewa::viewer
