// SPDX-License-Identifier: Apache-2.0
// ewa convert: from any splat format to any other, edited on the way.
#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <set>

#include "cli/arguments.h"
#include "cli/checks.h"
#include "cli/command.h"
#include "cli/output.h"
#include "cli/progress.h"
#include "cli/splat_difference.h"
#include "cli/text.h"
#include "cli/transform_argument.h"
#include "core/text.h"
#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "ewa/splat_files.h"
#include "io/splats/gltf_splats.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;
using report::Json;

struct ConvertArguments {
    std::vector<fs::path> files;  // the last is written
    std::vector<std::string> transform;
    std::string crop, sort;
    double min_opacity = 0;
    int max_sh = kMaxShDegree, spz_version = 3;
    fs::path json;
    bool check = false, quiet = false;
};

struct Work {
    Gaussians gaussians;
    SaveOptions save;
    std::vector<std::string> lost;  // what was not taken of the inputs
    Json inputs = Json::array();
};

std::string described(const fs::path& path, SplatFormat format, const std::string& variant,
                      const Gaussians& gaussians) {
    return fmt::format("{}: {}{}, {} splats of SH degree {}, {}", core::one_line(path.string()),
                       name_of(format), variant.empty() ? "" : " (" + variant + ")", gaussians.size(),
                       gaussians.sh_degree, bytes_text(fs::file_size(path)));
}

/// Reads the inputs behind one another.
Work read_all(const ConvertArguments& arguments) {
    Work work;
    std::set<bool> marks;
    for (size_t i = 0; i + 1 < arguments.files.size(); ++i) {
        const fs::path& path = arguments.files[i];
        SplatScene scene = read_splats(path);
        if (!arguments.quiet)
            fmt::print("{}\n", described(path, scene.format, scene.variant, scene.gaussians));
        work.inputs.push_back({{"file", path.string()},
                               {"format", name_of(scene.format)},
                               {"splats", scene.gaussians.size()},
                               {"sh_degree", scene.gaussians.sh_degree}});
        for (const std::string& remark : scene.remarks) work.lost.push_back(path.string() + ": " + remark);
        for (std::string& comment : scene.comments)
            if (std::find(work.save.comments.begin(), work.save.comments.end(), comment) ==
                work.save.comments.end())
                work.save.comments.push_back(std::move(comment));
        marks.insert(scene.antialiased);
        if (i == 0)
            work.gaussians = std::move(scene.gaussians);
        else
            append_splats(work.gaussians, scene.gaussians);
    }
    work.save.antialiased = marks.contains(true);
    if (marks.size() > 1)
        work.lost.push_back("some inputs were trained anti-aliased and others not; all are marked so");
    return work;
}

template <typename Keep>
void keep_if(Gaussians& gaussians, const Keep& keep) {
    std::vector<uint32_t> kept;
    for (size_t i = 0; i < gaussians.size(); ++i)
        if (keep(i)) kept.push_back(static_cast<uint32_t>(i));
    if (kept.size() < gaussians.size()) select_splats(gaussians, kept);
}

/// x, y, z, X, Y, Z
using Box = std::array<double, 6>;

/// What the user asked for, read.
struct Edits {
    glm::dmat4 transform;
    std::optional<Box> crop;
};

Edits parse_edits(const ConvertArguments& arguments) {
    Edits edits{parse_transform(arguments.transform), {}};
    if (arguments.crop.empty()) return edits;
    const std::vector<double> n = parse_numbers("--crop", arguments.crop);
    if (n.size() != 6 || n[0] > n[3] || n[1] > n[4] || n[2] > n[5])
        throw InputError("--crop: '" + arguments.crop + "' is not x,y,z,X,Y,Z with the lower corner first");
    std::copy(n.begin(), n.end(), edits.crop.emplace().begin());
    return edits;
}

size_t drawable_count(const Gaussians& gaussians) {
    size_t count = 0;
    for (size_t i = 0; i < gaussians.size(); ++i) count += drawable(gaussians, i);
    return count;
}

