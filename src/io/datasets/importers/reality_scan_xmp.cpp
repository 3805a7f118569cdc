// SPDX-License-Identifier: Apache-2.0
// The XMP files of RealityScan (once RealityCapture): one for each image, with the image's name.
//
// An rdf:Description has these in its own namespace, as attributes or as elements:
//   Rotation                          9 numbers, row after row, from the world to the camera (x right, y down, z forward)
//   Position                          the camera's centre
//   FocalLength35mm, PrincipalPointU, PrincipalPointV      RealityScanCalibration has their units
//   DistortionModel                   perspective, brown3, brown4, brown3t2, brown4t2 or division
//   DistortionCoeficients             k1 k2 k3 k4 t1 t2
#include <algorithm>
#include <array>

#include "core/folders.h"
#include "core/text.h"
#include "ewa/error.h"
#include "io/datasets/importers/image_finder.h"
#include "io/datasets/importers/importer.h"
#include "io/datasets/importers/reality_scan.h"
#include "io/datasets/importers/xml_field.h"
#include "io/datasets/rotation.h"

namespace ewa::io {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kXcr = "http://www.capturingreality.com/ns/xcr/";

/// The description in the namespace of RealityScan, and the prefix of that namespace with its colon.
struct XcrDescription {
    XmlField field;
    std::string prefix;

    /// An attribute's or an element's text; empty without either.
    std::string text(const char* name) const {
        const std::string full = prefix + name;
        if (std::string text = field.attribute(full.c_str()); !text.empty()) return text;
        const auto element = field.find(full.c_str());
        return element ? element->text() : std::string();
    }
    std::vector<double> numbers(const char* name, size_t count) const {
        const auto numbers = numbers_in(text(name), count);
        if (!numbers) field.fail(std::string(name) + " is not " + std::to_string(count) + " finite numbers");
        return *numbers;
    }
    double number(const char* name, double absent) const {
        return text(name).empty() ? absent : numbers(name, 1)[0];
    }
};

std::optional<XcrDescription> find_description(const XmlField& element, int depth) {
    for (const auto& [name, value] : element.attributes())
        if (name.starts_with("xmlns:") && value.starts_with(kXcr))
            return XcrDescription{element, std::string(name.substr(6)) + ":"};
    if (depth == 0) return std::nullopt;
    for (const XmlField& child : element.children())
        if (auto found = find_description(child, depth - 1)) return found;
    return std::nullopt;
}

/// The namespace may be declared above the description.
XmlField with_rotation(const XcrDescription& found, const XmlField& element, int depth) {
    if (!XcrDescription{element, found.prefix}.text("Rotation").empty() || depth == 0) return element;
    for (const XmlField& child : element.children()) {
        const XmlField inner = with_rotation(found, child, depth - 1);
        if (!XcrDescription{inner, found.prefix}.text("Rotation").empty()) return inner;
    }
    return element;
}

RealityScanCalibration calibration_in(const XcrDescription& xcr) {
    RealityScanCalibration calibration;
    calibration.focal = xcr.numbers("FocalLength35mm", 1)[0];
    calibration.u = xcr.number("PrincipalPointU", 0);
    calibration.v = xcr.number("PrincipalPointV", 0);
    if (xcr.number("Skew", 0) != 0 || xcr.number("AspectRatio", 1) != 1)
        xcr.field.fail(
            "a Skew other than 0 or an AspectRatio other than 1 is not supported; export as COLMAP");
    const std::string model = xcr.text("DistortionModel");
    if (model.empty() || model == "perspective") return calibration;
    if (!xcr.text("DistortionCoeficients").empty())
        calibration.terms = xcr.numbers("DistortionCoeficients", 6);
    const std::vector<double>& terms = calibration.terms;
    static constexpr std::array<std::string_view, 4> kBrown{"brown3", "brown4", "brown3t2", "brown4t2"};
    // Only its first term is known to be COLMAP's.
    calibration.division = model == "division" && std::all_of(terms.begin() + !terms.empty(), terms.end(),
                                                              [](double k) { return k == 0; });
    if (std::ranges::find(kBrown, model) == kBrown.end() && !calibration.division)
        xcr.field.fail("the DistortionModel \"" + model.substr(0, 60) +
                       "\" is not supported; align with brown4t2, or export undistorted images as COLMAP");
    return calibration;
}

/// Empty without a pose.
std::optional<ImageRecord> read_xmp(const fs::path& path, const ImageFinder& images) {
    constexpr int kDepth = 6;
    const std::string name = core::one_line(path.string());
    const XmlFile file(path);
    const XmlField top = file.top().called(name);
    std::optional<XcrDescription> xcr = find_description(top, kDepth);
    if (!xcr) return std::nullopt;
    xcr->field = with_rotation(*xcr, xcr->field, kDepth);
    if (xcr->text("Rotation").empty() || xcr->text("Position").empty()) return std::nullopt;
    ImageRecord record;
    images.find(path.stem().string(), name, record);
    set_calibration(record, calibration_in(*xcr), name);
    const std::vector<double> r = xcr->numbers("Rotation", 9), c = xcr->numbers("Position", 3);
    glm::dmat3 axes;  // the rows are the camera's axes in the world
    for (int i = 0; i < 9; ++i) axes[i / 3][i % 3] = r[size_t(i)];
    if (const std::string fault = rotation_fault(axes); !fault.empty())
        top.fail("Rotation is not a rotation: " + fault);
    set_pose(record.camera, nearest_rotation(axes), {c[0], c[1], c[2]});
    finish_record(record, name);
    return record;
}

}  // namespace

ImageRecords import_reality_scan_xmp(const ImportSource& source) {
    ImageRecords records;
    records.program = "RealityScan";
    const ImageFinder images(source.dataset, {"images"});
    records.folder = images.folder();
    size_t unplaced = 0;
    for (const fs::path& file : files_of_folder(source.file.parent_path())) {
        if (core::lower(file.extension().string()) != ".xmp" || !core::is_file(file)) continue;
        if (std::optional<ImageRecord> record = read_xmp(file, images)) {
            records.files.push_back(file);
            records.images.push_back(std::move(*record));
        } else {
            ++unplaced;
        }
    }
    note_unplaced(unplaced, records);
    add_points_beside(source.dataset, source.with_points, records);
    return records;
}

}  // namespace ewa::io
