#include "ewa/splat_files.h"

#include "core/log.h"
#include "core/text.h"
#include "ewa/error.h"
#include "io/ply.h"

namespace ewa {

namespace {

/// Throws InputError for an extension of another format. "a.compressed.ply" is SuperSplat's format, not
/// INRIA's.
void require_ply(const std::filesystem::path& path) {
    const std::string name = core::lower(path.filename().string());
    if (name.ends_with(".ply") && !name.ends_with(".compressed.ply")) return;
    throw InputError(core::one_line(path.string() + ": not a supported kind of splat file; supported: .ply"));
}

}  // namespace

Gaussians load_splats(const std::filesystem::path& path) {
    require_ply(path);
    io::PlySplats splats = io::read_ply(path);
    if (splats.file_sh_degree > kMaxShDegree)
        core::warn(core::one_line(path.string()) + ": has SH degree " +
                   std::to_string(splats.file_sh_degree) + "; degrees above " + std::to_string(kMaxShDegree) +
                   " are left out");
    return std::move(splats.gaussians);
}

void save_splats(const std::filesystem::path& path, const Gaussians& gaussians,
                 const std::vector<std::string>& comments) {
    require_ply(path);
    io::write_ply(path, gaussians, comments);
}

}  // namespace ewa
