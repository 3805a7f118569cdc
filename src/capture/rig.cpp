// SPDX-License-Identifier: Apache-2.0
// From the cameras of views to those of the 360° photos that they were cut out of, and back.
#include <algorithm>
#include <cmath>
#include <limits>
#include <locale>
#include <nlohmann/json.hpp>
#include <sstream>

#include "capture/panoramas.h"
#include "core/atomic_file.h"
#include "core/folders.h"
#include "core/json.h"
#include "ewa/image.h"
#include "io/datasets/image_records.h"
#include "scene/native_lens.h"

namespace ewa::capture {
namespace {

namespace fs = std::filesystem;

constexpr double kMostTurned = 0.035;  // radians between two views that agree: 2 degrees
constexpr double kMostMoved = 0.5;     // of the distance to the next photo

double angle(const Pose& a, const Pose& b) {
    return 2 * std::acos(std::min(1.0, std::abs(glm::dot(a.rotation, b.rotation))));
}

double median(std::vector<double> values) {
    const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

using Views = std::map<std::string, std::vector<Pose>>;  // poses of a photo, by each of its views

/// The median distance of a view from the nearest one of another photo.
double distance_of_neighbours(const Views& views) {
    std::vector<double> nearest;
    for (const auto& [photo, poses] : views)
        for (const Pose& pose : poses) {
            double least = std::numeric_limits<double>::infinity();
            for (const auto& [other, others] : views)
                if (other != photo)
                    for (const Pose& there : others)
                        least = std::min(least, glm::distance(pose.center, there.center));
            nearest.push_back(least);
        }
    return nearest.empty() ? 0 : median(std::move(nearest));
}

nlohmann::ordered_json rig_camera(int id, int k) {
    const glm::dquat q = glm::quat_cast(view_rotation(k));
    const nlohmann::ordered_json turn{q.w, q.x, q.y, q.z}, none{0, 0, 0};
    // Names of COLMAP 3.8, and of newer releases.
    return {{"camera_id", id},
            {"image_prefix", view_name(k, "").parent_path().string() + "/"},
            {"rel_qvec", turn},
            {"rel_tvec", none},
            {"cam_from_rig_rotation", turn},
            {"cam_from_rig_translation", none}};
}

}  // namespace

int agreed(const std::vector<Pose>& poses, double scale, Pose& pose) {
    const auto agree = [&](const Pose& a, const Pose& b) {
        return angle(a, b) <= kMostTurned && glm::distance(a.center, b.center) <= kMostMoved * scale;
    };
    std::vector<Pose> best;
    for (const Pose& candidate : poses) {
        std::vector<Pose> group;
        std::ranges::copy_if(poses, std::back_inserter(group),
                             [&](const Pose& other) { return agree(candidate, other); });
        if (group.size() > best.size()) best = std::move(group);
    }
    if (best.empty()) return 0;
    glm::dquat sum(0, 0, 0, 0);
    for (const Pose& each : best)
        sum += glm::dot(each.rotation, best[0].rotation) < 0 ? -each.rotation : each.rotation;
    pose.rotation = glm::normalize(sum);
    for (int axis = 0; axis < 3; ++axis) {
        std::vector<double> values;
        for (const Pose& each : best) values.push_back(each.center[axis]);
        pose.center[axis] = median(std::move(values));
    }
    return int(best.size());
}

RigPoses rig_poses(const fs::path& model) {
    Views views;
    for (const io::ImageRecord& view : io::read_colmap(io::colmap_model_in(model)).images) {
        const auto [k, photo] = photo_of_view(view.name);
        if (!photo.empty())
            views[photo].push_back({glm::quat_cast(glm::transpose(view_rotation(k)) * view.camera.rotation),
                                    view.camera.position()});
    }
    const double scale = distance_of_neighbours(views);
    RigPoses result;
    for (const auto& [photo, poses] : views) {
        Pose pose;
        int count = agreed(poses, scale, pose);
        if (count == 1 && poses.size() > 1) count = 0;  // nobody knows which one is right
        if (count > 0) result.photos[photo] = pose;
        result.views += int(poses.size());
        result.dropped += int(poses.size()) - count;
    }
    return result;
}

void write_rig(const std::map<std::string, Pose>& poses, const PanoramaViews& views, const fs::path& model,
               const fs::path& rig) {
    std::ostringstream cameras, images;
    for (std::ostringstream* each : {&cameras, &images}) {
        each->imbue(std::locale::classic());
        each->precision(17);
    }
    nlohmann::ordered_json rigs = nlohmann::ordered_json::array();
    int camera = 0, image = 0;
    for (const auto& [width_and_k, names] : views.cameras) {
        const auto& [width, k] = width_and_k;
        const double half = 0.5 * width;
        cameras << ++camera << " PINHOLE " << width << ' ' << width << ' ' << half << ' ' << half << ' '
                << half << ' ' << half << '\n';
        if (k == 0) rigs.push_back({{"ref_camera_id", camera}, {"cameras", nlohmann::ordered_json::array()}});
        rigs.back()["cameras"].push_back(rig_camera(camera, k));
        for (const fs::path& name : names) {
            const auto pose = poses.find(photo_of_view(name.string()).second);
            if (pose == poses.end()) continue;
            const glm::dmat3 rotation = view_rotation(k) * glm::mat3_cast(pose->second.rotation);
            const glm::dquat q = glm::quat_cast(rotation);
            const glm::dvec3 t = -(rotation * pose->second.center);
            images << ++image;
            for (const double value : {q.w, q.x, q.y, q.z, t.x, t.y, t.z}) images << ' ' << value;
            images << ' ' << camera << ' ' << name.string() << "\n\n";  // no observations
        }
    }
    core::make_folder(model);
    core::write_text_file(model / "cameras.txt", cameras.str());
    core::write_text_file(model / "images.txt", images.str());
    core::write_text_file(model / "points3D.txt", "");
    core::write_json(rig, rigs);
}

void join_views(const std::map<std::string, Pose>& poses, const fs::path& views_model, const Photos& photos,
                const fs::path& model) {
    std::vector<io::ImageRecord> images;
    for (const fs::path& name : photos.names) {
        const auto pose = poses.find(name.string());
        if (pose == poses.end()) continue;
        const ImageSize size = read_image_size(photos.folder / name);
        io::ImageRecord image;
        image.name = name.string();
        image.camera = {.width = size.width, .height = size.height};
        image.camera.distortion.lens = Lens::equirectangular;
        scene::set_equirectangular(image.camera);
        std::swap(image.distortion, image.camera.distortion);
        image.camera.rotation = glm::mat3_cast(pose->second.rotation);
        image.camera.translation = -(image.camera.rotation * pose->second.center);
        images.push_back(image);
    }
    io::write_colmap(model, images, io::read_colmap(io::colmap_model_in(views_model)).points);
}

}  // namespace ewa::capture
