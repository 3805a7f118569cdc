// SPDX-License-Identifier: Apache-2.0
// What differs from frame to frame of one plan: the camera, and the training image that the loss reads.
#pragma once
#include <array>
#include <cstdint>
#include <variant>
#include <vector>

#include "ewa/camera.h"
#include "ewa/gaussians.h"
#include "ewa/image.h"
#include "ewa/render_options.h"
#include "gpu/buffer.h"
#include "passes/kernel_config.h"

namespace ewa::pipeline {

struct CameraUse {
    const gpu::Buffer* buffer = nullptr;  // CameraBlocks
    uint64_t offset = 0;                  // bytes, aligned as the device requires for uniform blocks
    uint32_t width = 0, height = 0;       // px
    uint32_t lenses = 0;                  // LENSES_* of layouts.h
    bool wraps = false;                   // an image of all directions: its left and right border coincide
};

/// The camera in this block of a buffer.
CameraUse use_of(const gpu::Buffer& blocks, uint64_t offset, const Camera& camera);

/// The texels of a SkyMap.
struct SkyUse {
    const gpu::Buffer* texels = nullptr;  // null: no sky
    uint32_t size = 0;                    // texels a side
};

/// Rows of a view that a render shows. The loss counts only the band's own rows. The others are a halo for SSIM's windows, which
/// reach beyond the own rows.
struct Band {
    uint32_t first = 0;                   // row of the view that is the render's first
    uint32_t rows = 0;                    // of the render; 0: it shows the whole view
    uint32_t own_begin = 0, own_end = 0;  // the band's own rows, as rows of the render
};

struct FrameInputs {
    CameraUse camera;
    std::array<float, 3> background{0, 0, 0};  // black with a sky
    SkyUse sky{};
    bool keep_overflow = false;    // this frame does nothing if an earlier frame in flight overflows
    bool prepared = false;         // FramePasses::prepare has recorded the beginning of the frame
    int sh_degree = kMaxShDegree;  // degree to evaluate, at most the plan's stored degree
    uint32_t samples = 1;          // of a ray, with Integrator::march
    Band band{};
    const gpu::Buffer* marks = nullptr;  // of the model's splats, if the plan reads them: a byte each
};

/// Band `band` of a view that is cut into `bands` bands of whole tile rows, with its halo. A view needs a tile row for each.
Band band_of(const passes::KernelConfig& config, uint32_t height, uint32_t bands, uint32_t band);

/// A camera as the shaders read it: each float64 value in two floats. origin: of the scene's means, world
/// units. Throws InputError if a value is not finite, a size or focal length is not positive, or scene::is_native is false of the
/// lens.
shared::CameraBlock camera_block(const Camera& camera, const passes::KernelConfig& config,
                                 const glm::dvec3& origin = glm::dvec3(0));

/// The lens of a view of the operators, and its bounds of tangents. The lens must be native.
void set_lens(const Camera& camera, shared::ViewBlock& block);

/// A buffer with the camera_block of one camera.
gpu::Buffer upload_camera(gpu::Device& device, const Camera& camera, const passes::KernelConfig& config,
                          const glm::dvec3& origin = glm::dvec3(0));

/// The inputs of a frame whose camera was uploaded to `block`. They lack the sky.
FrameInputs inputs_of(const gpu::Buffer& block, const Camera& camera, const RenderOptions& options);

/// A training image as the loss reads it: width * height RGBA texels, 8-bit if every value is one of 256
/// levels, or with round_to_8_bit; else float32. An image of 3 channels is opaque. FramePasses::loss says what
/// alpha means.
using PhotoTexels = std::variant<std::vector<uint8_t>, std::vector<float>>;
PhotoTexels photo_texels(const Image& image, bool round_to_8_bit = false);
gpu::Buffer upload_photo(gpu::Device& device, const PhotoTexels& texels);
gpu::Buffer upload_photo(gpu::Device& device, const Image& image, bool round_to_8_bit = false);

/// Whether a pixel of the image has an alpha below 1.
bool transparent(const Image& image);

/// Upper bound of the bytes that upload_photo allocates.
uint64_t photo_bytes(int width, int height, bool round_to_8_bit);

}  // namespace ewa::pipeline
