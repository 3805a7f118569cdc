// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/save_choices.h"

#include <cmath>
#include <cstring>

#include "core/folders.h"
#include "core/messages.h"
#include "core/outputs.h"
#include "core/text.h"
#include "ewa/error.h"
#include "ewa/splat_files.h"
#include "folders/run_folder.h"
#include "viewer/editor/texts.h"

namespace ewa::viewer {
namespace {

namespace fs = std::filesystem;

constexpr const char *kNameless = "scene", *kEdited = "-edited";

fs::path with_extension(fs::path stem, const io::FormatRow& row) {
    if (!row.extension.starts_with('.')) return stem / row.extension;
    if (!stem.has_filename()) stem /= kNameless;
    stem += row.extension;
    return stem;
}

/// The file and those that hold its values.
std::vector<core::NamedFile> files_of_original(const fs::path& original) {
    std::vector<core::NamedFile> files{{"the file that was opened", original}};
    if (core::is_folder(original))
        files.push_back({"the splats of the run", original / folders::kSplatsFile});
    if (!core::is_file(original)) return files;
    const io::FormatRow& row = io::row_of(format_of_file(original));
    if (row.values)
        for (const fs::path& values : row.values(original)) files.push_back({"a file of its values", values});
    return files;
}

bool same_file(const fs::path& a, const fs::path& b) {
    std::error_code error;
    return fs::weakly_canonical(a, error) == fs::weakly_canonical(b, error) || fs::equivalent(a, b, error);
}

/// Whether the file is one of the chunks or tiles that writing `out` would replace.
bool is_part_of(const fs::path& file, const fs::path& out) {
    std::error_code error;
    const io::FormatRow* row = io::row_of_name(out);
    const fs::path folder = fs::weakly_canonical(file, error).parent_path();
    return row && row->names_part && row->names_part(folder.filename().string()) &&
           folder.parent_path() == fs::weakly_canonical(out, error).parent_path();
}

}  // namespace

fs::path stem_of(const fs::path& path) {
    const io::FormatRow* row = io::row_of_name(path);
    if (!row) return path;
    if (!row->extension.starts_with('.')) return path.parent_path();
    std::string name = path.filename().string();
    const bool usual = core::lower(name).ends_with(row->extension);
    name.resize(name.size() - (usual ? row->extension : row->other_extension).size());
    return path.parent_path() / name;
}

std::vector<std::string> losses(const io::FormatRow& row, const Gaussians& splats) {
    std::vector<std::string> lines;
    if (row.no_sh && splats.sh_degree > 0) lines.emplace_back(texts::files::kLostViewDependence);
    if (!row.rounding.empty()) lines.emplace_back(row.rounding);
    if (!row.world && splats.origin != glm::dvec3(0)) lines.emplace_back(texts::files::kLostWorld);
    if (!row.density && splats.density) lines.emplace_back(texts::files::kLostDensity);
    if (!row.undrawable) lines.emplace_back(texts::files::kLostBroken);
    std::string notes;
    if (!row.comments) notes = "comments";
    if (!row.mark) notes += notes.empty() ? "the mark" : " and the mark";
    if (!row.mark) notes += " of anti-aliased training";
    if (!notes.empty()) lines.push_back("It has no place for " + notes + ".");
    return lines;
}

uint64_t usual_bytes(const io::FormatRow& row, size_t splats, int sh_degree) {
    const int coefficients = (sh_degree + 1) * (sh_degree + 1) - 1;
    return uint64_t(
        std::llround(double(splats) * double(row.splat_bytes[0] + float(coefficients) * row.splat_bytes[1])));
}

std::string wrote_text(const fs::path& out, size_t splats) {
    std::error_code error;
    const io::FormatRow* row = io::row_of_name(out);
    uint64_t bytes = core::is_file(out) ? fs::file_size(out, error) : 0;
    if (row && row->values)
        for (const fs::path& values : row->values(out)) bytes += fs::file_size(values, error);
    const bool folder = row && !row->extension.starts_with('.');
    const fs::path name = (folder ? out.parent_path() : out).filename();
    return texts::files::kWrote + core::one_line(name.string()) + ", " + core::bytes_text(bytes) + ", " +
           core::grouped(splats) + " splats";
}

fs::path with_format(const fs::path& path, const io::FormatRow& row) {
    return io::row_of_name(path) == &row ? path : with_extension(stem_of(path), row);
}

fs::path proposed_file(const fs::path& file, const std::string& name, const io::FormatRow& row, size_t part) {
    if (file.empty()) return with_extension(stem_of(name), row);
    std::error_code error;
    fs::path stem = fs::absolute(file, error).lexically_normal();
    if (!stem.has_filename()) stem = stem.parent_path();  // of a folder
    stem = stem_of(stem);
    if (part > 1) return with_extension(stem += "-" + std::to_string(part), row);
    stem += kEdited;
    // An edited file gets the next number in place of another ending.
    const std::string whole = stem.string(), again = whole.substr(0, whole.size() - std::strlen(kEdited));
    const size_t at = again.rfind(kEdited), end = at + std::strlen(kEdited);
    if (at == std::string::npos) return with_extension(stem, row);
    const bool first = end == again.size();
    const auto number = first ? 1 : core::parse_integer<unsigned>(again.substr(end + 1));
    if (number && (first || again[end] == '-'))
        stem = again.substr(0, end) + "-" + std::to_string(*number + 1);
    return with_extension(stem, row);
}

std::string refusal(const fs::path& out, const std::vector<fs::path>& originals) {
    if (core::is_folder(out)) return texts::files::kIsAFolder;
    try {
        const io::FormatRow& row = io::row_to_write(out);
        std::vector<core::NamedFile> written{{"the file", out}}, read;
        if (row.beside) {
            const io::ValueFiles beside = row.beside(out);
            for (const fs::path& file : beside.written) written.push_back({"a file of values", file});
            for (const fs::path& file : beside.removed) written.push_back({"an older file of values", file});
        }
        for (const fs::path& original : originals) {
            if (original.empty()) continue;
            if (same_file(out, original)) return texts::files::kOriginalStays;
            if (is_part_of(original, out)) return texts::files::kPartOfOriginal;
            const std::vector<core::NamedFile> files = files_of_original(original);
            read.insert(read.end(), files.begin(), files.end());
        }
        core::check_outputs(written, read);
    } catch (const std::exception& error) {
        return core::one_line(error.what());
    }
    return {};
}

}  // namespace ewa::viewer
