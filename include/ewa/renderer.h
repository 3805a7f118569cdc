// SPDX-License-Identifier: Apache-2.0
// Renders and gradients of a fixed splat scene.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "ewa/camera.h"
#include "ewa/camera_motion.h"
#include "ewa/device.h"
#include "ewa/gaussians.h"
#include "ewa/image.h"
#include "ewa/loss_weights.h"
#include "ewa/plan.h"
#include "ewa/render_options.h"

namespace ewa {

struct DeviceTarget;  // ewa/gpu_interop.h, for renders that stay on the device
struct DeviceSync;

/// The planes of a render, of the camera's size. T is the transmittance. Planes that Drawing does not ask for are empty.
struct Rendering {
    Image color;  // RGB, background blended in, not clamped
    Image alpha;  // one channel, 1 - T
    Image depth;  // one channel, world units: sum of view z * alpha_i * T_i, divided by alpha where alpha > 0
    Image count;  // one channel, number of splats blended
    /// One channel, world units: view z, or the distance through a fisheye or 360° lens. It is where the ray meets the surface of
    /// the splat that takes the transmittance to a half or below, and 0 if none does. The render then has no colour.
    Image median_depth{};
    /// Three channels, world axes: normals of the splats' surfaces towards the eye, blended as colours are, of length 1. 0 where no
    /// splat is. The render then has no colour.
    Image normal{};
};

/// Holds a scene on a device and renders it. One thread at a time may use it.
class Renderer {
  public:
    /// Uploads the scene. Throws InputError for arrays of a wrong length and options out of range. Throws RunError when it
    /// does not fit in the device's memory (the text says how much it needs).
    Renderer(std::shared_ptr<gpu::Device> device, const Gaussians& gaussians, const RenderOptions& options);
    ~Renderer();
    Renderer(Renderer&&) noexcept;

    /// Throws InputError when the camera's size is not positive or exceeds what the device can address, RunError when memory runs
    /// out.
    Rendering render(const Camera& camera, bool with_depth = false);
    Rendering render(const Camera& camera, Drawing drawing);

    /// Renders with other options than the renderer's. SH degrees above that of the renderer's own options are not evaluated.
    Rendering render(const Camera& camera, const DrawOptions& options);

    /// The colour alone, as 8-bit RGBA, rounded and clamped as save_image does it. This is for windows: the floating-point planes
    /// stay on the device. options.drawing is color or ellipsoids. The returned reference is valid until the next render.
    const std::vector<uint8_t>& render_bytes(const Camera& camera, const DrawOptions& options);

    /// Replaces the scene. Compiled kernels are used again. Throws as the constructor does; after a RunError the renderer has no
    /// splats.
    void replace(const Gaussians& gaussians);

    /// Marks the splats: a byte of Mark bits each, in the order of the scene; empty: no marks. Splats stay as they are. The marks
    /// stay until replace(). Renders along rays throw InputError if marks would change them. Throws InputError for another length.
    void mark(std::span<const uint8_t> marks);

    /// Splats skipped in the last render because a stored value is not finite or the quaternion is zero.
    uint32_t skipped_nonfinite() const;
    /// Splats that reach a tile of the image in the last render with DrawOptions.
    uint32_t splats_drawn() const;
    std::vector<PassTime> pass_times() const;  // of the last frame

  private:
    friend void render_to(Renderer&, const Camera&, const DrawOptions&, std::span<const DeviceTarget>,
                          const DeviceSync&);
    struct State;
    std::unique_ptr<State> state_;
};

/// The loss of a view, its terms without their weights (ssim: the mean SSIM), and its gradient.
struct LossGradient {
    double loss = 0, l1 = 0;
    double l2 = 0, ssim = 0, alpha = 0, depth = 0;  // 0 if their weight is 0
    LossWeights weights;                            // that apply to this view: that of alpha is not automatic
    Gaussians gradient;                             // dL/d(stored value) in place of each stored value
    /// dL/d(each value of the camera's motion) at zero motion. Zero with RenderOptions::points, Integrator::ray and march. The
    /// derivative by log_focal is zero if the camera moves during its readout. For a pinhole, it counts that the bounds of the
    /// Jacobian's tangents change with the focal length.
    CameraMotion camera;
    uint32_t skipped_nonfinite = 0;
};

/// The training loss of one view and its gradient. target: RGB, or RGBA that is composited over the background or, with
/// alpha_is_weight, in which alpha says how much a pixel counts; of the camera's size. depths: the view's depth map of one channel,
/// for the depth term of the loss; 0 where a depth is unknown. Empty: no depth map. Throws InputError for arrays and images of
/// other lengths.
LossGradient loss_gradient(std::shared_ptr<gpu::Device> device, const Gaussians& gaussians,
                           const Camera& camera, const Image& target, const RenderOptions& options,
                           bool alpha_is_weight = false, const LossWeights& weights = {},
                           const Image& depths = {});

/// The work that a Renderer of this scene skips, in colour images with these options. Throws InputError as the renderer does.
std::vector<PlanLine> plan_lines(const Gaussians& gaussians, const RenderOptions& options);

}  // namespace ewa
