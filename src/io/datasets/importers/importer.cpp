// SPDX-License-Identifier: Apache-2.0
#include "io/datasets/importers/importer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "core/file_reader.h"
#include "core/folders.h"
#include "core/json_field.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "io/datasets/importers/image_finder.h"

namespace ewa::io {

namespace {

namespace fs = std::filesystem;

std::string extension_in_lower_case(const fs::path& file) {
    return core::lower(file.extension().string());
}

bool is_json(const fs::path& name) {
    return extension_in_lower_case(name) == ".json";
}

bool holds(std::string_view head, std::string_view word) {
    return head.find(word) != std::string_view::npos;
}

/// A list of reconstructions, each with cameras and shots.
bool begins_as_open_sfm(std::string_view head) {
    const std::string_view text = core::trim(head);
    return !text.empty() && text.front() == '[' && (holds(text, "\"cameras\"") || holds(text, "\"shots\""));
}

template <const auto& extension>
bool has_extension(const fs::path& name) {
    return extension_in_lower_case(name) == extension;
}
constexpr std::string_view kXml = ".xml", kXmp = ".xmp", kCsv = ".csv", kOut = ".out";

bool begins_as_metashape(std::string_view head) {
    return holds(head, "<document") && holds(head, "<chunk");
}

/// RealityScan also writes files that have a calibration without a pose.
bool begins_as_reality_scan_xmp(std::string_view head) {
    return holds(head, "capturingreality.com/ns/xcr/") && holds(head, ":Rotation");
}

bool begins_as_reality_scan_csv(std::string_view head) {
    const CsvColumns columns = reality_scan_columns(reality_scan_heading(head));
    return std::ranges::all_of(std::array{"name", "heading", "pitch", "roll"},
                               [&](const char* column) { return columns.contains(column); });
}

bool begins_as_polycam(std::string_view head) {
    return holds(head, "\"t_00\"") && holds(head, "\"fx\"");
}

/// A .r3d has its metadata in a file without an extension.
bool is_record3d_metadata(const fs::path& name) {
    return name == "metadata" || name == "metadata.json";
}

bool begins_as_record3d(std::string_view head) {
    const std::string_view text = core::trim(head);
    return !text.empty() && text.front() == '{' &&
           (holds(text, "\"poses\"") || holds(text, "\"perFrameIntrinsicCoeffs\""));
}

bool begins_as_bundler(std::string_view head) {
    return head.starts_with("# Bundle file");
}

bool is_poses_bounds(const fs::path& name) {
    return name == "poses_bounds.npy";
}

bool begins_as_numpy(std::string_view head) {
    return head.starts_with("\x93NUMPY");
}

/// The cameras come far behind the keyframes.
bool begins_as_camera_path(std::string_view head) {
    return core::trim(head).starts_with('{') &&
           (holds(head, "\"camera_path\"") || holds(head, "\"keyframes\""));
}

bool begins_as_inria(std::string_view head) {
    const std::string_view text = core::trim(head);
    return !text.empty() && text.front() == '[' && holds(text, "\"img_name\"") && holds(text, "\"rotation\"");
}

bool begins_as_open_mvg(std::string_view head) {
    return holds(head, "\"sfm_data_version\"");
}

bool is_usual(const CameraImporter& importer, const fs::path& name) {
    return importer.named(name) && name.string().starts_with(importer.usual);
}

bool reads(const CameraImporter& importer, const fs::path& file) {
    return importer.named(file.filename()) && core::is_file(file) && importer.begins(head_of(file));
}

/// The dataset that the file is of: without the folder that the program made for it.
fs::path dataset_of_file(const CameraImporter& importer, const fs::path& file) {
    const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
    if (core::is_folder(folder / "images")) return folder;
    const fs::path whole = fs::absolute(folder / "x").lexically_normal().parent_path();
    for (const std::string_view place : importer.places) {
        const fs::path inner(place);
        const auto parts = size_t(std::distance(inner.begin(), inner.end()));
        fs::path above = whole, tail;
        for (size_t i = 0; i < parts; ++i, above = above.parent_path())
            tail = tail.empty() ? above.filename() : above.filename() / tail;
        if (parts > 0 && tail == inner && above != whole) {
            // As the user has named it, where that is possible.
            fs::path named = folder;
            for (size_t i = 0; i < parts; ++i) named = named.parent_path();
            return named.empty() ? above : named;
        }
    }
    return folder;
}

/// What a table lacks that is nearly one of RealityScan's: most of its columns are there. Empty for other files.
std::string nearly_reality_scan_csv(const fs::path& file) {
    if (!has_extension<kCsv>(file)) return {};
    const CsvColumns columns = reality_scan_columns(reality_scan_heading(head_of(file)));
    std::string missing;
    size_t there = 0;
    for (const char* column : kCsvColumns)
        if (columns.contains(column))
            ++there;
        else if (missing.empty())
            missing = column;
    if (missing.empty() || 2 * there <= kCsvColumns.size()) return {};
    return core::one_line(file.filename().string()) + " lacks the column " + missing +
           " of RealityScan's \"Internal/External camera parameters\"";
}

/// Files of programs that hold cameras in a form which only these programs read.
struct Unread {
    std::string_view name, extension, advice;
};
constexpr std::array kUnread{
    Unread{"sfm_data.bin", ".bin",
           "OpenMVG's binary file; make sfm_data.json of it: openMVG_main_ConvertSfM_DataFormat -i "
           "sfm_data.bin -o sfm_data.json"},
    Unread{"", ".psx", "a project of Metashape; export cameras.xml there: File, Export, Export Cameras"},
    Unread{"", ".psz", "a project of Metashape; export cameras.xml there: File, Export, Export Cameras"},
    Unread{"", ".rcproj",
           "a project of RealityCapture; export the registration there, as COLMAP or as XMP files"},
    Unread{"", ".rsproj",
           "a project of RealityScan; export the registration there, as COLMAP or as XMP files"},
    Unread{"", ".sfm", "a file of Meshroom; export the cameras there, as COLMAP or as sfm_data.json"},
    Unread{"", ".nvm", "a file of VisualSFM; open it in COLMAP, and export a model"}};

/// Files of other names than these may lie anywhere, so that only one which the user names is meant as cameras.
constexpr std::array kOther{
    Unread{"", ".xml", "not Metashape's file of cameras, which has <document> and <chunk> at its beginning"},
    Unread{"", ".zip", "empty, or not a zip archive"}, Unread{"", ".r3d", "not Record3D's archive"},
    Unread{"", ".xmp", "not RealityScan's file of a camera, which has a rotation"},
    Unread{"", ".csv",
           "not RealityScan's file of cameras, whose first line names name, heading, pitch and roll"}};

}  // namespace

bool is_named_transforms(const fs::path& name) {
    const std::string text = core::lower(name.filename().string());
    return text.starts_with("transforms") && text.ends_with(".json");
}

bool begins_as_transforms(std::string_view head) {
    return head.find("\"frames\"") != std::string_view::npos;
}

std::string head_of(const fs::path& file) try {
    core::FileReader reader(file);
    const size_t size = size_t(std::min<uint64_t>(reader.size(), kHeadBytes));
    std::string head(reinterpret_cast<const char*>(reader.take(size, "the beginning")), size);
    constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";  // of Windows' editors
    if (head.starts_with(kByteOrderMark)) head.erase(0, kByteOrderMark.size());
    // The reader of the format says that it is none of UTF-8.
    if (head.starts_with("\xff\xfe") || head.starts_with("\xfe\xff")) {
        head.erase(0, 2);
        std::erase(head, '\0');
    }
    return head;
} catch (const InputError&) {
    return {};
}

const std::vector<CameraImporter>& camera_importers() {
    static const std::vector<CameraImporter> importers{
        {"OpenSfM reconstruction",
         {"", "opensfm"},
         "reconstruction",
         is_json,
         begins_as_open_sfm,
         import_open_sfm},
        {"OpenMVG sfm_data", {""}, "sfm_data", is_json, begins_as_open_mvg, import_open_mvg},
        {"Metashape XML", {""}, "", has_extension<kXml>, begins_as_metashape, import_metashape},
        {"RealityScan CSV",
         {""},
         "",
         has_extension<kCsv>,
         begins_as_reality_scan_csv,
         import_reality_scan_csv},
        {"RealityScan XMP",
         {"", "images"},
         "",
         has_extension<kXmp>,
         begins_as_reality_scan_xmp,
         import_reality_scan_xmp},
        {"Polycam raw data",
         {"keyframes/corrected_cameras", "keyframes/cameras", "corrected_cameras", "cameras"},
         "",
         is_json,
         begins_as_polycam,
         import_polycam},
        {"Record3D", {""}, "metadata", is_record3d_metadata, begins_as_record3d, import_record3d},
        {"INRIA's cameras.json", {""}, "cameras", is_json, begins_as_inria, import_inria},
        {"Bundler", {"", "bundle"}, "", has_extension<kOut>, begins_as_bundler, import_bundler},
        {"LLFF poses_bounds.npy", {""}, "", is_poses_bounds, begins_as_numpy, import_llff},
        {"nerfstudio camera path", {}, "", is_json, begins_as_camera_path, import_camera_path}};
    return importers;
}

std::optional<FoundImporter> find_importer(const fs::path& path) {
    if (core::is_file(path)) {
        for (const CameraImporter& importer : camera_importers())
            if (reads(importer, path))
                return FoundImporter{&importer, {path, dataset_of_file(importer, path)}};
        return std::nullopt;
    }
    for (const CameraImporter& importer : camera_importers())
        for (const std::string_view place : importer.places) {
            const fs::path folder = place.empty() ? path : path / place;
            if (!core::is_folder(folder)) continue;
            for (const fs::path& file : files_of_folder(folder))
                if (is_usual(importer, file.filename()) && reads(importer, file))
                    return FoundImporter{&importer, {file, dataset_of_file(importer, file)}};
        }
    return std::nullopt;
}

fs::path other_cameras(const fs::path& dataset, const FoundImporter& found,
                       const std::vector<fs::path>& read) {
    for (const CameraImporter& importer : camera_importers())
        for (const std::string_view place : importer.places) {
            const fs::path folder = place.empty() ? dataset : dataset / place;
            // A program may write several kinds of its cameras, each in a folder of its own.
            if (&importer == found.importer && found.source.file.parent_path() != folder) continue;
            for (const fs::path& file : files_of_folder(folder))
                if (is_usual(importer, file.filename()) && std::ranges::find(read, file) == read.end() &&
                    reads(importer, file))
                    return file;
        }
    return {};
}

bool is_imported(const fs::path& entry, const std::function<std::string()>& head) {
    std::optional<std::string> read;
    if (is_named_transforms(entry) && begins_as_transforms(*(read = head()))) return true;
    return std::ranges::any_of(camera_importers(), [&](const CameraImporter& importer) {
        if (importer.places.empty() || !is_usual(importer, entry.filename())) return false;
        if (!read) read = head();
        return importer.begins(*read);
    });
}

std::string export_advice(const fs::path& path) {
    const auto advice = [](const fs::path& file, std::span<const Unread> list) -> std::string {
        for (const Unread& unread : list)
            if (extension_in_lower_case(file) == unread.extension &&
                (unread.name.empty() || file.filename() == unread.name))
                return core::one_line(file.filename().string()) + " is " + std::string(unread.advice);
        return {};
    };
    if (!core::is_folder(path)) {
        for (const std::string& text : {advice(path, kUnread), nearly_reality_scan_csv(path)})
            if (!text.empty()) return text;
        return advice(path, kOther);
    }
    for (const fs::path& file : files_of_folder(path))
        for (const std::string& text : {advice(file, kUnread), nearly_reality_scan_csv(file)})
            if (!text.empty()) return text;
    return {};
}

std::vector<fs::path> files_of_folder(const fs::path& folder) {
    constexpr size_t kMostFiles = 1000000;
    std::vector<fs::path> files;
    std::error_code error;
    for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
        if (files.size() < kMostFiles) files.push_back(at->path());
    std::sort(files.begin(), files.end());
    return files;
}

ImageRecords begin_records(const ImportSource& source, std::string_view program, const fs::path& folder) {
    ImageRecords records;
    records.program = program;
    records.files = {source.file};
    records.folder = folder;
    return records;
}

ImageRecord begin_record(const ImageFinder& images, const std::string& name, const core::JsonField& camera) {
    ImageRecord record;
    images.find(name, camera.where(), record);
    record.camera.width = camera.side("width");
    record.camera.height = camera.side("height");
    record.camera.fx = camera.number("fx");
    record.camera.fy = camera.number("fy");
    return record;
}

void finish_record(ImageRecord& record, const std::string& where) {
    const Camera& c = record.camera;
    const Distortion& d = record.distortion;
    bool finite = std::isfinite(c.fx) && std::isfinite(c.fy) && std::isfinite(c.cx) && std::isfinite(c.cy);
    for (const double term : {d.k1, d.k2, d.p1, d.p2, d.k3, d.k4, d.k5, d.k6, d.s1, d.s2, d.s3, d.s4, d.skew})
        finite = finite && std::isfinite(term);
    if (!finite) throw InputError(core::one_line(where + ": an intrinsic is not finite"));
    if (c.width > 0 && !(c.fx > 0 && c.fy > 0))
        throw InputError(core::one_line(where + ": a focal length is not positive"));
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) finite = finite && std::isfinite(c.rotation[i][k]);
    if (!finite) throw InputError(core::one_line(where + ": the rotation is not finite"));
}

void add_points_beside(const fs::path& folder, bool with_points, ImageRecords& records) {
    std::vector<fs::path> found;
    if (!records.points.positions.empty() || records.dropped.count > 0) return;
    for (const fs::path& file : files_of_folder(folder)) try {
            if (extension_in_lower_case(file) == ".ply" && core::is_file(file) && is_point_cloud(file))
                found.push_back(file);
        } catch (const InputError&) {
            continue;  // it may belong to something else
        }
    if (found.size() > 1)
        records.notes.push_back("points are in " + std::to_string(found.size()) +
                                " PLY files; --init FILE takes one");
    if (found.size() != 1) return;
    records.files.push_back(found[0]);
    if (!with_points) return;
    PlyPoints cloud = read_points_ply(found[0]);
    records.points = std::move(cloud.points);
    records.dropped = std::move(cloud.dropped);
}

void note_unplaced(size_t count, ImageRecords& records) {
    if (count > 0)
        records.notes.push_back(core::counted(uint64_t(count), "image") + " without a pose " +
                                std::string(core::is_or_are(count)) + " skipped");
}

}  // namespace ewa::io
