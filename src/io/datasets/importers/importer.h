// SPDX-License-Identifier: Apache-2.0
// The importers of other programs' cameras, and how their files are recognised.
#pragma once
#include <array>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/datasets/image_records.h"

namespace ewa::core {
class JsonField;
}

namespace ewa::io {

class ImageFinder;

/// What an importer reads.
struct ImportSource {
    std::filesystem::path file;  // file with the cameras; if each image has its own file, the first of these
    std::filesystem::path dataset;  // the folder that the images are in or below
    bool with_points = true;
};

/// A file format of cameras. `read` keeps the file's world frame, and gives cameras OpenCV's axes. It throws InputError of one line
/// that names the file and the place in it.
struct CameraImporter {
    std::string_view format;  // Dataset::format
    /// Folders of a dataset that may hold the file. "" is the dataset's own folder.
    std::vector<std::string_view> places;
    /// The beginning that the file's name must have if the user does not name the file. Other files may lie beside photos.
    std::string_view usual;
    bool (*named)(const std::filesystem::path& name);  // whether a file's name may be of the format
    bool (*begins)(std::string_view head);             // whether these first bytes are; at most kHeadBytes
    ImageRecords (*read)(const ImportSource& source);
};
inline constexpr size_t kHeadBytes = size_t(1) << 16;

/// The programs, for messages.
inline constexpr std::string_view kImportedFrom =
    "OpenSfM, OpenDroneMap, OpenMVG, Metashape, RealityScan, Polycam, Record3D, Bundler, LLFF or INRIA's "
    "trainer";

/// All importers, in the order in which they are tried.
const std::vector<CameraImporter>& camera_importers();

struct FoundImporter {
    const CameraImporter* importer = nullptr;
    ImportSource source;
};

/// The importer of a dataset's folder, or of a file that the user names. Empty if none reads it.
std::optional<FoundImporter> find_importer(const std::filesystem::path& path);

/// Whether an entry of an archive has cameras, or may be a transforms.json. head: returns the entry's first bytes; only called
/// for names that fit.
bool is_imported(const std::filesystem::path& entry, const std::function<std::string()>& head);
/// Another file of the dataset's folder that has cameras and is not among the files that were read. Empty: none.
std::filesystem::path other_cameras(const std::filesystem::path& dataset, const FoundImporter& found,
                                    const std::vector<std::filesystem::path>& read);

/// Advice on what to export, if the path has a program's cameras in a form that ewa does not read, such as its project file. Or the
/// reason why a file does not have the format that its name states. Empty: no advice.
std::string export_advice(const std::filesystem::path& path);

/// Whether a file may be a transforms.json by its name: one that begins with "transforms", in any case.
bool is_named_transforms(const std::filesystem::path& name);

/// Whether these first bytes are of a file with frames.
bool begins_as_transforms(std::string_view head);

/// The first kHeadBytes of a file as text, without a byte order mark. ASCII in UTF-16 is ASCII. Empty if it cannot be read.
std::string head_of(const std::filesystem::path& file);

/// The folder's files in the order of names.
std::vector<std::filesystem::path> files_of_folder(const std::filesystem::path& folder);

/// Empty records, to be filled from one file of cameras. folder: the folder of the images.
ImageRecords begin_records(const ImportSource& source, std::string_view program,
                           const std::filesystem::path& folder);

/// The record of an image, with "width", "height" (px), "fx" and "fy" from its camera in the file.
ImageRecord begin_record(const ImageFinder& images, const std::string& name, const core::JsonField& camera);

/// Checks the intrinsics and the rotation of a record. `where` begins the errors.
void finish_record(ImageRecord& record, const std::string& where);

/// Adds the points of the folder's only PLY of points, unless the records have points already.
void add_points_beside(const std::filesystem::path& folder, bool with_points, ImageRecords& records);

/// A note about `count` images of the file without a pose, if there are any.
void note_unplaced(size_t count, ImageRecords& records);

/// The columns that a table of RealityScan's cameras must have, by its names.
inline constexpr std::array kCsvColumns{"name", "x", "y", "alt", "heading", "pitch", "roll", "f"};

/// Indices of the columns, by RealityScan's names.
using CsvColumns = std::map<std::string, size_t>;

/// The line of a table that names its columns: the first one with a comma, a semicolon or a tabulator. A line "#cameras N" may be
/// before it.
std::string_view reality_scan_heading(std::string_view head);

/// The columns that the line names. Other spellings, such as yaw for heading, count as RealityScan's names. If a name occurs twice,
/// the first one counts.
CsvColumns reality_scan_columns(std::string_view heading);

ImageRecords import_open_sfm(const ImportSource& source);
ImageRecords import_open_mvg(const ImportSource& source);
ImageRecords import_metashape(const ImportSource& source);
ImageRecords import_reality_scan_xmp(const ImportSource& source);
ImageRecords import_reality_scan_csv(const ImportSource& source);
ImageRecords import_polycam(const ImportSource& source);
ImageRecords import_record3d(const ImportSource& source);
ImageRecords import_inria(const ImportSource& source);
ImageRecords import_bundler(const ImportSource& source);
ImageRecords import_llff(const ImportSource& source);
ImageRecords import_camera_path(const ImportSource& source);

}  // namespace ewa::io
