// SPDX-License-Identifier: Apache-2.0
// The steps of splatting as operators with gradients, for programs that compute their own loss. Arrays are in host
// memory, in row-major order. Scales and opacities are linear: exp and sigmoid have been taken.
// The conventions are those of gsplat 1.6: OpenCV cameras (x right, y down, z forward), pixel centres at +0.5,
// quaternions w x y z of any norm.
//
// The trainer does not use these: its kernels fuse the steps.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "ewa/camera.h"
#include "ewa/device.h"

namespace ewa {

namespace operators {
struct Context;
struct BlendFrame;
}  // namespace operators

/// N splats in world coordinates.
struct SplatArrays {
    std::span<const float> means;        // [N, 3], world units
    std::span<const float> quaternions;  // [N, 4], w x y z; empty if there are covariances
    std::span<const float> scales;       // [N, 3], world units; empty if there are covariances
    std::span<const float> covariances;  // [N, 6], xx xy xz yy yz zz; else empty
    std::span<const float> opacities;    // [N]; if given, the radii end where alpha falls below 1/255
    size_t size() const { return means.size() / 3; }
};

/// C views.
struct ViewArrays {
    std::span<const float> view_matrices;  // [C, 4, 4], world to camera; the last row is not read
    std::span<const float> intrinsics;     // [C, 3, 3]: fx 0 cx, 0 fy cy, 0 0 1 (px)
    // [C]: brown, a fisheye of k1 to k4, or orthographic; empty: pinholes. Depths are view z for every lens.
    std::span<const Distortion> lenses{};
    size_t size() const { return view_matrices.size() / 16; }
};

/// Options of Operators::project and project_backward.
struct ProjectionOptions {
    uint32_t width = 0, height = 0;   // px
    float low_pass = 0.3f;            // added to both diagonal entries of the 2D covariance (px^2)
    float near = 0.01f, far = 1e10f;  // a splat is visible where near < z < far (world units)
    float radius_clip = 0;            // a splat with both radii at or below it is not visible (px)
    bool compensations =
        false;  // sqrt(det of the 2D covariance without low_pass / with it), Mip-Splatting's factor
    // Whiteners in place of conics. A whitener stays accurate in float32 where a conic does not: a needle 1,000 px long and 1 px
    // wide has a conic whose determinant is a millionth of its products.
    bool whiteners = false;
};

/// C views of N splats. Invisible splats have radii 0, and 0 in all other arrays.
struct ProjectedSplats {
    std::vector<int32_t> radii;  // [C, N, 2], px
    std::vector<float> means2d;  // [C, N, 2], px
    std::vector<float> depths;   // [C, N], view z
    // [C, N, 3], the inverse 2D covariance: conics xx xy yy, or whiteners ux k vy. With d = pixel - mean,
    // d^T conic d / 2 = u^2 + v^2, u = ux (dx - k dy), v = vy dy.
    std::vector<float> conics;
    std::vector<float> compensations;  // [C, N]; empty unless asked for
};

/// dL/d(output) of a projection, with the shapes of ProjectedSplats. An empty array is a gradient of zero.
struct ProjectedGradient {
    std::span<const float> means2d{}, depths{}, conics{}, compensations{};
};

/// dL/d(input) of a projection, added over the views in their order.
struct SplatGradient {
    std::vector<float> means;          // [N, 3]
    std::vector<float> quaternions;    // [N, 4]; empty if there are covariances
    std::vector<float> scales;         // [N, 3]; empty if there are covariances
    std::vector<float> covariances;    // [N, 6]: an entry off the diagonal counts both of its places
    std::vector<float> view_matrices;  // [C, 4, 4]; the last row is 0; empty unless asked for
};

inline constexpr uint32_t kMaxHarmonicsDegree = 4;

/// Spherical harmonics of N splats, shared by C views: colour = sum over k of coefficient k times Y_k(direction), with neither
/// an offset nor a clamp. Y_k has INRIA's order and signs (3DGS, utils/sh_utils.py), and to degree 4 gsplat's.
struct HarmonicsArrays {
    uint32_t degree = 0;                  // to kMaxHarmonicsDegree; higher coefficients are not read
    uint32_t coefficient_count = 1;       // K, at least (degree + 1)^2
    uint32_t channels = 3;                // D, at least 1
    std::span<const float> directions;    // [C, N, 3], of any length
    std::span<const float> coefficients;  // [N, K, D]
    std::span<const uint8_t> masks;       // [C, N]: 0 makes the colour 0; empty: none is
};

/// dL/d(input) of spherical harmonics.
struct HarmonicsGradient {
    std::vector<float> coefficients;  // [N, K, D], added over the views in their order
    std::vector<float> directions;    // [C, N, 3]; empty unless asked for
};

/// M splats as 2D Gaussians of one image: alpha = min(0.99, opacity exp(-d^T conic d / 2)), d = pixel - mean.
struct ScreenSplats {
    std::span<const float> means2d;  // [M, 2], px
    std::span<const float> conics;   // [M, 3]: conics, or whiteners
    bool whiteners = false;
    std::span<const float> opacities;  // [M]
    std::span<const float> features;   // [M, D]
    uint32_t channels = 3;             // D, at least 1
    size_t size() const { return opacities.size(); }
};

/// Which splats a pixel draws: all, nearest first, equal depths by index.
struct DepthOrder {
    std::span<const float> depths;     // [M]
    std::span<const int32_t> radii{};  // [M, 2]; a splat with a radius of 0 is skipped; empty: none is
};

/// Which splats a pixel draws: the list of its tile, in the order of the list.
struct TileLists {
    uint32_t tile_size = 16;  // px, a multiple of 4
    /// [tiles + 1], row by row: where each tile's list begins. The last is the end.
    std::span<const int32_t> offsets;
    std::span<const int32_t> splats;  // the lists, one after another
};

/// Options of Operators::blend.
struct BlendOptions {
    uint32_t width = 0, height = 0;       // px
    std::span<const float> background{};  // [D]; empty: 0
    /// One value for each tile, row by row. 0: the tile's pixels show the background and have alpha 0. Empty: all tiles are drawn.
    std::span<const uint8_t> tile_mask{};
    uint32_t mask_tile_size = 16;  // px
    bool gradients = true;         // make a BlendRecord for blend_backward
};

/// The state of a blend, for blend_backward of the same operators. It holds memory of the device until it is destroyed.
class BlendRecord {
  public:
    ~BlendRecord();
    BlendRecord(const BlendRecord&) = delete;

