// SPDX-License-Identifier: Apache-2.0
#include "cli/convert_clean.h"

#include <CLI/CLI.hpp>

#include "cli/arguments.h"
#include "cli/run_inputs.h"
#include "ewa/error.h"
#include "ewa/renderer.h"
#include "scene/framing.h"

namespace ewa::cli {
namespace {

std::vector<Camera> cameras_that_see(const std::optional<folders::Run>& run) {
    if (!run)
        throw InputError(
            "--min-views: cameras are needed; give the folder of a training run as the only input");
    std::vector<Camera> cameras;
    for (const Frame& frame : cameras_of_run(*run).frames) cameras.push_back(frame.camera);
    return cameras;
}

}  // namespace

void add_cleaning_options(CLI::App& app, Cleaning& cleaning) {
    const size_t others = app.get_options().size();
    app.add_flag("--remove-invalid", cleaning.invalid,
                 "Remove splats with a value that is not finite, or a zero quaternion");
    app.add_option(
           "--keep", cleaning.ranges,
           "Keep only splats whose column is in this range; a bound may be left out. Columns: x, y, z, "
           "opacity, scale (the largest), thickness (the smallest scale), red, green, blue. May be repeated")
        ->type_name("COLUMN=LOW..HIGH")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
        ->take_all();
    app.add_option("--crop", cleaning.box,
                   "Keep only splats whose centre is in this box; applied after --transform")
        ->type_name("x,y,z,X,Y,Z");
    app.add_option("--crop-sphere", cleaning.sphere, "Keep only splats whose centre is in this sphere")
        ->type_name("x,y,z,radius");
    app.add_option("--min-opacity", cleaning.min_opacity, "Keep only splats with at least this opacity")
        ->transform(in_range(0.0, 1.0))
        ->type_name("0..1");
    app.add_option("--min-views", cleaning.min_views,
                   "Of a training run: remove splats whose centre is in fewer images than this")
        ->transform(in_range(0, 1'000'000))
        ->type_name("N");
    app.add_flag("--remove-floaters", cleaning.floaters,
                 "Remove groups of fewer than 10 splats that touch no others of about their size");
    app.add_flag("--largest-cluster", cleaning.largest_cluster,
                 "Keep only the largest group of splats that touch others of about their size");
    app.add_option("--dry-run", cleaning.picture,
                   "Write only this picture, in which all that would be removed is red. OUT may be left out, "
                   "and is not written")
        ->type_name("PICTURE");
    const std::vector<CLI::Option*> all = app.get_options();
    for (size_t i = others; i < all.size(); ++i) all[i]->group("Clean");
}

std::vector<scene::Removed> clean(Gaussians& gaussians, const Cleaning& cleaning,
                                  const std::optional<folders::Run>& run) {
    return scene::clean(gaussians, cleaning,
                        cleaning.min_views > 0 ? cameras_that_see(run) : std::vector<Camera>());
}

void draw_removed(const std::filesystem::path& picture, const Gaussians& all, const Gaussians& left,
                  const std::optional<folders::Run>& run) {
    constexpr int kWidth = 1280, kHeight = 720;
    Camera camera = scene::frame_scene(all, kWidth, kHeight).camera;
    if (run)
        if (const Dataset dataset = cameras_of_run(*run); !dataset.frames.empty())
            camera = scene::pinhole_at(dataset.frames.front().camera);
    RenderOptions options;
    if (all.density) options.kernel = Footprint::density;
    save_image(
        picture,
        Renderer(open_device({}), scene::with_removed_in_red(all, left), options).render(camera).color);
}

}  // namespace ewa::cli
