// SPDX-License-Identifier: Apache-2.0
// The state that all operators of a device share. Buffers are used again in later calls.
#pragma once
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "ewa/operators.h"
#include "gpu/executor.h"
#include "operators/array.h"
#include "operators/blend_frame.h"
#include "passes/pass.h"

namespace ewa::operators {

struct ProjectionBuffers {
    Array views{"views"}, means{"means"}, shapes{"shapes"}, scales{"scales"}, opacities{"opacities"};
    Array radii{"radii"}, means2d{"means2d"}, depths{"depths"}, conics{"conics"},
        compensations{"compensations"};
    Array means_gradient{"means gradient"}, shapes_gradient{"shapes gradient"},
        scales_gradient{"scales gradient"};
    Array view_sums{"view sums"}, reduced{"reduced view sums"}, counts{"unused counts"};

    /// The caller's arrays, at the end of a call.
    void give_back() {
        for (Array* array :
             {&means, &shapes, &scales, &opacities, &radii, &means2d, &depths, &conics, &compensations})
            array->give_back();
    }
};

struct HarmonicsBuffers {
    Array directions{"directions"}, coefficients{"coefficients"}, masks{"masks"}, colors{"colors"};
    Array coefficients_gradient{"coefficients gradient"}, directions_gradient{"directions gradient"};

    void give_back() {
        for (Array* array : {&directions, &coefficients, &masks, &colors}) array->give_back();
    }
};

struct Context {
    explicit Context(std::shared_ptr<gpu::Device> d)
        : device(std::move(d)), cache(*device), executor(*device) {}

    std::shared_ptr<gpu::Device> device;
    passes::PassCache cache;
    gpu::Executor executor;
    std::mutex mutex;  // held by each operator while it uses the device or one of the members below

    ProjectionBuffers projection;
    HarmonicsBuffers harmonics;
    std::vector<std::unique_ptr<BlendFrame>> free_frames;
    std::mutex frames_mutex;  // of free_frames
};

}  // namespace ewa::operators
