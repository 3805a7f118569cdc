// SPDX-License-Identifier: Apache-2.0
// The buffers of the projection and of spherical harmonics. They are kept from call to call.
#pragma once
#include "operators/context.h"

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

}  // namespace ewa::operators
