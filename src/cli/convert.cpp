// SPDX-License-Identifier: Apache-2.0
// ewa convert: reads splat files of any format, joins and edits them, and writes one file.
#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>
#include <memory>
#include <set>
#include <sstream>

#include "cli/arguments.h"
#include "cli/command.h"
#include "cli/comparison.h"
#include "cli/convert_edits.h"
#include "cli/convert_files.h"
#include "cli/output.h"
#include "cli/run_inputs.h"
#include "cli/splat_statistics.h"
#include "core/folders.h"
#include "core/messages.h"
#include "core/text.h"
#include "edit/journal.h"
#include "edit/steps.h"
#include "ewa/error.h"
#include "ewa/render_options.h"
#include "ewa/splat_edit.h"
#include "ewa/splat_files.h"
#include "folders/run_folder.h"
#include "io/datasets/view_list.h"
#include "io/splats/format_table.h"
#include "io/splats/output_options.h"
#include "io/splats/place.h"
#include "io/splats/prepare.h"
#include "io/splats/scene_page.h"
#include "options/command_options.h"
#include "scene/framing.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;
using report::Json;

constexpr int kCheckedSides = 8;

struct ConvertArguments {
    std::vector<fs::path> files;         // the last is written
    fs::path output;                     // -o, which becomes the last of the files
    std::vector<glm::dmat4> placements;  // of the inputs
    EditArguments editing;
    io::OutputOptions output_options;
    int level = 0;  // of the inputs
    fs::path json, views;
    bool bake_sky = false, check = false, allow_empty = false, quiet = false;
    std::optional<folders::Run> run;  // that the only input is of
};

struct PlacedInput {
    fs::path file;
    glm::dmat4 transform{1.0};
};

/// Parses an input with its own steps: FILE, FILE:STEP or FILE:STEP:STEP. A path that exists is a file, whatever its
/// name. Throws InputError for a step that is none.
PlacedInput parse_input(const std::string& text) {
    std::error_code error;
    if (fs::exists(text, error)) return {text};
    for (size_t colon = text.find(':'); colon != std::string::npos; colon = text.find(':', colon + 1)) {
        const std::string file = text.substr(0, colon);
        if (!fs::exists(file, error)) continue;
        std::vector<std::string> steps;
        std::istringstream rest(text.substr(colon + 1));
        for (std::string step; std::getline(rest, step, ':');) steps.push_back(step);
        if (steps.empty()) steps.emplace_back();
        return {file, edit::parse_transform(steps, file)};
    }
    return {text};
}

struct Work {
    Gaussians gaussians;
    SaveOptions save;
    std::vector<std::string> lost;                          // notes on what the output lacks
    Json inputs = Json::array(), removed = Json::object();  // removed: splats by option
};

struct SceneSize {
    size_t splats;
    int sh_degree;
};

SceneSize scene_size(const Gaussians& gaussians) {
    return {gaussians.size(), gaussians.sh_degree};
}

std::string described(const fs::path& path, std::string_view format, const std::string& variant,
                      const SceneSize& size, uint64_t bytes) {
    return fmt::format("{}: {}{}, {} splats of SH degree {}, {}", core::one_line(path.string()), format,
                       variant.empty() ? "" : " (" + variant + ")", size.splats, size.sh_degree,
                       core::bytes_text(bytes));
}

/// Adds splats in place of the sky of the file's run.
void bake_sky(const fs::path& file, Gaussians& gaussians) {
    const fs::path sky = file.parent_path() / folders::kSkyFile;
    if (!core::is_file(sky))
        throw InputError("--bake-sky: " + core::one_line(sky.string()) +
                         " is missing; ewa train --background sky writes it");
    append_splats(gaussians, sky_splats(load_sky(sky), gaussians));
}

/// The world's origin is at another place, or at several.
void drop_place(Work& work) {
    if (std::erase_if(work.save.comments, io::is_place_comment) > 0)
        work.lost.emplace_back("the place on the globe is dropped: splats are elsewhere than there");
}

