// SPDX-License-Identifier: Apache-2.0
// How much a splat file looks like the scene that was written to it.
#pragma once
#include "ewa/splat_files.h"
#include "report/summary.h"

namespace ewa::cli {

/// Renders both scenes from some sides and prints their PSNR, unless quiet. Without a Vulkan device it prints the reason
/// that there is none. Returns "views", "psnr" (mean; null: equal) and "worst_psnr", or "error".
report::Json check_renders(const Gaussians& written, const SplatScene& read, bool quiet);

}  // namespace ewa::cli
