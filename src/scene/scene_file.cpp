// SPDX-License-Identifier: Apache-2.0
#include "scene/scene_file.h"

#include <cstring>
#include <vector>

#include "core/atomic_file.h"
#include "core/file_reader.h"
#include "core/text.h"
#include "ewa/error.h"

namespace ewa::scene {
namespace {

/// The beginning of the file. The arrays of Gaussians follow, in the order of its members.
struct SceneHeader {
    char magic[8] = {'e', 'w', 'a', 's', 'c', 'n', '1', 0};
    uint64_t splats = 0;
    int32_t sh_degree = 0, density = 0, width = 0, height = 0;
    double fx = 0, fy = 0, cx = 0, cy = 0;
    glm::dmat3 rotation{1.0};
    glm::dvec3 translation{0.0}, origin{0.0};
};

/// visit(array) for each array of the splats, in the order of the file.
template <class Splats, class Visit>
void for_each_array(Splats& gaussians, Visit visit) {
    visit(gaussians.means);
    visit(gaussians.quaternions);
    visit(gaussians.log_scales);
    visit(gaussians.opacity_logits);
    visit(gaussians.sh);
}

}  // namespace

void write_scene_file(const std::filesystem::path& path, const SceneFile& scene) {
    const Gaussians& splats = scene.gaussians;
    const Camera& camera = scene.camera;
    SceneHeader header;
    header.splats = splats.size();
    header.sh_degree = splats.sh_degree;
    header.density = splats.density;
    header.width = camera.width;
    header.height = camera.height;
    header.fx = camera.fx;
    header.fy = camera.fy;
    header.cx = camera.cx;
    header.cy = camera.cy;
    header.rotation = camera.rotation;
    header.translation = camera.translation;
    header.origin = splats.origin;
    core::AtomicFile file(path);
    file.write(&header, sizeof(header));
    for_each_array(splats, [&](const std::vector<float>& values) {
        file.write(values.data(), values.size() * sizeof(float));
    });
    file.commit();
}

SceneFile read_scene_file(const std::filesystem::path& path) {
    core::FileReader file(path);
    SceneHeader header;
    const SceneHeader usual;
    if (file.size() >= sizeof(header))
        std::memcpy(&header, file.take(sizeof(header), "header"), sizeof(header));
    if (file.size() < sizeof(header) || std::memcmp(header.magic, usual.magic, sizeof(usual.magic)) != 0)
        throw InputError(core::one_line(path.string()) +
                         ": is no scene of ewa bench, which reads the splat formats");
    if (header.sh_degree < 0 || header.sh_degree > kMaxShDegree) file.fail("the SH degree is not 0 to 3");
    SceneFile scene;
    Gaussians& splats = scene.gaussians;
    splats.sh_degree = header.sh_degree;
    splats.density = header.density != 0;
    splats.origin = header.origin;
    file.require_room(header.splats, sizeof(float) * (11 + splats.sh_stride()), "splats");
    splats.resize(header.splats);
    for_each_array(splats, [&](std::vector<float>& values) {
        const size_t bytes = values.size() * sizeof(float);
        if (bytes > 0) std::memcpy(values.data(), file.take(bytes, "splats"), bytes);
    });
    if (file.remaining() > 0) file.fail("the file continues after its splats");
    scene.camera = {header.width, header.height, header.fx,       header.fy,
                    header.cx,    header.cy,     header.rotation, header.translation};
    return scene;
}

}  // namespace ewa::scene