/// Refuses what would leave less to see.
void transform(Gaussians& gaussians, const glm::dmat4& matrix) {
    if (matrix == glm::dmat4(1.0)) return;
    const size_t before = drawable_count(gaussians);
    transform_splats(gaussians, matrix);
    const size_t after = drawable_count(gaussians);
    if (after < before)
        throw InputError(
            fmt::format("--transform: {} of {} splats could not be drawn afterwards: a position or another "
                        "value leaves the range of float32 (3.4e38); a smaller step keeps them, and an "
                        "earlier convert --crop leaves them out",
                        before - after, before));
}

void crop(Gaussians& gaussians, const Box& n) {
    keep_if(gaussians, [&](size_t i) {
        bool inside = true;
        for (size_t axis = 0; axis < 3; ++axis) {
            const double v = gaussians.world_mean(i)[int(axis)];
            inside = inside && v >= n[axis] && v <= n[3 + axis];
        }
        return inside;
    });
}

/// What the user asked for, then what the format needs, so that the scene is what the file will hold.
void edit(const ConvertArguments& arguments, const Edits& edits, SplatFormat format, Work& work) {
    Gaussians& gaussians = work.gaussians;
    transform(gaussians, edits.transform);
    if (edits.crop) crop(gaussians, *edits.crop);
    if (arguments.min_opacity > 0)
        keep_if(gaussians, [&](size_t i) {
            return 1 / (1 + std::exp(-static_cast<double>(gaussians.opacity_logits[i]))) >=
                   arguments.min_opacity;
        });
    if (gaussians.sh_degree > arguments.max_sh) set_sh_degree(gaussians, arguments.max_sh);
    if (format != SplatFormat::ply) {
        const size_t before = gaussians.size();
        keep_if(gaussians, [&](size_t i) { return drawable(gaussians, i); });
        if (gaussians.size() < before)
            work.lost.push_back(
                fmt::format("{} splats have a value that is not finite or a zero quaternion and are left out",
                            before - gaussians.size()));
    }
    if (arguments.sort == "morton" || format == SplatFormat::compressed_ply)
        select_splats(gaussians, morton_order(gaussians));
}

Json check(const ConvertArguments& arguments, const Work& work) {
    Json json = Json::object();
    const SplatScene back = read_splats(arguments.files.back());
    if (!arguments.quiet) fmt::print("read back, the largest error and the mean:\n");
    for (const Difference& d : differences(work.gaussians, back.gaussians)) {
        if (!arguments.quiet) fmt::print("  {:<18} {:.3g}, {:.3g} {}\n", d.what, d.largest, d.mean, d.unit);
        json[d.what] = {{"largest", d.largest}, {"mean", d.mean}, {"unit", d.unit}};
    }
    return json;
}

/// The .bin that is written beside OUT, or none.
fs::path values_path(const ConvertArguments& arguments) {
    const fs::path& out = arguments.files.back();
    return format_of_name(out) == SplatFormat::gltf ? io::gltf_values_path(out) : fs::path();
}

/// What is written takes no other file's place, and can be written.
void check_outputs(const ConvertArguments& arguments) {
    const fs::path& out = arguments.files.back();
    const fs::path values = values_path(arguments);
    std::vector<NamedFile> others = {{"OUT", out}, {"the .bin of OUT", values}};
    for (size_t i = 0; i + 1 < arguments.files.size(); ++i) {
        const NamedFile input{"an input", arguments.files[i]};
        keep_apart({"the .bin of OUT", values}, {input});
        others.push_back(input);
    }
    keep_apart({"--json", arguments.json}, others);
    check_writable(out, Folder::there);
    if (!values.empty()) {
        io::check_gltf_values(out);
        check_writable(values, Folder::there);
    }
    if (!arguments.json.empty()) check_writable(arguments.json, Folder::made);
}

