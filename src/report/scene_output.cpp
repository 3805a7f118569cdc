// SPDX-License-Identifier: Apache-2.0
#include "report/scene_output.h"

#include <cmath>

#include "core/atomic_file.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "io/splats/tileset.h"
#include "report/scene_page.h"
#include "scene/framing.h"
#include "scene/splat_arrays.h"

namespace ewa::report {
namespace {

namespace fs = std::filesystem;

constexpr int kStartWidth = 1280, kStartHeight = 720;

/// Each page of a folder has levels of its own. Relative to it.
fs::path levels_beside(const fs::path& page) {
    return fs::path(page.stem().string() + "-levels") / "lod-meta.json";
}

}  // namespace

bool names_page(const fs::path& path) {
    const std::string extension = core::lower(path.extension().string());
    return extension == ".html" || extension == ".htm";
}

fs::path levels_of_page(const fs::path& page) {
    return page.parent_path() / levels_beside(page);
}

bool names_tileset(const std::filesystem::path& path) {
    return core::lower(path.filename().string()) == io::kTilesetName;
}

namespace {

std::optional<glm::dmat4> parse_geo(const std::string& text) {
    if (text.empty()) return std::nullopt;
    if (text == "ecef") return glm::dmat4(1);
    std::vector<double> values;
    bool numbers = true;
    for (size_t begin = 0, end = 0; begin <= text.size(); begin = end + 1) {
        end = std::min(text.find(',', begin), text.size());
        const auto value = core::parse_number(core::trim(std::string_view(text).substr(begin, end - begin)));
        numbers = numbers && value && std::isfinite(*value);
        values.push_back(value.value_or(0));
    }
    if (!numbers || values.size() < 3 || values.size() > 4 || std::abs(values[0]) > 90 ||
        std::abs(values[1]) > 360)
        throw InputError(
            "--geo: '" + core::one_line(text.substr(0, 100)) +
            "' is neither ecef nor latitude,longitude,height[,heading] in degrees and metres, such as "
            "47.37,8.54,410");
    values.resize(4);
    return io::earth_of_place({values[0], values[1], values[2], values[3]});
}

std::vector<std::string> write_page(const fs::path& path, Gaussians gaussians, const SaveOptions& options,
                                    const OutputOptions& output, const PageCameras& cameras) {
    std::vector<std::string> remarks;
    ScenePage page;
    page.title = output.title.empty() ? path.stem().string() : output.title;
    core::AtomicFile file(path);
    scene::FramingHints hints;
    const std::vector<Frame>& frames = cameras.dataset.frames;
    for (const Frame& frame : frames) page.views.push_back({frame.name, scene::pinhole_at(frame.camera)});
    if (!frames.empty()) {
        hints.up = scene::mean_up(cameras.dataset);
        hints.forward = glm::transpose(frames[0].camera.rotation)[2];
    }
    page.background = cameras.background;
    const scene::Framing framing = scene::frame_scene(gaussians, kStartWidth, kStartHeight, hints);
    page.start = page.views.empty() ? framing.camera : page.views.front().camera;
    if (page.views.empty())
        page.portrait = scene::frame_scene(gaussians, kStartHeight, kStartWidth, hints).camera;
    page.target = framing.target;
    page.up = framing.up;
    if (output.unbundled) {
        page.levels = levels_beside(path).generic_string();
        for (std::string& remark : save_levels(levels_of_page(path), std::move(gaussians), options))
            remarks.push_back(std::move(remark));
    } else {
        page.sog = sog_bytes(path, gaussians, options, remarks);
    }
    file.write(scene_page_html(page));
    file.commit();
    return remarks;
}

/// On the globe where --geo says, else where the scene's comments say.
std::vector<std::string> write_tiles(const SceneOutput& output, Gaussians gaussians, SaveOptions options) {
    std::vector<std::string> remarks;
    std::optional<glm::dmat4> earth = output.earth;
    if (const auto place = earth ? std::nullopt : io::place_in(options.comments)) {
        earth = io::earth_of_place(*place);
        remarks.push_back("on the globe at latitude " + std::to_string(place->latitude) + ", longitude " +
                          std::to_string(place->longitude) + " and height " +
                          std::to_string(int(std::lround(place->height))) + " m, by the GPS of the photos");
    }
    std::erase_if(options.comments, io::is_place_comment);
    if (gaussians.density) {
        fit_opacities(gaussians, false);
        remarks.emplace_back("opacities of --kernel density are fitted to 3DGS's kernel");
    }
    std::vector<uint32_t> kept;
    for (size_t i = 0; i < gaussians.size(); ++i)
        if (drawable(gaussians, i)) kept.push_back(uint32_t(i));
    if (kept.size() < gaussians.size()) {
        remarks.push_back(core::counted(gaussians.size() - kept.size(), "splat") +
                          " with a value that is not finite or a zero quaternion: skipped (" +
                          scene::undrawable_text(gaussians) + ")");
        keep_splats(gaussians, kept);
    }
    if (!scene::is_computable(gaussians)) gaussians = scene::computable(std::move(gaussians));
    const std::vector<std::string> more =
        io::write_tileset(output.file, std::move(gaussians), {.save = options, .earth = earth});
    remarks.insert(remarks.end(), more.begin(), more.end());
    if (!options.comments.empty()) remarks.emplace_back("comments are dropped");
    return remarks;
}

void check_options(const SceneOutput& output, const OutputOptions& options) {
    const SplatFormat format = output.format;
    const bool levels = format == SplatFormat::sog_levels || output.tiles || options.unbundled;
    if (!options.geo.empty() && !output.tiles) throw InputError("--geo: only a tileset.json is on a globe");
    if (!options.title.empty() && !output.page) throw InputError("--title: only a page has one");
    if (options.unbundled && !output.page) throw InputError("--unbundled: only a page has its scene inside");
    if (options.levels > 0 && !levels)
        throw InputError(
            "--levels: only a lod-meta.json, a tileset.json and an --unbundled page have levels");
    if (options.spz_version > 0 && (output.tiles || options.gltf_spz))
        throw InputError("--spz-version: a glTF and tiles hold SPZ 2; only an .spz has a version to choose");
    if (options.spz_version > 0 && format != SplatFormat::spz)
        throw InputError("--spz-version: only an .spz has one");
    if (options.gltf_spz && format != SplatFormat::glb && format != SplatFormat::gltf)
        throw InputError("--gltf-spz: only a .glb or .gltf can hold an SPZ");
}

SplatFormat format_of_output(const fs::path& file) try {
    return format_to_write(file);
} catch (const InputError& error) {
    const std::string extension = core::lower(file.extension().string());
    std::string hint = ", tileset.json, .html (a page)";
    for (const char* mesh : {".obj", ".stl", ".fbx", ".dae"})
        if (extension == mesh)
            hint += "; ewa mesh makes meshes: ewa mesh IN -o " + file.stem().string() +
                    (extension == ".obj" ? ".obj" : ".glb");
    throw InputError(error.what() + core::one_line(hint));
}

}  // namespace

SceneOutput output_of(const fs::path& file, const OutputOptions& options) {
    SceneOutput output{.file = file,
                       .page = names_page(file),
                       .tiles = names_tileset(file),
                       .earth = parse_geo(options.geo)};
    output.format = output.page ? SplatFormat::sog : output.tiles ? SplatFormat::glb : format_of_output(file);
    check_options(output, options);
    return output;
}

std::vector<std::string> write_output(const SceneOutput& output, const OutputOptions& options,
                                      Gaussians& gaussians, SaveOptions save, const PageCameras& cameras) {
    if (options.spz_version > 0) save.spz_version = options.spz_version;
    save.gltf_spz = options.gltf_spz;
    save.levels = options.levels;
    if (output.page) return write_page(output.file, std::move(gaussians), save, options, cameras);
    if (output.tiles) return write_tiles(output, std::move(gaussians), save);
    if (output.format == SplatFormat::sog_levels) return save_levels(output.file, std::move(gaussians), save);
    return save_splats(output.file, gaussians, save);
}

}  // namespace ewa::report
