// SPDX-License-Identifier: Apache-2.0
// The loss of a render against a training image, its gradient, and the training image's mask and exposure.
#pragma once
#include "passes/pass.h"

namespace ewa::passes {

/// Unpacks a training image into planes, over the background.
struct UnpackTarget : ElementPass {
    static constexpr char shader[] = "unpack_target";
    struct Buffers {
        gpu::BufferPart photo, planes;
    };
    using Push = shared::UnpackPush;
    static Groups groups(const KernelConfig& c, const Push& push) { return pixel_groups(c, push.image); }
};

struct MaskPass : ElementPass {
    using Push = shared::ImageLayout;
    static Groups groups(const KernelConfig& c, const Push& push) { return pixel_groups(c, push); }
};

/// Unpacks a masked training image, and moves a copy of the render towards it where pixels count less.
struct MaskPictures : MaskPass {
    static constexpr char shader[] = "mask_pictures";
    struct Buffers {
        gpu::BufferPart photo, image, target, masked;
    };
};

/// Gradient of MaskPictures, in place.
struct MaskGradient : MaskPass {
    static constexpr char shader[] = "mask_gradient";
    struct Buffers {
        gpu::BufferPart photo, image_gradient;
    };
};

/// The moments of the SSIM window, blurred down the columns.
struct LossColumns : ElementPass {
    static constexpr char shader[] = "loss_columns";
    struct Buffers {
        gpu::BufferPart image, target, moments;
    };
    using Push = shared::LossPush;
    static Groups groups(const KernelConfig& c, const Push& push) {
        return element_groups(c, loss_column_items(push.image.stride, push.image.size[1]), 3);
    }
};

/// SSIM, its derivatives by the moments, and partial sums of SSIM.
struct LossRows : ElementPass {
    static constexpr char shader[] = "loss_rows";
    struct Buffers {
        gpu::BufferPart moments, derivatives, partials;
    };
    using Push = shared::LossPush;
    static Groups groups(const KernelConfig& c, const Push& push) {
        return element_groups(c, loss_row_items(push.image.stride, push.image.size[1]), 3);
    }
};

/// The derivatives of SSIM, blurred down the columns.
struct LossBackwardColumns : ElementPass {
    static constexpr char shader[] = "loss_backward_columns";
    struct Buffers {
        gpu::BufferPart derivatives, blurred;
    };
    using Push = shared::LossPush;
    static Groups groups(const KernelConfig& c, const Push& push) {
        return element_groups(c, loss_column_items(push.image.stride, push.image.size[1]), 9);
    }
};

/// Gradient of the whole loss by the render, and partial sums of the L1 loss.
struct LossBackwardRows : ElementPass {
    static constexpr char shader[] = "loss_backward_rows";
    struct Buffers {
        gpu::BufferPart blurred, image, target, image_gradient, partials;
    };
    using Push = shared::LossPush;
    static Groups groups(const KernelConfig& c, const Push& push) {
        return element_groups(c, loss_row_items(push.image.stride, push.image.size[1]), 3);
    }
};

/// Adds floats in a fixed order.
struct Reduce : SubgroupPass {
    static constexpr char shader[] = "reduce";
    struct Buffers {
        gpu::BufferPart source, sums, counts;
    };
    using Push = shared::ReducePush;
    static Groups groups(const KernelConfig& c, const Push& push) {
        return block_groups(c, push.items, push.block);
    }
};

/// Applies a training image's exposure to the render.
struct Expose : ElementPass {
    static constexpr char shader[] = "expose";
    struct Buffers {
        gpu::BufferPart image, exposures, exposed;
    };
    using Push = shared::ExposurePush;
    static Groups groups(const KernelConfig& c, const Push& push) { return pixel_groups(c, push.image); }
};

/// Gradient of Expose: by the render in place, by the exposure as partial sums.
struct ExposeBackward : SubgroupPass {
    static constexpr char shader[] = "expose_backward";
    struct Buffers {
        gpu::BufferPart image, exposures, image_gradient, sums;
    };
    using Push = shared::ExposurePush;
    static Groups groups(const KernelConfig& c, const Push& push) {
        return block_groups(c, uint64_t(push.image.size[0]) * push.image.size[1], shared::EXPOSURE_BLOCK);
    }
};

/// Adam's step of one training image's exposure.
struct ExposureUpdate : SubgroupPass {
    static constexpr char shader[] = "exposure_update";
    struct Buffers {
        gpu::BufferPart sums, exposures, moments1, moments2, counts;
    };
    using Push = shared::ExposureUpdatePush;
    static Groups groups(const KernelConfig&, const Push&) { return {1, 1, 1}; }
};

}  // namespace ewa::passes
