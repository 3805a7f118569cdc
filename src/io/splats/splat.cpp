// SPDX-License-Identifier: Apache-2.0
// The format of antimatter15's viewer: 32 bytes per splat, without a header:
//   byte 0    float32 x y z
//   byte 12   float32 scales, linear
//   byte 24   uint8 r g b, opacity
//   byte 28   uint8 quaternion w x y z, each component q as 128 q + 128
// rgb is the colour of SH coefficient 0, so there is no view dependence.
#include "core/atomic_file.h"
#include "core/file_reader.h"
#include "io/splats/formats.h"
#include "io/splats/splat_values.h"

namespace ewa::io {

namespace {

constexpr size_t kSplatBytes = 32;

void decode(const std::byte* bytes, size_t i, Gaussians& gaussians) {
    float place[3], scale[3];
    uint8_t color[4], rotation[4];
    std::memcpy(place, bytes, 12);
    std::memcpy(scale, bytes + 12, 12);
    std::memcpy(color, bytes + 24, 4);
    std::memcpy(rotation, bytes + 28, 4);
    for (size_t k = 0; k < 3; ++k) {
        gaussians.means[3 * i + k] = place[k];
        gaussians.log_scales[3 * i + k] = log_of_scale(scale[k]);
        gaussians.sh[3 * i + k] = float(sh0_of_color(color[k] / 255.0));
    }
    gaussians.opacity_logits[i] = float(logit_of_level(color[3], 255));
    float q[4];
    for (size_t k = 0; k < 4; ++k) q[k] = (float(rotation[k]) - 128) / 128;
    const std::array<double, 4> unit = unit_quaternion(q);
    for (size_t k = 0; k < 4; ++k) gaussians.quaternions[4 * i + k] = float(unit[k]);
}

void encode(const Gaussians& gaussians, size_t i, std::byte* bytes) {
    float scale[3];
    uint8_t color[4], rotation[4];
    const float* sh = &gaussians.sh[gaussians.sh_stride() * i];
    for (size_t k = 0; k < 3; ++k) {
        scale[k] = scale_of_log(gaussians.log_scales[3 * i + k]);
        color[k] = to_byte(color_of_sh0(sh[k]) * 255);
    }
    color[3] = to_byte(sigmoid(gaussians.opacity_logits[i]) * 255);
    const std::array<double, 4> q = unit_quaternion(&gaussians.quaternions[4 * i]);
    // Both signs of a quaternion are the same rotation. A byte cannot hold +1, so the largest component is
    // negated.
    const double sign = q[largest_component(q)] > 127.5 / 128 ? -1 : 1;
    for (size_t k = 0; k < 4; ++k) rotation[k] = to_byte(sign * q[k] * 128 + 128);
    std::memcpy(bytes, &gaussians.means[3 * i], 12);
    std::memcpy(bytes + 12, scale, 12);
    std::memcpy(bytes + 24, color, 4);
    std::memcpy(bytes + 28, rotation, 4);
}

}  // namespace

SplatScene read_splat(const std::filesystem::path& path) {
    core::FileReader reader(path);
    if (reader.size() % kSplatBytes != 0) {
        reader.skip(reader.size() / kSplatBytes * kSplatBytes, "the splats");
        reader.fail("the file ends inside splat " + std::to_string(reader.size() / kSplatBytes) +
                    ": it has " + std::to_string(reader.size()) +
                    " bytes, not a multiple of 32; it is truncated or not a .splat file");
    }
    SplatScene scene;
    scene.format = SplatFormat::splat;
    const size_t count = size_t(reader.size() / kSplatBytes);
    scene.gaussians.resize(count);
    for (size_t i = 0; i < count; ++i) decode(reader.take(kSplatBytes, "a splat"), i, scene.gaussians);
    return scene;
}

std::vector<std::string> write_splat(const std::filesystem::path& path, const Gaussians& gaussians,
                                     const SaveOptions& options) {
    core::AtomicFile file(path);
    encode_in_pieces(
        gaussians.size(), kSplatBytes, [&](size_t i, std::byte* to) { encode(gaussians, i, to); },
        [&](const std::byte* bytes, size_t size, size_t end) {
            file.write(bytes, size);
            if (options.progress) options.progress(end, gaussians.size());
        });
    file.commit();
    std::vector<std::string> remarks;
    if (gaussians.sh_degree > 0)
        remarks.push_back("SH degrees 1 to " + std::to_string(gaussians.sh_degree) +
                          " are dropped: the format has no view-dependent colour");
    remarks.push_back(
        "colours and opacities have 8 bits, clamped to 0..1; rotations have 8 bits per component");
    return remarks;
}

}  // namespace ewa::io