/// Reads the inputs into `work` and appends each to the one before.
void read_all(const ConvertArguments& arguments, Work& work) {
    std::set<bool> marks, densities;
    size_t placed = 0;  // inputs that know their place
    for (size_t i = 0; i + 1 < arguments.files.size(); ++i) {
        const fs::path& path = arguments.files[i];
        SplatScene scene =
            arguments.level > 0 ? read_splat_level(path, size_t(arguments.level)) : read_splats(path);
        if (arguments.bake_sky) bake_sky(path, scene.gaussians);
        edit::place_splats(scene.gaussians, arguments.placements.at(i), path.string());
        if (!arguments.quiet)
            fmt::print("{}\n",
                       described(path, name_of(scene.format), scene.variant, scene_size(scene.gaussians),
                                 fs::file_size(path) + bytes_of(values_of(path))));
        work.inputs.push_back({{"file", path.string()},
                               {"format", name_of(scene.format)},
                               {"splats", scene.gaussians.size()},
                               {"sh_degree", scene.gaussians.sh_degree}});
        for (const std::string& remark : scene.remarks) work.lost.push_back(path.string() + ": " + remark);
        placed += io::place_in(scene.comments).has_value();
        for (std::string& comment : scene.comments)
            if (std::find(work.save.comments.begin(), work.save.comments.end(), comment) ==
                work.save.comments.end())
                work.save.comments.push_back(std::move(comment));
        marks.insert(scene.antialiased);
        densities.insert(scene.gaussians.density);
        if (i == 0)
            work.gaussians = std::move(scene.gaussians);
        else
            append_splats(work.gaussians, scene.gaussians);
    }
    work.save.antialiased = marks.contains(true);
    const bool moved = std::ranges::any_of(
        arguments.placements, [](const glm::dmat4& placement) { return placement != glm::dmat4(1); });
    if (moved || placed + 1 < arguments.files.size() || !io::place_in(work.save.comments)) drop_place(work);
    if (marks.size() > 1)
        work.lost.push_back(
            "some inputs were trained with --kernel antialias and others not; the output is marked as "
            "anti-aliased");
    if (densities.size() > 1)
        work.lost.push_back(
            "some inputs have --kernel density and others not; all opacities are fitted to 3DGS's kernel");
}

/// Prints how much renders of the file differ from those of the scene that was written to it, unless quiet. Without a Vulkan device it
/// prints the reason that there are none. Returns "views", "psnr" (mean; null: equal) and "worst_psnr", or "error".
Json compare_renders(const Gaussians& written, const SplatScene& read, bool quiet) {
    if (written.size() == 0) return Json::object();
    RenderOptions options;
    if (read.antialiased) options.kernel = Footprint::antialias;
    if (written.density) options.kernel = Footprint::density;
    try {
        const std::vector<Compared> all = compared_all_round(written, read.gaussians, options, kCheckedSides);
        const double mean = totals_of(all).psnr;
        double worst = std::numeric_limits<double>::infinity();
        for (const Compared& side : all) worst = std::min(worst, side.difference.psnr);
        if (!quiet && std::isinf(worst))
            fmt::print("  renders from {} sides are equal\n", all.size());
        else if (!quiet)
            fmt::print(
                "  renders from {} sides: PSNR {:.1f} dB, {:.1f} dB from the worst side; a difference is "
                "hard to see over 40 dB\n",
                all.size(), mean, worst);
        return {{"views", all.size()}, {"psnr", finite_number(mean)}, {"worst_psnr", finite_number(worst)}};
    } catch (const RunError& error) {
        if (!quiet) fmt::print("  no renders to compare: {}\n", core::one_line(error.what()));
        return {{"error", core::one_line(error.what())}};
    }
}

