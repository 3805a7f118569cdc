// SPDX-License-Identifier: Apache-2.0
// The compiled kernels of a device, each made when it is first asked for.
#pragma once
#include <map>
#include <memory>
#include <typeindex>
#include <utility>
#include <vector>

#include "passes/blend.h"
#include "passes/blend_backward.h"
#include "passes/densify_decide.h"
#include "passes/densify_write.h"
#include "passes/emit_instances.h"
#include "passes/expose.h"
#include "passes/expose_backward.h"
#include "passes/exposure_update.h"
#include "passes/loss_backward_columns.h"
#include "passes/loss_backward_rows.h"
#include "passes/loss_columns.h"
#include "passes/loss_rows.h"
#include "passes/mask_gradient.h"
#include "passes/mask_pictures.h"
#include "passes/mcmc_draw.h"
#include "passes/mcmc_weigh.h"
#include "passes/mcmc_write.h"
#include "passes/pack.h"
#include "passes/perturb.h"
#include "passes/project.h"
#include "passes/radix_count.h"
#include "passes/radix_scatter.h"
#include "passes/reduce.h"
#include "passes/reset_opacity.h"
#include "passes/scan_blocks.h"
#include "passes/scan_totals.h"
#include "passes/tile_starts.h"
#include "passes/unpack_target.h"
#include "passes/update.h"

namespace ewa::pipeline {

class Kernels {
  public:
    explicit Kernels(gpu::Device& device) : device_(device), shape_(passes::shape_for(device.limits())) {}
    Kernels(gpu::Device& device, const passes::Shape& shape) : device_(device), shape_(shape) {}

    gpu::Device& device() const { return device_; }
    const passes::Shape& shape() const { return shape_; }

    /// The kernel of a type with these specialisation arguments (those of its constructor after the shape).
    template <class Pass, class... Arguments>
    const Pass& get(Arguments... arguments) {
        const Key key{std::type_index(typeid(Pass)), {uint32_t(arguments)...}};
        auto& kernel = kernels_[key];
        if (!kernel) kernel = std::make_shared<Pass>(device_, shape_, arguments...);
        return *static_cast<const Pass*>(kernel.get());
    }

  private:
    using Key = std::pair<std::type_index, std::vector<uint32_t>>;
    gpu::Device& device_;
    passes::Shape shape_;
    std::map<Key, std::shared_ptr<void>> kernels_;
};

}  // namespace ewa::pipeline
