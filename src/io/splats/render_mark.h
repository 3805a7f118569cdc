// SPDX-License-Identifier: Apache-2.0
// The mark that tells how splats were trained, in the comments of a PLY and in the meta.json of a SOG:
//   Brush     SplatRenderMode: default | mip | 2dgs      also splat-transform, which writes it to both kinds of PLY
//   Postshot  antialiased 0 | 1
//   SOG       "antialias": true in PlayCanvas' specification, "model": "antialiased" | "2dgs" of splat-transform
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "ewa/splat_scene.h"

namespace ewa::io {

inline constexpr std::string_view kSurfels = "2dgs", kAntialiasedModel = "antialiased";

/// Takes the marks out of the scene's comments. The last one counts.
void take_marks(SplatScene& scene);

/// A remark that the splats are flat ones (2DGS), which ewa draws as ellipsoids.
void remark_surfels(SplatScene& scene);

/// The comments of a PLY to write, with one mark or none; each is one line. A mark among options.comments counts too.
std::vector<std::string> marked_comments(const SaveOptions& options);

}  // namespace ewa::io