Json check(const ConvertArguments& arguments, const Work& work) {
    Json json = Json::object();
    SplatScene back = read_splats(arguments.files.back());
    fit_opacities(back.gaussians, work.gaussians.density);
    if (!arguments.quiet) fmt::print("read back: largest error, mean error\n");
    for (const Difference& d : differences(work.gaussians, back.gaussians)) {
        if (!arguments.quiet) fmt::print("  {:<18} {:.3g}, {:.3g} {}\n", d.what, d.largest, d.mean, d.unit);
        json[d.what] = {{"largest", d.largest}, {"mean", d.mean}, {"unit", d.unit}};
    }
    if (!arguments.quiet || !arguments.json.empty())
        json["renders"] = compare_renders(work.gaussians, back, arguments.quiet);
    return json;
}

/// Throws if an output is another file of this command, or cannot be written.
void check_files(const CLI::App& app, const ConvertArguments& arguments) {
    const fs::path& out = arguments.files.back();
    const bool unbundled = arguments.output_options.unbundled;
    std::vector<NamedFile> inputs, outputs = {{"OUT", out}};
    for (size_t i = 0; i + 1 < arguments.files.size(); ++i) {
        inputs.push_back({"an input", arguments.files[i]});
        check_not_a_part(unbundled ? io::levels_of_page(out) : out, arguments.files[i]);
        for (const fs::path& values : values_of(arguments.files[i]))
            inputs.push_back({"values of an input", values});
    }
    if (unbundled) outputs.push_back({"the levels of OUT", io::levels_of_page(out)});
    check_typed_outputs(app, outputs, inputs);
    const io::FormatRow& row = io::row_to_write(out);
    if (!row.beside) return;
    const io::ValueFiles beside = row.beside(out);
    for (const fs::path& file : beside.written) outputs.push_back({"the file of OUT's values", file});
    for (const fs::path& file : beside.removed) outputs.push_back({"the file of OUT's older values", file});
    check_typed_outputs(app, outputs, inputs);
}

/// Throws unless splats are left to write, or --allow-empty is given. read: the number of splats in the inputs.
void check_not_empty(const ConvertArguments& arguments, size_t read, size_t left) {
    if (left > 0 || arguments.allow_empty) return;
    const std::string why = read == 0 ? "the inputs have no splats"
                                      : fmt::format("none of the {} splats is left after the edits", read);
    throw InputError(arguments.files.back().string() + ": not written: " + why +
                     "; --allow-empty writes a file without splats");
}

Json output_json(const ConvertArguments& arguments, const SceneSize& size) {
    const fs::path& out = arguments.files.back();
    const std::vector<fs::path> values = parts_of(out, arguments.output_options.unbundled);
    Json json = {{"file", out.string()},
                 {"format", io::row_to_write(out).name},
                 {"splats", size.splats},
                 {"sh_degree", size.sh_degree},
                 {"bytes", fs::file_size(out)}};
    if (!values.empty()) json["values"]["bytes"] = bytes_of(values);
    for (const fs::path& file : values) json["values"]["files"].push_back(file.string());
    return json;
}

