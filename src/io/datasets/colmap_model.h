// SPDX-License-Identifier: Apache-2.0
// What the binary and the text reader of COLMAP models have in common: the checks.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "io/datasets/posed_images.h"

namespace ewa::io {

/// Throws InputError that says where in the file.
using Fail = std::function<void(const std::string&)>;

/// A camera in the file: f or fx fy, then cx cy, then the terms.
struct ColmapLens {
    std::string_view name;
    size_t focal_lengths = 1;
    Lens lens = Lens::brown;
    std::array<double Distortion::*, 12> terms{};  // null after the last
    size_t parameters() const;                     // in all
};

/// By COLMAP's number, or null.
const ColmapLens* colmap_lens(int64_t id);
/// By COLMAP's name, or null.
const ColmapLens* colmap_lens(std::string_view name);

/// Collects a model. Ids are checked as they come; what is wrong goes to the Fail of the file being read.
class ColmapBuilder {
  public:
    explicit ColmapBuilder(std::filesystem::path images) : images_(std::move(images)) {
        result_.folder = images_;
    }

    void add_camera(uint32_t id, const ColmapLens& lens, uint64_t width, uint64_t height,
                    const std::vector<double>& parameters, const Fail& fail);
    /// pose: qw qx qy qz tx ty tz, world to camera.
    void add_image(const std::array<double, 7>& pose, uint32_t camera_id, const std::string& name,
                   const Fail& fail);
    /// where: asked for the first point that is dropped.
    void add_point(const glm::dvec3& position, const std::array<uint8_t, 3>& color,
                   const std::function<std::string()>& where);
    PosedImages take() { return std::move(result_); }

  private:
    struct Taken {
        Camera camera;
        Distortion distortion;
    };
    std::filesystem::path images_;
    std::map<uint32_t, Taken> cameras_;
    PosedImages result_;
};

void read_colmap_binary(const std::filesystem::path& model, ColmapBuilder& builder);
void read_colmap_text(const std::filesystem::path& model, ColmapBuilder& builder);

}  // namespace ewa::io
