// SPDX-License-Identifier: Apache-2.0
#include "mesh/meshing.h"

#include "core/plugin.h"

namespace ewa::mesh {

const Meshing& meshing() {
    static constexpr core::Plugin plugin{"libewa_meshing", kMeshingEntry, "which makes meshes",
                                         core::Thing::openvdb};
    static const auto& loaded = *static_cast<const Meshing*>(core::load_plugin(plugin));
    return loaded;
}

}  // namespace ewa::mesh