/// Applies the edits and says what they removed. Whether that was all, for --dry-run. Drops the run where the splats have moved.
bool edit_scene(const ConvertArguments& arguments, Work& work, std::optional<folders::Run>& run) {
    const fs::path& picture = arguments.editing.picture;
    std::vector<edit::Edit> edits = arguments.editing.edits;
    if (!picture.empty()) std::erase_if(edits, [](const edit::Edit& edit) { return bool(edit.change); });
    const Gaussians before = picture.empty() ? Gaussians() : work.gaussians;
    for (const fs::path& journal : arguments.editing.journals)
        for (std::string& remark : edit::journal_remarks(journal, work.gaussians.size()))
            work.lost.push_back(std::move(remark));
    std::vector<std::string> compared;
    const edit::Applied applied =
        edit::apply(work.gaussians, edits, cameras_of(run, compared, arguments.quiet));
    work.lost.insert(work.lost.end(), compared.begin(), compared.end());
    work.lost.insert(work.lost.end(), applied.remarks.begin(), applied.remarks.end());
    for (const std::string& warning : applied.warnings) core::warn(core::one_line(warning));
    for (const edit::Outcome& outcome : applied.outcomes) {
        const std::string of = core::counted(outcome.before, "splat");
        if (!outcome.removes) {
            work.lost.push_back(outcome.after < outcome.before
                                    ? fmt::format("{} left {} of {}", outcome.text, outcome.after, of)
                                    : fmt::format("{} made {} of {}", outcome.text,
                                                  core::counted(outcome.after, "splat"), outcome.before));
            continue;
        }
        const size_t removed = outcome.before - outcome.after;
        work.lost.push_back(fmt::format("{} {} {} of {}", outcome.text,
                                        picture.empty() ? "removed" : "would remove", removed, of));
        work.removed[outcome.text] = work.removed.value(outcome.text, size_t(0)) + removed;
    }
    if (!picture.empty()) {
        draw_removed(picture, before, applied.left, run);
        if (!arguments.quiet)
            for (const std::string& remark : work.lost) fmt::print("  {}\n", core::one_line(remark));
        if (!arguments.json.empty())
            write_json(arguments.json,
                       {{"inputs", work.inputs}, {"removed", work.removed}, {"remarks", work.lost}});
        return true;
    }
    if (!applied.moved) return false;
    drop_place(work);
    run.reset();
    return false;
}

/// Lets the page of a run show its dataset's cameras, which `cameras` holds, and its background. Adds a remark where they cannot be read.
void show_run(const folders::Run& run, Dataset& cameras, PageOptions& page,
              std::vector<std::string>& remarks) {
    page.background = core::parse_colour(run.text("background")).value_or(page.background);
    try {
        cameras = cameras_of_run(run);
        page.cameras = &cameras;
    } catch (const InputError& error) {
        remarks.push_back("the page has no views of photos: " + core::one_line(error.what()));
    }
}

/// The film of saved views. Throws InputError if the output is no page, or there are no views.
std::vector<FilmKey> film_through(const fs::path& file, const io::FormatRow& row) {
    constexpr double kDistance = 2;  // s, of views without times, as in films of ewa render
    if (row.format != SplatFormat::page) throw InputError("--views: only a page plays a film");
    const std::vector<io::NamedView> views = io::read_views(file);
    if (views.empty()) throw InputError(core::one_line(file.string()) + ": has no views");
    const std::vector<double> times = io::times_of(views, kDistance);
    std::vector<FilmKey> keys;
    for (size_t i = 0; i < views.size(); ++i)
        keys.push_back({scene::pinhole_at(views[i].camera), times[i] - times[0]});
    return keys;
}