Json output_json(const ConvertArguments& arguments, const Gaussians& gaussians) {
    const fs::path& out = arguments.files.back();
    const fs::path values = values_path(arguments);
    Json json = {{"file", out.string()},
                 {"format", name_of(format_of_name(out))},
                 {"splats", gaussians.size()},
                 {"sh_degree", gaussians.sh_degree},
                 {"bytes", fs::file_size(out)}};
    if (!values.empty()) json["values"] = {{"file", values.string()}, {"bytes", fs::file_size(values)}};
    return json;
}

int run(const ConvertArguments& arguments) {
    const fs::path& out = arguments.files.back();
    const SplatFormat format = format_of_name(out);
    // Wrong use is found before the inputs are read.
    const Edits edits = parse_edits(arguments);
    check_outputs(arguments);
    Work work = read_all(arguments);
    edit(arguments, edits, format, work);

    const size_t count = work.gaussians.size();
    constexpr size_t kShowFrom = 500'000;
    Progress progress("written", static_cast<int>(std::min<size_t>(count, 1u << 30)), "splats",
                      arguments.quiet || count < kShowFrom);
    work.save.spz_version = arguments.spz_version;
    work.save.progress = [&](uint64_t done, uint64_t) { progress.update(static_cast<int>(done)); };
    const std::vector<std::string> quantised = save_splats(out, work.gaussians, work.save);
    std::vector<std::string> remarks = work.lost;
    remarks.insert(remarks.end(), quantised.begin(), quantised.end());

    if (!arguments.quiet) {
        fmt::print("{}\n", described(out, format, "", work.gaussians));
        if (const fs::path values = values_path(arguments); !values.empty())
            fmt::print("{}: the values of that glTF, {}\n", core::one_line(values.string()),
                       bytes_text(fs::file_size(values)));
        for (const std::string& remark : remarks) fmt::print("  {}\n", core::one_line(remark));
    }
    Json json = {
        {"inputs", work.inputs}, {"output", output_json(arguments, work.gaussians)}, {"remarks", remarks}};
    if (arguments.check) json["check"] = check(arguments, work);
    if (!arguments.json.empty()) write_json(arguments.json, json);
    return 0;
}

void add_editing_options(CLI::App& app, ConvertArguments& arguments) {
    app.add_option("--transform", arguments.transform,
                   "move=x,y,z, turn=x,y,z,degrees, scale=s, or a matrix of 12 or 16 numbers by rows. Repeat "
                   "it for several steps. Axes are those of a PLY: y down, z forward")
        ->type_name("STEP")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
        ->take_all();
    app.add_option("--crop", arguments.crop, "Keep the splats whose centre is in this box after --transform")
        ->type_name("x,y,z,X,Y,Z");
    app.add_option("--min-opacity", arguments.min_opacity, "Keep the splats with at least this opacity")
        ->check(in_range(0.0, 1.0))
        ->type_name("0..1");
    app.add_option("--max-sh", arguments.max_sh, "Highest SH degree to keep")
        ->check(in_range(0, kMaxShDegree))
        ->type_name("0..3");
    app.add_option("--sort", arguments.sort, "morton: sort splats along a space-filling curve")
        ->check(CLI::IsMember({"morton"}))
        ->type_name("ORDER");
}

}  // namespace

Action add_convert(CLI::App& app) {
    const auto arguments = std::make_shared<ConvertArguments>();
    app.add_option("FILES", arguments->files,
                   "One or more inputs, which are joined, then the output: .ply .compressed.ply .splat .spz "
                   ".glb .gltf")
        ->required()
        ->expected(2, -1)
        ->type_name("IN... OUT");
    add_editing_options(app, *arguments);
    app.add_option("--spz-version", arguments->spz_version,
                   "3 (every reader supports it) or 4 (newer and smaller)")
        ->check(CLI::IsMember({3, 4}))
        ->type_name("3|4")
        ->capture_default_str();
    app.add_flag("--check", arguments->check, "Read the output back and print the error of the conversion");
    app.add_option("--json", arguments->json, "Write the steps, the losses and the check to this file")
        ->type_name("FILE");
    app.add_flag("--quiet", arguments->quiet, "Print nothing but errors");
    return [arguments] { return run(*arguments); };
}

}  // namespace ewa::cli