  private:
    friend class Operators;
    explicit BlendRecord(std::unique_ptr<operators::BlendFrame> frame);
    std::unique_ptr<operators::BlendFrame> frame_;
};

/// An image of H x W pixels with D channels, first row at the top.
struct BlendedImage {
    std::vector<float> features;          // [H, W, D]: sum of f alpha T, and T times the background
    std::vector<float> alphas;            // [H, W], 1 - T
    std::shared_ptr<BlendRecord> record;  // null without BlendOptions::gradients
    // Splats that were skipped because a value is not finite or a conic not positive definite.
    uint32_t skipped_nonfinite = 0;
};

/// dL/d(input) of blending.
struct ScreenGradient {
    std::vector<float> means2d;     // [M, 2]
    std::vector<float> conics;      // [M, 3], by conics or by whiteners
    std::vector<float> opacities;   // [M]
    std::vector<float> features;    // [M, D]
    std::vector<float> background;  // [D]
    /// [M, 2]: sum over the pixels of |dL/d(mean)| (Ye et al. 2024, AbsGS, eq. 7). Empty unless asked for.
    std::vector<float> absolute;
};

/// The operators of one device. Kernels are compiled at their first use and kept. Calls may come from any thread, and
/// run one after the other. All throw InputError, which names the argument and its size, for arrays of the wrong size,
/// and RunError when the device fails or has no memory left. Results are the same bytes each time on the same device.
class Operators {
  public:
    explicit Operators(std::shared_ptr<gpu::Device> device);
    ~Operators();
    Operators(const Operators&) = delete;

    /// The projection of Gaussians by its first-order Taylor expansion (Zwicker et al. 2001, eq. 22 to 31).
    ProjectedSplats project(const SplatArrays& splats, const ViewArrays& views,
                            const ProjectionOptions& options);
    /// The gradient of project. radii: the ones that project has returned for the same arguments.
    SplatGradient project_backward(const SplatArrays& splats, const ViewArrays& views,
                                   const ProjectionOptions& options, std::span<const int32_t> radii,
                                   const ProjectedGradient& gradient, bool view_gradients);

    /// Evaluates the spherical harmonics. Returns the colours, [C, N, D].
    std::vector<float> spherical_harmonics(const HarmonicsArrays& harmonics);
    /// colors_gradient: [C, N, D].
    HarmonicsGradient spherical_harmonics_backward(const HarmonicsArrays& harmonics,
                                                   std::span<const float> colors_gradient,
                                                   bool direction_gradients);

    /// Blends front to back: C = sum f alpha T + T background (Kerbl et al. 2023, eq. 3). An alpha below 1/255 is skipped. A pixel
    /// ends before the splat that would take T to 1e-4 or below.
    BlendedImage blend(const ScreenSplats& splats, const DepthOrder& order, const BlendOptions& options);
    BlendedImage blend(const ScreenSplats& splats, const TileLists& lists, const BlendOptions& options);
    /// features_gradient: [H, W, D]. alphas_gradient: [H, W]; empty: 0.
    ScreenGradient blend_backward(const BlendRecord& record, std::span<const float> features_gradient,
                                  std::span<const float> alphas_gradient, bool absolute);

  private:
    std::shared_ptr<operators::Context> context_;
};

}  // namespace ewa