int run(const CLI::App& app, const ConvertArguments& arguments) {
    const fs::path& out = arguments.files.back();
    Work work;
    io::set_output_options(work.save, out, arguments.output_options);
    const io::FormatRow& row = io::row_to_write(out);
    if (!arguments.views.empty()) work.save.page.film = film_through(arguments.views, row);
    if (arguments.check && !row.unchecked.empty()) throw InputError("--check: " + std::string(row.unchecked));
    // Report wrong use before the inputs are read: they may be large.
    const auto& [edits, journals, picture] = arguments.editing;
    if (!picture.empty() &&
        std::ranges::none_of(edits, [](const edit::Edit& e) { return e.filter || e.text == "--delete"; }))
        throw InputError("--dry-run: no option removes splats; see --where and others of ewa convert --help");
    check_files(app, arguments);
    read_all(arguments, work);
    const size_t read = work.gaussians.size();
    std::optional<folders::Run> run = arguments.run;
    if (edit_scene(arguments, work, run)) return 0;
    for (std::string& remark : io::match_file(work.gaussians, row)) work.lost.push_back(std::move(remark));

    const SceneSize size = scene_size(work.gaussians);
    const size_t count = size.splats;
    check_not_empty(arguments, read, count);
    make_folder(out.parent_path());
    constexpr size_t kShowFrom = 500'000;
    Progress progress("written", static_cast<int>(std::min<size_t>(count, 1u << 30)), "splats",
                      arguments.quiet || count < kShowFrom);
    work.save.progress = [&](uint64_t done, uint64_t) { progress.update(static_cast<int>(done)); };
    std::vector<std::string> remarks = work.lost;
    Dataset cameras;
    if (row.format == SplatFormat::page && run) show_run(*run, cameras, work.save.page, remarks);
    const std::vector<std::string> quantised = row.write
                                                   ? save_splats(out, work.gaussians, work.save)
                                                   : save_splats(out, std::move(work.gaussians), work.save);
    remarks.insert(remarks.end(), quantised.begin(), quantised.end());

    if (!arguments.quiet) {
        fmt::print("{}\n", described(out, row.name, "", size, fs::file_size(out)));
        const std::vector<fs::path> values = parts_of(out, arguments.output_options.unbundled);
        if (!values.empty())
            fmt::print("{}{}: the values of this {}, {}\n", core::one_line(values[0].string()),
                       values.size() > 1
                           ? fmt::format(" and {} other {}", values.size() - 1,
                                         row.format == SplatFormat::sog_meta ? "images" : "files")
                           : "",
                       row.name, core::bytes_text(bytes_of(values)));
        for (const std::string& remark : remarks) fmt::print("  {}\n", core::one_line(remark));
    }
    Json json = {{"inputs", work.inputs}, {"output", output_json(arguments, size)}, {"remarks", remarks}};
    if (!work.removed.empty()) json["removed"] = work.removed;
    if (arguments.check) json["check"] = check(arguments, work);
    if (!arguments.json.empty()) write_json(arguments.json, json);
    return 0;
}

}  // namespace

Action add_convert(CLI::App& app) {
    const auto arguments = std::make_shared<ConvertArguments>();
    io::OutputOptions& output = arguments->output_options;
    options::add(app, "FILES", arguments->files)->expected(1, -1);
    options::add(app, "output", arguments->output);
    for (const edit::Row& row : edit::rows()) options::add(app, row.name);
    options::add(app, "edits", arguments->editing.journals);
    options::add(app, "dry-run", arguments->editing.picture);
    options::add(app, "spz-version", output.spz_version);
    options::add(app, "gltf-spz", output.gltf_spz);
    options::add(app, "levels", output.levels);
    options::add(app, "unbundled", output.unbundled);
    options::add(app, "title", output.title);
    options::add(app, "views", arguments->views);
    options::add(app, "geo", output.geo);
    options::add(app, "level", arguments->level);
    options::add(app, "bake-sky", arguments->bake_sky);
    options::add(app, "allow-empty", arguments->allow_empty);
    options::add(app, "check", arguments->check);
    options::add(app, "json", arguments->json);
    options::add(app, "quiet", arguments->quiet);
    return [arguments, &app] {
        arguments->editing.edits = typed_edits(app);
        if (!arguments->output.empty()) arguments->files.push_back(arguments->output);
        // A picture of what would be removed needs no output.
        if (arguments->files.size() == 1 && !arguments->editing.picture.empty())
            arguments->files.emplace_back(arguments->editing.picture.string() + ".ply");
        if (arguments->files.size() < 2)
            throw InputError("FILES: an input and the output are needed, and there is only " +
                             core::one_line(arguments->files[0].string()));
        for (size_t i = 0; i + 1 < arguments->files.size(); ++i) {
            const PlacedInput input = parse_input(arguments->files[i].string());
            SplatInput splats = splat_input(input.file);
            if (arguments->files.size() == 2 && input.transform == glm::dmat4(1))
                arguments->run = splats.run ? std::move(splats.run) : folders::run_of_splats(splats.file);
            arguments->files[i] = splats.file;
            arguments->placements.push_back(input.transform);
        }
        return run(app, *arguments);
    };
}

}  // namespace ewa::cli
